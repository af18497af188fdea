//! What every joint scores over the scales of one body.

use jointscope_detection::PairDetection;

use super::{
    chart::{Chart, range},
    style::{AXIS, FAINT, INK},
};

/// Height of a word, in scores.
const LINE: f64 = 0.08;
/// Score that is worth a word.
const NAMED: f64 = 0.05;

/// The curve of every model, the verdict's in colour; `None` where no grid of scales was tried.
pub(super) fn scores(pair: &PairDetection) -> Option<String> {
    let scale = pair.scale.as_ref()?;
    let curve = scale.curve.as_ref()?;
    let across = range(curve.factors.iter().copied(), 0.0);
    let label = format!("scale of {}", curve.body);
    let mut chart = Chart::new("Score against scale", (across, &label), ([0.0, 1.08], ""));
    let (chosen, others): (Vec<_>, Vec<_>) = curve.scores.iter().partition(|(name, _)| **name == pair.verdict.joint);
    let mut words: Vec<[f64; 2]> = Vec::new();
    for (name, scores) in others.into_iter().chain(chosen) {
        let found = *name == pair.verdict.joint;
        let (line, ink) = if found { (AXIS, INK) } else { (FAINT, FAINT) };
        let points = curve.factors.iter().zip(scores).map(|(factor, score)| [*factor, *score]);
        chart.line(points.clone().map(Some), line, if found { 1.0 } else { 0.75 });
        let peak = points.fold([0.0, 0.0], |peak, point| if point[1] > peak[1] { point } else { peak });
        if peak[1] > NAMED {
            // Peaks that meet keep their words apart.
            let width = 0.25 * (across[1] - across[0]);
            let mut at = peak;
            while words.iter().any(|other| (other[0] - at[0]).abs() < width && (other[1] - at[1]).abs() < LINE) {
                at[1] -= LINE;
            }
            words.push(at);
            chart.word(at, name, ink);
        }
    }
    if let Some(factor) = scale.factor {
        chart.line([Some([factor, 0.0]), Some([factor, 1.0])], AXIS, 0.4);
        chart.word([factor, 0.0], &format!("{factor:.2}"), INK);
    }
    Some(chart.draw())
}
