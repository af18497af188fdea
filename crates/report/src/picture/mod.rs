//! Pictures as SVG, for papers and pages: a summary, and one of every pair.

mod chart;
mod fit;
mod lettering;
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
    words::{knowledge, sentence_with},
};
use chart::document;
pub(crate) use chart::{HEIGHT, WIDTH};
use lettering::Lettering;
use style::{FAINT, INK, escaped, icon, pixel};

/// Points of a chart in a picture.
const POINTS: usize = 1500;
/// Charts beside each other.
const COLUMNS: usize = 3;
/// Letters of a heading and of what is known, and how far their lines are apart, pixels.
const HEADING: Lettering = Lettering::bold(14.0);
const DETAIL: Lettering = Lettering::of(12.0);
const LEADING: [f64; 2] = [18.0, 16.0];
/// Width of a pictogram with the gap beside it, pixels.
const ICON: f64 = 44.0;
/// Share of a line that a name may take.
const NAME: f64 = 0.62;
/// Pairs that a summary names.
const LISTED: usize = 7;

/// A picture of the whole: the recording with the joints in it, and what every pair does.
pub fn to_svg(report: &Report<'_>) -> String {
    let detection = report.detection;
    let [width, height] = [WIDTH * COLUMNS as f64, 440.0];
    let mut svg = scene::draw(report, [620.0, height]);
    let [x, mut y] = [644.0, 24.0];
    let order = in_order(report);
    for &pair in order.iter().take(LISTED) {
        let (entry, below) = entry(&detection.pairs[pair], [x, y], width - x - 12.0);
        svg += &entry;
        y = below + 16.0;
    }
    if order.len() > LISTED {
        let _ = write!(
            svg,
            "<text class=\"faint\" x=\"688\" y=\"{}\" font-size=\"12\" fill=\"{FAINT}\">and {} other pairs</text>",
            pixel(y + 12.0),
            order.len() - LISTED
        );
        y += 28.0;
    }
    document([width, height.max(y)], &svg)
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

/// What is said of a pair within a width, and where it ends: pictogram, sentence, what is known.
fn entry(pair: &PairDetection, [x, y]: [f64; 2], width: f64) -> (String, f64) {
    let room = width - ICON;
    let doubt = if pair.determined { "" } else { " ?" };
    let sentence = sentence_with(pair, |name| HEADING.fitted(name, NAME * room));
    let joint = DETAIL.fitted(&pair.verdict.joint, NAME * room);
    let known = [format!("{joint}, confidence {:.2}", pair.verdict.confidence), knowledge(pair)];
    let parts: Vec<String> = known.into_iter().filter(|part| !part.is_empty()).collect();
    let whole = parts.join(", ");
    let known = if DETAIL.width(&whole) <= room { vec![whole] } else { parts };
    let mut svg = format!("<g transform=\"translate({} {})\">{}</g>", pixel(x), pixel(y), icon(pair.kind()));
    let [x, mut below] = [x + ICON, y - 4.0];
    for line in HEADING.lines(&(sentence + doubt), room) {
        below += LEADING[0];
        let _ = write!(
            svg,
            "<text class=\"ink\" x=\"{}\" y=\"{}\" font-size=\"14\" font-weight=\"600\" fill=\"{INK}\">{}</text>",
            pixel(x),
            pixel(below),
            escaped(&line)
        );
    }
    for line in known.iter().flat_map(|part| DETAIL.lines(part, room)) {
        below += LEADING[1];
        let _ = write!(
            svg,
            "<text class=\"faint\" x=\"{}\" y=\"{}\" font-size=\"12\" fill=\"{FAINT}\">{}</text>",
            pixel(x),
            pixel(below),
            escaped(&line)
        );
    }
    (svg, below.max(y + 32.0))
}

fn of_pair(report: &Report<'_>, pair: &PairDetection, colours: &[&'static str]) -> String {
    let detection = report.detection;
    let view = PairView::of(detection, report.recording, pair);
    let seen = if view.swapped { &pair.reference } else { &pair.moving };
    let colour = detection.bodies.iter().position(|body| body == seen).map_or(INK, |body| colours[body]);
    let charts = pair::charts(pair, &view, report.recording, colour, POINTS);
    let rows = charts.len().div_ceil(COLUMNS);
    let width = WIDTH * COLUMNS as f64;
    let (mut svg, below) = entry(pair, [14.0, 14.0], width - 28.0);
    let head = below + 12.0;
    for (number, chart) in charts.iter().enumerate() {
        let (row, column) = (number / COLUMNS, number % COLUMNS);
        let _ = write!(
            svg,
            "<g transform=\"translate({} {})\">{chart}</g>",
            pixel(WIDTH * column as f64),
            pixel(head + HEIGHT * row as f64)
        );
    }
    document([width, head + HEIGHT * rows as f64], &svg)
}
