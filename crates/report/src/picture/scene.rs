//! The recording in a picture, seen from the base: bodies on their way, and the joints where they are at the end.

use std::fmt::Write;

use jointscope_detection::JointKind;
use jointscope_models::Axis;
use jointscope_motion::Pose;
use nalgebra::{Point3, Rotation3, Unit, Vector3, distance};

use super::{
    lettering::Lettering,
    style::{AXIS, FAINT, INK, colours, escaped, pixel},
};
use crate::{
    Report,
    joint_motion::relative,
    outlook::Outlook,
    pair_view::{PairView, Trajectory, places, seen_from},
};

/// Points of all trajectories together.
const POINTS: usize = 7500;
const MARGIN: f64 = 46.0;
/// How far axes keep from the picture's edge, pixels.
const EDGE: f64 = 6.0;
/// Letters of the legend and of joints, and the widest name, pixels.
const LEGEND: Lettering = Lettering::of(13.0);
const NAME: Lettering = Lettering::of(12.5);
const WIDEST: f64 = 180.0;
/// No cone is drawn wider than this, radians.
const WIDE: f64 = 0.5;
/// Bodies in the legend.
const LISTED: usize = 14;

/// An orthographic picture of a size in pixels, with its corner at the origin.
pub(crate) fn draw(report: &Report<'_>, [width, height]: [f64; 2]) -> String {
    let detection = report.detection;
    let colours = colours(detection);
    let at_rest = vec![Some(Pose::identity()); detection.frames];
    let base = Some(&detection.poses[detection.structure.base]).filter(|poses| poses.iter().any(Option::is_some));
    let base = base.unwrap_or(&at_rest);
    let bodies: Vec<(usize, Vec<Trajectory>)> = report
        .recording
        .bodies()
        .iter()
        .filter_map(|body| {
            let index = detection.bodies.iter().position(|name| name == body.name())?;
            Some((index, seen_from(base, &places(body, &detection.poses[index]))))
        })
        .collect();
    let outlook = Outlook::of(bodies.iter().flat_map(|(_, ways)| ways.iter().flatten().map(|(_, point)| point)));
    let turn = outlook.turn();
    let flat = |point: &Point3<f64>| {
        let seen = turn * (point - outlook.centre);
        [seen.x, -seen.y]
    };
    let points = || bodies.iter().flat_map(|(_, ways)| ways.iter().flatten().map(|(_, point)| flat(point)));
    if points().next().is_none() {
        return String::new();
    }
    let bound = |axis: usize| super::chart::range(points().map(|p| p[axis]), 0.0);
    let [across, down] = [bound(0), bound(1)];
    let scale = ((width - 2.0 * MARGIN) / (across[1] - across[0])).min((height - 2.0 * MARGIN) / (down[1] - down[0]));
    let at = |point: &Point3<f64>| {
        let [x, y] = flat(point);
        [
            width / 2.0 + scale * (x - f64::midpoint(across[0], across[1])),
            height / 2.0 + scale * (y - f64::midpoint(down[0], down[1])),
        ]
    };
    let mut svg = String::new();
    let each = POINTS / bodies.len().max(1);
    for (index, ways) in &bodies {
        let colour = colours[*index];
        let mut path = String::new();
        for way in PairView::thinned(ways, each) {
            for (number, (_, point)) in way.iter().enumerate() {
                let [x, y] = at(point).map(pixel);
                let _ = write!(path, "{}{x} {y}", if number == 0 { "M" } else { "L" });
            }
        }
        let mut last = String::new();
        for (_, point) in ways.iter().filter_map(|way| way.last()) {
            let [x, y] = at(point).map(pixel);
            let _ = write!(last, "M{x} {y}h0");
        }
        let _ = write!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.35\" stroke-linejoin=\"round\"/>\
             <path d=\"{last}\" stroke=\"{colour}\" stroke-width=\"6\" stroke-linecap=\"round\"/>"
        );
    }
    let names: Vec<String> =
        bodies.iter().take(LISTED).map(|(index, _)| LEGEND.fitted(&detection.bodies[*index], WIDEST)).collect();
    let widest = names.iter().map(|name| LEGEND.width(name)).fold(0.0, f64::max);
    let legend = [32.0 + widest, 12.0 + 20.0 * names.len() as f64];
    let free = |[x, y]: [f64; 2]| {
        let within = x > EDGE && x < width - EDGE && y > EDGE && y < height - EDGE;
        within && (x > legend[0] || y > legend[1])
    };
    let mut joints = String::new();
    for &pair in &detection.structure.branches.iter().filter_map(|branch| branch.pair).collect::<Vec<_>>() {
        let pair = &detection.pairs[pair];
        let reference = detection.bodies.iter().position(|body| *body == pair.reference).unwrap_or(0);
        let pose = relative(base, &detection.poses[reference]).into_iter().flatten().next_back();
        let Some(axis) = pair.axis.map(|axis| axis.seen_from(&pose.unwrap_or_default())) else { continue };
        let moving = detection.bodies.iter().position(|body| *body == pair.moving);
        let ways = bodies.iter().find(|(index, _)| Some(*index) == moving).map_or(&[][..], |(_, ways)| ways);
        let ends: Vec<&Point3<f64>> = ways.iter().filter_map(|way| way.last()).map(|(_, point)| point).collect();
        let arm = ends.iter().map(|point| distance(point, &axis.point)).fold(0.0, f64::max);
        let half = (1.1 * arm).clamp(0.05 * outlook.size, 0.5 * outlook.size);
        let Some(shown) = shown(&axis, half, |point| free(at(point))) else { continue };
        joints += &joint(&axis, pair.kind(), pair.axis_uncertainty.and_then(|known| known.angle), shown, &at);
        let name = NAME.fitted(&pair.verdict.joint, WIDEST);
        let [x, y] = at(&along(&axis, 0.0_f64.clamp(shown[0], shown[1])));
        let left = (x + 11.0).min(width - EDGE - NAME.width(&name));
        let _ = write!(
            joints,
            "<text class=\"ink halo\" x=\"{}\" y=\"{}\" font-size=\"12.500\" fill=\"{INK}\" stroke=\"#ffffff\" stroke-width=\"3\" \
             paint-order=\"stroke\">{}</text>",
            pixel(left),
            pixel(y + 4.0),
            escaped(&name)
        );
    }
    let [w, h] = [width, height].map(pixel);
    let _ = write!(svg, "<svg width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">{joints}</svg>");
    for (row, ((index, _), name)) in bodies.iter().zip(&names).enumerate() {
        svg += &listed(row, name, colours[*index]);
    }
    svg + &ruler(scale, [width, height])
}

