//! What every joint scores over the scales of one body.

use jointscope_detection::PairDetection;

use super::{
    chart::{Chart, LEFT, RIGHT, WIDTH, range},
    lettering::Lettering,
    style::{AXIS, FAINT, INK},
};

/// Height of a word, in scores, and how many are tried to either side.
const LINE: f64 = 0.08;
const LINES: u8 = 12;
/// Those of a chart's words.
const LETTERS: Lettering = Lettering::of(10.5);
/// Scales from which on nobody needs to see which were tried.
const DOTTED: usize = 60;
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
    // Words and half their widths, in scales.
    let mut words: Vec<([f64; 2], f64)> = Vec::new();
    let half = |word: &str| 0.5 * LETTERS.width(word) / (WIDTH - LEFT - RIGHT) * (across[1] - across[0]);
    let within = |x: f64, half: f64| x.max(across[0] + half).min(across[1] - half);
    let found_at = scale.factor.map(|factor| ([factor, 0.0], format!("{factor:.2}")));
    words.extend(found_at.iter().map(|(at, word)| (*at, half(word))));
    for (name, scores) in others.into_iter().chain(chosen) {
        let found = *name == pair.verdict.joint;
        let (line, ink) = if found { (AXIS, INK) } else { (FAINT, FAINT) };
        let points = curve.factors.iter().zip(scores).map(|(factor, score)| [*factor, *score]);
        let opacity = if found { 1.0 } else { 0.75 };
        chart.line(points.clone().map(Some), line, opacity);
        if curve.factors.len() < DOTTED {
            chart.dots(points.clone(), 1.8, line, opacity);
        }
        let peak = points.fold([0.0, 0.0], |peak, point| if point[1] > peak[1] { point } else { peak });
        if peak[1] > NAMED {
            // Peaks that meet keep their words apart, one below the other or above; where there is no room, none is.
            let name = LETTERS.fitted(name, 0.5 * (WIDTH - LEFT - RIGHT));
            let wide = half(&name);
            let x = within(peak[0], wide);
            let free = |y: f64| {
                let meets =
                    |([other, at], width): &([f64; 2], f64)| (other - x).abs() < wide + width && (at - y).abs() < LINE;
                (0.0..=1.0).contains(&y) && !words.iter().any(meets)
            };
            let steps = (0..=LINES).map(|step| peak[1] - LINE * f64::from(step));
            let steps = steps.chain((1..=LINES).map(|step| peak[1] + LINE * f64::from(step)));
            if let Some(y) = steps.into_iter().find(|y| free(*y)) {
                words.push(([x, y], wide));
                chart.word([x, y], &name, ink);
            }
        }
    }
    if let Some((at, word)) = found_at {
        chart.line([Some(at), Some([at[0], 1.0])], AXIS, 0.4);
        chart.word(at, &word, INK);
    }
    Some(chart.draw())
}
