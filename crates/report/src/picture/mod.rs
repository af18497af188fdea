//! Pictures as SVG, for papers and pages: a summary, and one of every pair.

mod chart;
mod fit;
mod models;
pub(crate) mod pair;
mod plane;
mod scale;
mod scene;
pub(crate) mod style;

use std::fmt::Write;

use jointscope_detection::{JointKind, PairDetection};

use crate::{
    Report,
    pair_view::PairView,
    words::{knowledge, sentence},
};
use chart::document;
pub(crate) use chart::{HEIGHT, WIDTH};
use style::{FAINT, INK, escaped, icon, pixel, shortened};

/// Points of a chart in a picture.
const POINTS: usize = 1500;
/// Charts beside each other.
const COLUMNS: usize = 3;
/// Height of a heading, pixels.
const HEAD: f64 = 62.0;
/// Pairs that a summary names.
const LISTED: usize = 7;

/// A picture of the whole: the recording with the joints in it, and what every pair does.
pub fn to_svg(report: &Report<'_>) -> String {
    let detection = report.detection;
    let [width, height] = [WIDTH * COLUMNS as f64, 440.0];
    let mut svg = scene::draw(report, [620.0, height]);
    let mut y = 24.0;
    let order = in_order(report);
    for &pair in order.iter().take(LISTED) {
        svg += &line(&detection.pairs[pair], [644.0, y], 40);
        y += 54.0;
    }
    if order.len() > LISTED {
        let _ = write!(
            svg,
            "<text class=\"faint\" x=\"688\" y=\"{}\" font-size=\"12\" fill=\"{FAINT}\">and {} other pairs</text>",
            pixel(y + 12.0),
            order.len() - LISTED
        );
    }
    document([width, height], &svg)
}

/// The recording with the joints in it, and nothing else.
pub(crate) fn scene_alone(report: &Report<'_>) -> String {
    document([640.0, 520.0], &scene::draw(report, [640.0, 520.0]))
}

/// A picture of every pair, in the order of the detection.
pub fn pairs_to_svg(report: &Report<'_>) -> Vec<String> {
    let colours = style::colours(report.detection);
    report.detection.pairs.iter().map(|pair| of_pair(report, pair, &colours)).collect()
}

/// Pairs as a reader wants them: joints of the mechanism, further joints, the rest.
pub(crate) fn in_order(report: &Report<'_>) -> Vec<usize> {
    let detection = report.detection;
    let structure = &detection.structure;
    let tree: Vec<usize> = structure.branches.iter().filter_map(|branch| branch.pair).collect();
    let mut others: Vec<usize> = (0..detection.pairs.len()).filter(|pair| !tree.contains(pair)).collect();
    let loops = |pair: &usize| structure.indirect.iter().any(|other| other.pair == *pair && other.closes_loop);
    others.sort_by_key(|pair| (!loops(pair), detection.pairs[*pair].kind() == JointKind::Disconnected, *pair));
    [tree, others].concat()
}

/// A line about a pair: pictogram, sentence, what is known.
fn line(pair: &PairDetection, [x, y]: [f64; 2], most: usize) -> String {
    let doubt = if pair.determined { "" } else { " ?" };
    let known = [format!("{}, confidence {:.2}", pair.verdict.joint, pair.verdict.confidence), knowledge(pair)];
    let known = known.iter().filter(|part| !part.is_empty()).cloned().collect::<Vec<_>>().join(", ");
    format!(
        "<g transform=\"translate({0} {1})\">{2}</g>\
         <text class=\"ink\" x=\"{3}\" y=\"{4}\" font-size=\"14\" font-weight=\"600\" fill=\"{INK}\">{5}{doubt}</text>\
         <text class=\"faint\" x=\"{3}\" y=\"{6}\" font-size=\"12\" fill=\"{FAINT}\">{7}</text>",
        pixel(x),
        pixel(y),
        icon(pair.kind()),
        pixel(x + 44.0),
        pixel(y + 14.0),
        escaped(&shortened(&sentence(pair), most)),
        pixel(y + 31.0),
        escaped(&shortened(&known, most + 16)),
    )
}

fn of_pair(report: &Report<'_>, pair: &PairDetection, colours: &[&'static str]) -> String {
    let detection = report.detection;
    let view = PairView::of(detection, report.recording, pair);
    let seen = if view.swapped { &pair.reference } else { &pair.moving };
    let colour = detection.bodies.iter().position(|body| body == seen).map_or(INK, |body| colours[body]);
    let charts = pair::charts(pair, &view, report.recording, colour, POINTS);
    let rows = charts.len().div_ceil(COLUMNS);
    let mut svg = line(pair, [14.0, 14.0], 110);
    for (number, chart) in charts.iter().enumerate() {
        let (row, column) = (number / COLUMNS, number % COLUMNS);
        let _ = write!(
            svg,
            "<g transform=\"translate({} {})\">{chart}</g>",
            pixel(WIDTH * column as f64),
            pixel(HEAD + HEIGHT * row as f64)
        );
    }
    document([WIDTH * COLUMNS as f64, HEAD + HEIGHT * rows as f64], &svg)
}
