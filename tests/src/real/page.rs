//! The page about the real recordings.

use jointscope_detection::PairDetection;

use super::known::{FILES, FOLDERS};
use super::{EXPLANATIONS, Outcome, Truth};

/// The page `docs/real-recordings.md`: case by case, what two configurations find beside the truth.
pub fn page(outcomes: &[Outcome]) -> String {
    let (summary, rows) = (summary(outcomes), outcomes.iter().map(row).collect::<String>());
    let folders = FOLDERS.iter().map(|folder| (folder.name, folder.remark));
    let remarks = list(folders.chain(FILES.iter().map(|file| (file.name, file.remark))));
    let misses = list(EXPLANATIONS.iter().copied());
    format!(
        "# Real recordings\n\n\
         Recordings that others made of real joints, analysed with the thesis's method (`configs/thesis.toml`) and with\n\
         the default configuration (`likelihood`), nothing tuned for any of them. The recordings are not part of this\n\
         project; a test analyses them where they are present and compares this page. Write it anew with\n\n\
         ```sh\n\
         cargo run --release -p jointscope-tests --bin real-recordings > docs/real-recordings.md\n\
         ```\n\n\
         {summary}\n\
         A recording of one body is analysed against the world. Where the truth is certain, the verdict is right or wrong;\n\
         the thesis knows no planar and no spherical joints. Where it is undecidable, nothing may be determined; where\n\
         it is `not` a joint, that one may not be determined. `?`: not determined. Confidence: the verdict's. Residual:\n\
         root mean square, mm, from the joint of the verdict. Axis: its direction in the first body's coordinates, and by\n\
         how many degrees it may be off (one standard deviation), where the model can say.\n\n\
         | recording | frames | truth | thesis | | confidence | residual | likelihood | | confidence | residual | axis | ± |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n\
         {rows}\n\
         ## Misses\n\n\
         What the default configuration does not find as it should, and why:\n\n\
         {misses}\n\
         ## About the recordings\n\n{remarks}"
    )
}

/// A list of names and what is said of them.
fn list<'a>(items: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    items.map(|(name, text)| ["* `", name, "`: ", text, ".\n"].concat()).collect()
}

/// The table of counts.
fn summary(outcomes: &[Outcome]) -> String {
    type Condition = fn(Truth, &PairDetection) -> bool;
    let lines: [(&str, Condition, Condition); 5] = [
        ("certain joints found", |truth, pair| is_right(truth, pair) == Some(true), is_certain),
        ("found and determined", |truth, pair| pair.determined && is_right(truth, pair) == Some(true), is_certain),
        ("determined and wrong", |truth, pair| pair.determined && is_right(truth, pair) == Some(false), is_certain),
        ("undecidable ones determined", |_, pair| pair.determined, |truth, _| truth == Truth::Undecidable),
        (
            "traps fallen into",
            |truth, pair| truth.agrees(pair) == Some(false),
            |truth, _| matches!(truth, Truth::Not(_)),
        ),
    ];
    let line = |(what, counted, of): (&str, Condition, Condition)| {
        let count = |of_outcome: fn(&Outcome) -> &PairDetection| {
            let among = outcomes.iter().map(|outcome| (outcome.case.truth, of_outcome(outcome)));
            let among: Vec<_> = among.filter(|(truth, pair)| of(*truth, pair)).collect();
            let counted = among.iter().filter(|(truth, pair)| counted(*truth, pair)).count();
            format!("{counted} of {}", among.len())
        };
        format!("| {what} | {} | {} |\n", count(|outcome| &outcome.thesis), count(|outcome| &outcome.likelihood))
    };
    format!("| | thesis | likelihood |\n|---|---|---|\n{}", lines.map(line).concat())
}

fn is_certain(truth: Truth, _: &PairDetection) -> bool {
    matches!(truth, Truth::Joint(_))
}

/// Whether the verdict is right where the truth is certain.
fn is_right(truth: Truth, pair: &PairDetection) -> Option<bool> {
    truth.agrees(pair).filter(|_| is_certain(truth, pair))
}

fn row(outcome: &Outcome) -> String {
    let Outcome { case, thesis, likelihood } = outcome;
    let found = |pair: &PairDetection| {
        let fit = pair.models.get(&pair.verdict.joint).and_then(|fit| fit.as_ref().ok());
        format!(
            "{}{} | {} | {:.3} | {}",
            pair.verdict.joint,
            if pair.determined { "" } else { " ?" },
            match (case.truth.agrees(pair), case.truth) {
                (Some(false), _) => "**wrong**",
                (Some(true), Truth::Joint(_)) => "right",
                _ => "",
            },
            pair.verdict.confidence,
            fit.and_then(|fit| fit.residual_rms).map_or("-".into(), |rms| format!("{:.1}", 1000.0 * rms)),
        )
    };
    let axis = likelihood.axis.and_then(|axis| axis.direction).map_or("-".into(), |direction| {
        // Rounded zeros have no sign.
        let rounded = |x: f64| (1000.0 * x).round() / 1000.0 + 0.0;
        direction.iter().map(|x| format!("{:.3}", rounded(*x))).collect::<Vec<_>>().join(", ")
    });
    let angle = likelihood.axis_uncertainty.and_then(|uncertainty| uncertainty.angle);
    format!(
        "| {} | {} | {} | {} | {} | {axis} | {} |\n",
        case.name,
        likelihood.frames_used,
        case.truth,
        found(thesis),
        found(likelihood),
        angle.map_or("-".into(), |angle| format!("{:.2}", angle.to_degrees())),
    )
}
