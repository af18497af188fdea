//! What comes out of the cases.

use std::path::Path;

use jointscope_detection::{Detector, PairDetection};
use rayon::prelude::*;

use super::{Case, cases};
use crate::{THESIS, detector};

/// What two configurations make of a case.
#[derive(Debug)]
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// By the thesis's configuration.
    pub thesis: PairDetection,
    /// By the default configuration.
    pub likelihood: PairDetection,
}

/// The joint of a case.
///
/// # Panics
/// If the recording cannot be read or analysed.
pub fn analyse(case: &Case, detector: &Detector) -> PairDetection {
    let recording = case.recording().expect("a sound recording");
    detector.detect(recording, None).expect("two bodies, or one and the world").pairs.remove(0)
}

/// What comes out of all cases, in order.
///
/// # Panics
/// If a recording cannot be read or analysed.
pub fn outcomes(root: &Path) -> Vec<Outcome> {
    let (thesis, likelihood) = (detector(THESIS), detector(""));
    let outcome = |case: Case| {
        let (thesis, likelihood) = (analyse(&case, &thesis), analyse(&case, &likelihood));
        Outcome { case, thesis, likelihood }
    };
    cases(root).into_par_iter().map(outcome).collect()
}

/// One line about each case whose name contains some text, by one configuration; a line begins with `!` where the joint
/// is not what is known of it.
///
/// # Panics
/// If a recording cannot be read or analysed.
pub fn text(root: &Path, part: &str, detector: &Detector) -> String {
    let line = |case: Case| {
        let pair = analyse(&case, detector);
        let verdict = &pair.verdict;
        let mut ranked: Vec<&(String, f64)> = verdict.confidences.iter().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let ranked: Vec<String> = ranked.iter().take(3).map(|(joint, share)| format!("{joint} {share:.3}")).collect();
        format!(
            "{} {:<48} {:<12} -> {:<12} {} {:.3} [{}] {}\n",
            if case.truth.agrees(&pair) == Some(false) { '!' } else { ' ' },
            case.name,
            case.truth.to_string(),
            verdict.joint,
            if pair.determined { "determined" } else { "open      " },
            verdict.confidence,
            ranked.join(", "),
            pair.notes.join(" | "),
        )
    };
    let chosen: Vec<Case> = cases(root).into_iter().filter(|case| case.name.contains(part)).collect();
    chosen.into_par_iter().map(line).collect::<Vec<_>>().concat()
}