/// A row of the legend.
fn listed(row: usize, name: &str, colour: &str) -> String {
    let y = 24.0 + 20.0 * row as f64;
    format!(
        "<circle cx=\"16\" cy=\"{}\" r=\"5\" fill=\"{colour}\"/><text class=\"ink halo\" x=\"28\" y=\"{}\" font-size=\"13\" \
         fill=\"{INK}\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>",
        pixel(y - 4.5),
        pixel(y),
        escaped(name)
    )
}

/// A place on the axis, metres from its point.
fn along(axis: &Axis, length: f64) -> Point3<f64> {
    axis.point + axis.direction.map_or_else(Vector3::zeros, |direction| direction.into_inner() * length)
}

/// From where to where an axis is drawn, metres along it: within the half length to both sides of its point, the longest
/// part where there is room; `None` where there is none.
fn shown(axis: &Axis, half: f64, free: impl Fn(&Point3<f64>) -> bool) -> Option<[f64; 2]> {
    /// Parts in which it is tried.
    const PARTS: i32 = 120;
    if axis.direction.is_none() {
        return free(&axis.point).then_some([0.0, 0.0]);
    }
    let lengths: Vec<f64> = (0..=PARTS).map(|k| half * f64::from(2 * k - PARTS) / f64::from(PARTS)).collect();
    let runs = lengths.chunk_by(|a, b| free(&along(axis, *a)) == free(&along(axis, *b)));
    let longest = runs.filter(|run| free(&along(axis, run[0]))).max_by_key(|run| run.len())?;
    Some([*longest.first()?, *longest.last()?])
}

/// A length of the picture, as a round number.
fn ruler(scale: f64, [_, height]: [f64; 2]) -> String {
    let rough = 120.0 / scale;
    let power = 10_f64.powf(rough.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|step| step * power).find(|length| *length <= rough).unwrap_or(power);
    let y = height - 18.0;
    format!(
        "<path class=\"faint-line\" d=\"M16 {0}v6h{1}v-6\" fill=\"none\" stroke=\"{FAINT}\"/>\
         <text class=\"faint\" x=\"{2}\" y=\"{3}\" font-size=\"11\" fill=\"{FAINT}\">{4}</text>",
        pixel(y - 6.0),
        pixel(length * scale),
        pixel(24.0 + length * scale),
        pixel(y + 2.0),
        crate::words::metres(length)
    )
}

