//! The report as a page: one file that needs nothing else, for any browser.

mod space;

use std::fmt::Write;

use jointscope_detection::{Detection, JointKind, PairDetection};
use minijinja::{Environment, Value, context, value::Serde};
use serde::Serialize;

use crate::{
    Report,
    pair_view::PairView,
    picture::{self, HEIGHT, WIDTH, in_order, style},
    printable,
    words::{deed, knowledge, metres, sentence},
};

/// Points in the charts of all pairs, and least in each chart: what makes most of the file.
const POINTS: usize = 24_000;
const FEWEST: usize = 150;
/// Pairs that have charts; a reader of more reads the table.
const CHARTED: usize = 60;

/// The page. It shows everything that the detection says, in words, in charts and moving in space.
///
/// *Convention.* Bodies' names and notes are text, whatever is in them. Equal reports give equal bytes.
///
/// # Panics
/// Never: the template is part of the program, and all that it needs is given.
pub fn to_html(report: &Report<'_>) -> String {
    let detection = report.detection;
    let mut page = Environment::new();
    page.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    page.add_template("page.html", include_str!("page.html")).expect("the template is well-formed");
    let colours = style::colours(detection);
    let order = in_order(report);
    let most = (POINTS / detection.pairs.len().max(1)).clamp(FEWEST, 2500);
    let views: Vec<PairView> =
        detection.pairs.iter().map(|pair| PairView::of(detection, report.recording, pair)).collect();
    let pairs: Vec<Pair> =
        order.iter().take(CHARTED).map(|&index| Pair::of(report, index, &views[index], &colours, most)).collect();
    let joints: Vec<&String> = detection
        .pairs
        .first()
        .map_or_else(Vec::new, |pair| pair.verdict.confidences.iter().map(|(name, _)| name).collect());
    let rows: Vec<Row> = detection.pairs.iter().map(Row::of).collect();
    let content = context! {
        title => title(detection),
        subtitle => subtitle(detection),
        pairs => Value::from(Serde(&pairs)),
        scene => picture::scene_alone(report),
        tree => if detection.bodies.len() > 2 && detection.structure.branches.iter().any(|branch| branch.pair.is_some()) { tree(detection, &colours) } else { String::new() },
        indirect => indirect(detection),
        joints => joints.iter().map(|joint| printable(joint)).collect::<Vec<_>>(),
        rows => Value::from(Serde(&rows)),
        settings => report.settings.trim(),
        width => WIDTH,
        height => HEIGHT,
        data => space::data(report, &views, &colours),
        css => include_str!("page.css"),
        three => include_str!("../../assets/three/three.min.js"),
        script => include_str!("page.js"),
    };
    let page = page.get_template("page.html").and_then(|template| template.render(content));
    page.expect("the template finds what it needs")
}

fn title(detection: &Detection) -> String {
    let joints = detection.pairs.iter().filter(|pair| pair.kind().connects() && pair.kind() != JointKind::Rigid);
    let tree: Vec<usize> = detection.structure.branches.iter().filter_map(|branch| branch.pair).collect();
    match (detection.pairs.as_slice(), tree.as_slice()) {
        ([only], _) => printable(&sentence(only)),
        (_, [one]) => printable(&sentence(&detection.pairs[*one])),
        _ => format!("{} bodies, {} joints", detection.bodies.len(), joints.count().min(tree.len())),
    }
}

fn subtitle(detection: &Detection) -> String {
    let bodies: Vec<String> = detection.bodies.iter().take(8).map(|name| printable(name)).collect();
    let more = detection.bodies.len().saturating_sub(8);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let duration = detection.duration.map_or_else(String::new, |seconds| format!(", {seconds:.2} s"));
    format!("{}{more}; {} frames{duration}", bodies.join(", "), detection.frames)
}

/// What the page says of a pair.
#[derive(Serialize)]
struct Pair {
    number: usize,
    sentence: String,
    verdict: String,
    icon: String,
    determined: bool,
    free: bool,
    folded: bool,
    facts: Vec<[String; 2]>,
    charts: Vec<String>,
    notes: Vec<String>,
}

impl Pair {
    fn of(report: &Report<'_>, index: usize, view: &PairView, colours: &[&'static str], most: usize) -> Self {
        let detection = report.detection;
        let pair = &detection.pairs[index];
        let seen = if view.swapped { &pair.reference } else { &pair.moving };
        let colour = detection.bodies.iter().position(|body| body == seen).map_or(style::INK, |body| colours[body]);
        let free = pair.kind() == JointKind::Disconnected;
        let in_tree = detection.structure.branches.iter().any(|branch| branch.pair == Some(index));
        let known = knowledge(pair);
        let comma = if known.is_empty() { "" } else { ", " };
        Self {
            number: index + 1,
            sentence: printable(&sentence(pair)),
            verdict: format!(
                "{}, confidence {:.2}{comma}{known}",
                printable(&pair.verdict.joint),
                pair.verdict.confidence
            ),
            icon: style::icon(pair.kind()),
            determined: pair.determined,
            free,
            folded: !in_tree && detection.pairs.len() > 1,
            facts: facts(pair),
            charts: picture::pair::charts(pair, view, report.recording, colour, if in_tree { most } else { most / 2 }),
            notes: pair.notes.iter().map(|note| printable(note)).collect(),
        }
    }
}