/// The axis with the cone within which it lies, two standard deviations wide, or a point. Of the axis, what is shown, in
/// metres along it.
fn joint(
    axis: &Axis,
    kind: JointKind,
    uncertainty: Option<f64>,
    shown: [f64; 2],
    at: &impl Fn(&Point3<f64>) -> [f64; 2],
) -> String {
    let [x, y] = at(&axis.point).map(pixel);
    let pivot = format!(
        "<g class=\"axis\"><circle cx=\"{x}\" cy=\"{y}\" r=\"6\" fill=\"#ffffff\" fill-opacity=\"0.8\" stroke=\"{AXIS}\" \
         stroke-width=\"2\"/><circle cx=\"{x}\" cy=\"{y}\" r=\"1.800\" fill=\"{AXIS}\"/></g>"
    );
    let Some(direction) = axis.direction else { return pivot };
    let [from, to] = shown;
    let inside = from <= 0.0 && to >= 0.0;
    let mut svg = String::new();
    if let Some(angle) = uncertainty.filter(|_| inside) {
        // A wide one says that little is known, and must not hide what is.
        let spread = (2.0 * angle).min(WIDE);
        let opacity = if 2.0 * angle < WIDE { 0.16 } else { 0.08 };
        let side = Unit::new_normalize(direction.cross(&Vector3::ith(direction.iamin(), 1.0)));
        let rim = |length: f64, turn: f64| {
            let side = Rotation3::from_axis_angle(&direction, turn) * side;
            axis.point
                + direction.into_inner() * (length * spread.cos())
                + side.into_inner() * (length.abs() * spread.sin())
        };
        // Of the rim, what is farthest to either side of the axis as it is seen.
        let [ex, ey] = at(&along(axis, if to > -from { to } else { from }));
        let [px, py] = at(&axis.point);
        let beside = |point: &Point3<f64>| {
            let [x, y] = at(point);
            (x - px) * (ey - py) - (y - py) * (ex - px)
        };
        for length in [to, from] {
            let rims: Vec<Point3<f64>> =
                (0..36).map(|k| rim(length, f64::from(k) * std::f64::consts::TAU / 36.0)).collect();
            let one = rims.iter().max_by(|a, b| beside(a).total_cmp(&beside(b)));
            let other = rims.iter().min_by(|a, b| beside(a).total_cmp(&beside(b)));
            if let (Some(one), Some(other)) = (one, other) {
                let ([ax, ay], [bx, by]) = (at(one).map(pixel), at(other).map(pixel));
                let _ = write!(
                    svg,
                    "<path class=\"cone\" d=\"M{x} {y}L{ax} {ay}L{bx} {by}Z\" fill=\"{AXIS}\" fill-opacity=\"{opacity}\"/>"
                );
            }
        }
    }
    let arrow = kind == JointKind::Prismatic;
    let ([ax, ay], [bx, by]) = (at(&along(axis, from)), at(&along(axis, to)));
    let _ = write!(
        svg,
        "<path class=\"axis\" d=\"M{} {}L{} {}\" stroke=\"{AXIS}\" stroke-width=\"2.200\" stroke-linecap=\"round\"/>",
        pixel(ax),
        pixel(ay),
        pixel(bx),
        pixel(by)
    );
    if arrow && to > from {
        let length = (bx - ax).hypot(by - ay).max(1e-9);
        let [dx, dy] = [(bx - ax) / length * 9.0, (by - ay) / length * 9.0];
        let _ = write!(
            svg,
            "<path class=\"axis\" d=\"M{} {}L{} {}L{} {}\" fill=\"none\" stroke=\"{AXIS}\" stroke-width=\"2.200\" stroke-linecap=\"round\"/>",
            pixel(bx - dx - dy * 0.6),
            pixel(by - dy + dx * 0.6),
            pixel(bx),
            pixel(by),
            pixel(bx - dx + dy * 0.6),
            pixel(by - dy - dx * 0.6)
        );
        return svg;
    }
    if inside { svg + &pivot } else { svg }
}