fn facts(pair: &PairDetection) -> Vec<[String; 2]> {
    let triple = |xyz: [f64; 3]| xyz.map(|x| format!("{:.3}", x + 0.0)).join("  ").replace('-', "−");
    let mut facts = Vec::new();
    let mut tell = |name: &str, text: String| facts.push([name.to_owned(), text]);
    if let Some(axis) = pair.axis {
        let what = match pair.kind() {
            JointKind::Planar => "normal",
            _ => "axis direction",
        };
        if let Some(direction) = axis.direction {
            tell(what, triple(direction.into_inner().into()));
        }
        tell(
            if axis.direction.is_none() { "centre" } else { "through" },
            format!("{} m", triple(axis.point.coords.into())),
        );
    }
    let fit = pair.models.get(&pair.verdict.joint).and_then(|finding| finding.as_ref().ok());
    if let Some(rms) = fit.and_then(|fit| fit.residual_rms) {
        tell("residual of the fit, rms", metres(rms));
    }
    for (name, noise) in [(&pair.reference, pair.noise_reference), (&pair.moving, pair.noise_moving)] {
        if let Some(noise) = noise.position.filter(|noise| *noise > 0.0) {
            tell(&format!("noise of {}", printable(name)), metres(noise));
        }
    }
    tell("frames", pair.frames_used.to_string());
    facts
}

/// A row of the table.
#[derive(Serialize)]
struct Row {
    reference: String,
    moving: String,
    joint: String,
    determined: bool,
    confidences: Vec<Cell>,
    positions: String,
}

#[derive(Serialize)]
struct Cell {
    text: String,
    percent: String,
}

impl Row {
    fn of(pair: &PairDetection) -> Self {
        let cell =
            |confidence: f64| Cell { text: format!("{confidence:.3}"), percent: format!("{:.0}", 45.0 * confidence) };
        Self {
            reference: printable(&pair.reference),
            moving: printable(&pair.moving),
            joint: printable(&pair.verdict.joint),
            determined: pair.determined,
            confidences: pair.verdict.confidences.iter().map(|(_, confidence)| cell(*confidence)).collect(),
            positions: if pair.positions.is_some() { deed(pair) } else { String::new() },
        }
    }
}

/// The tree of bodies as nested lists.
fn tree(detection: &Detection, colours: &[&'static str]) -> String {
    let body = |index: usize| {
        format!("<i style=\"background:{}\"></i><b>{}</b>", colours[index], style::escaped(&detection.bodies[index]))
    };
    format!(
        "<ul><li><span class=\"node\">{}</span>{}</li></ul>",
        body(detection.structure.base),
        below(detection, detection.structure.base, &body)
    )
}

fn below(detection: &Detection, parent: usize, body: &dyn Fn(usize) -> String) -> String {
    let mut items = String::new();
    for branch in detection.structure.branches.iter().filter(|branch| branch.parent == parent) {
        let pair = branch.pair.map(|pair| &detection.pairs[pair]);
        let kind = pair.map_or(JointKind::Disconnected, PairDetection::kind);
        let text = pair.map_or("moves freely".to_owned(), |pair| {
            let doubt = if pair.determined { "" } else { " ?" };
            format!("{}{doubt}", deed(pair))
        });
        let _ = write!(
            items,
            "<li><span class=\"node\"><svg viewBox=\"0 0 32 32\" aria-hidden=\"true\">{}</svg>{}\
             <span class=\"faint-text\">{}</span></span>{}</li>",
            style::icon(kind),
            body(branch.child),
            style::escaped(&text),
            below(detection, branch.child, body)
        );
    }
    if items.is_empty() { items } else { format!("<ul>{items}</ul>") }
}

/// What is said of pairs beside the tree.
fn indirect(detection: &Detection) -> Vec<String> {
    const MOST: usize = 40;
    let told = detection.structure.indirect.iter().filter_map(|indirect| crate::words::follows(detection, indirect));
    let told: Vec<String> = told.map(|sentence| printable(&sentence)).collect();
    let coupled =
        detection.structure.couplings.iter().map(|coupling| printable(&crate::words::coupled(detection, coupling)));
    told.into_iter().take(MOST).chain(coupled).collect()
}
