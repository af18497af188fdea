//! The pictures of one pair.

use std::fmt::Write;

use jointscope_detection::{JointKind, ModelFinding, PairDetection};

use jointscope_motion::Recording;
use nalgebra::{Matrix3, Point3, Vector3};

use super::{
    chart::{Chart, HEIGHT, WIDTH, range},
    style::{AXIS, BAND, FAINT, INK, RULE, escaped, pixel, shortened},
};
use crate::pair_view::{PairView, Trajectory, middle, reach};

/// Noise, in standard deviations, that tolerance bands show.
const TOLERANCE: f64 = 2.0;

/// Charts of a pair: the relative motion, how the joint fits it, positions, residuals, models; of the bodies' colours
/// that of the one seen. About `most` points are drawn in each.
pub(crate) fn charts(
    pair: &PairDetection,
    view: &PairView,
    recording: &Recording,
    colour: &str,
    most: usize,
) -> Vec<String> {
    let clock = Clock::of(recording);
    let mut charts = Vec::new();
    charts.extend(path(view, colour, most));
    charts.extend(fit(view, &clock, colour, most));
    charts.extend(positions(pair, view, &clock, colour, most));
    charts.extend(residuals(view, &clock, colour, most));
    charts.push(models(pair));
    charts
}

/// When frames are: seconds where times are known, else frames.
struct Clock<'r> {
    times: Option<&'r [f64]>,
    frames: usize,
}

impl<'r> Clock<'r> {
    fn of(recording: &'r Recording) -> Self {
        Self { times: recording.times(), frames: recording.frames() }
    }

    fn at(&self, frame: usize) -> f64 {
        self.times.map_or(frame as f64, |times| times[frame] - times[0])
    }

    fn axis(&self) -> ([f64; 2], &'static str) {
        let last = self.at(self.frames.saturating_sub(1));
        ([0.0, last.max(1e-9)], if self.times.is_some() { "time [s]" } else { "frame" })
    }
}

/// A length's unit by its size: factor from metres, and name.
fn unit(length: f64) -> (f64, &'static str) {
    if length < 0.5 { (1e3, "mm") } else { (1.0, "m") }
}

/// The directions in which points spread most, second and least, as columns.
fn spread<'p>(points: impl Iterator<Item = &'p Point3<f64>> + Clone) -> Matrix3<f64> {
    let count = points.clone().count().max(1) as f64;
    let centre = points.clone().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let scatter: Matrix3<f64> = points.map(|point| point.coords - centre).map(|x| x * x.transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // Signs of eigenvectors are arbitrary: the largest coordinate is positive.
    let column = |k: usize| {
        let column = eigen.eigenvectors.column(order[k]).into_owned();
        column * column[column.iamax()].signum()
    };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// The plane of a picture.
struct Plane {
    origin: Point3<f64>,
    across: Vector3<f64>,
    up: Vector3<f64>,
}

impl Plane {
    fn at(&self, point: &Point3<f64>) -> [f64; 2] {
        let from = point - self.origin;
        [from.dot(&self.across), from.dot(&self.up)]
    }

    /// Where the joint is seen best: along the axis of a turn, from the side of a slide, else where most is seen.
    fn of(view: &PairView) -> Self {
        let main = spread(view.points());
        let centre = Point3::from(
            view.points().map(|point| point.coords).sum::<Vector3<f64>>() / view.points().count().max(1) as f64,
        );
        let found = view.axis.filter(|_| view.kind.connects());
        match (found.and_then(|axis| Some((axis, axis.direction?))), view.kind) {
            (Some((axis, direction)), JointKind::Prismatic) => {
                let stilled = view.stilled().unwrap_or_default();
                let centred = centred(&stilled);
                let side = spread(centred.iter().flatten().map(|(_, point)| point));
                let flat = |v: Vector3<f64>| v - direction.into_inner() * direction.dot(&v);
                let up = [0, 1, 2].map(|k| flat(side.column(k).into_owned()));
                let up = up.into_iter().find(|v| v.norm() > 0.5).unwrap_or_else(|| flat(main.column(2).into_owned()));
                Self { origin: axis.point, across: direction.into_inner(), up: up.normalize() }
            }
            (Some((axis, direction)), _) => {
                let z = direction.into_inner();
                let flat = |v: Vector3<f64>| v - z * z.dot(&v);
                let x = flat(Vector3::ith(z.iamin(), 1.0)).normalize();
                Self { origin: axis.point, across: x, up: z.cross(&x) }
            }
            (None, _) => {
                let origin = found.map_or(centre, |axis| axis.point);
                Self { origin, across: main.column(0).into_owned(), up: main.column(1).into_owned() }
            }
        }
    }
}

/// Every trajectory about its own middle.
fn centred(ways: &[Trajectory]) -> Vec<Trajectory> {
    let about = |way: &Trajectory| {
        let middle = middle(way);
        way.iter().map(|(frame, point)| (*frame, Point3::from(point - middle))).collect()
    };
    ways.iter().map(about).collect()
}

/// The features' way as seen from the other body.
fn path(view: &PairView, colour: &str, most: usize) -> Option<String> {
    view.points().next()?;
    let plane = Plane::of(view);
    let (factor, name) = unit(reach(view.points()));
    let thinned = PairView::thinned(&view.trajectories, most);
    let at = |point: &Point3<f64>| plane.at(point).map(|x| x * factor);
    let pivot = view.axis.filter(|_| view.kind.connects() && view.kind != JointKind::Planar);
    let places: Vec<[f64; 2]> = thinned.iter().flatten().map(|(_, point)| at(point)).collect();
    // A pivot that is far away would make everything small.
    let near = pivot.is_some()
        && [0, 1].iter().all(|&axis| {
            let [low, high] = framed(places.iter().map(|p| p[axis]), None);
            let most = 4.0 * reach(view.points()) * factor;
            low < most && high > -most
        });
    let pivot_place = near.then_some(0.0);
    let bounds = |axis: usize| framed(places.iter().map(|p| p[axis]), pivot_place);
    let title = match view.kind {
        JointKind::Revolute | JointKind::Screw { .. } | JointKind::Cylindrical => "Motion, along the axis",
        JointKind::Prismatic => "Motion, from the side",
        JointKind::Planar => "Motion in the plane",
        _ => "Motion, widest view",
    };
    let label = format!("[{name}]");
    let mut chart = Chart::new(title, (bounds(0), &label), (bounds(1), &label)).square();
    for way in &thinned {
        chart.line(joined(way, &view.trajectories, |(_, point)| at(point)), colour, 0.6);
    }
    chart.dots(thinned.iter().filter_map(|way| way.last()).map(|(_, point)| at(point)), 2.6, colour, 1.0);
    if near {
        match view.kind {
            JointKind::Prismatic => {
                let along = range(places.iter().map(|p| p[0]), 0.0);
                chart.arrow([along[0], 0.0], [along[1], 0.0], AXIS);
            }
            _ => chart.pivot([0.0, 0.0], AXIS),
        }
    }
    Some(chart.draw())
}

/// A range that holds values, but for the wildest, and one that it must hold.
fn framed(values: impl Iterator<Item = f64>, within: Option<f64>) -> [f64; 2] {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return [0.0, 1.0];
    }
    let [low, high] = [0.01, 0.99].map(|share| jointscope_motion::quantile(&mut values, share));
    let near = (high - low) * 0.25;
    let tame = values.into_iter().filter(|x| *x >= low - near && *x <= high + near);
    range(tame.chain(within), 0.07)
}

/// The points of a way as a line, broken where the feature is not seen for long, or leaps.
fn joined<'w>(
    way: &'w Trajectory,
    whole: &[Trajectory],
    place: impl Fn(&(usize, Point3<f64>)) -> [f64; 2] + 'w,
) -> impl Iterator<Item = Option<[f64; 2]>> + 'w {
    let longest = whole.iter().map(Vec::len).max().unwrap_or(1);
    // Thinning leaves gaps of its own.
    let usual = 3 * longest.div_ceil(way.len().max(1)).max(2);
    let mut steps: Vec<f64> = way.windows(2).map(|pair| nalgebra::distance(&pair[0].1, &pair[1].1)).collect();
    let leap = 6.0 * jointscope_motion::quantile(&mut steps, 0.9) + f64::MIN_POSITIVE;
    way.iter().enumerate().flat_map(move |(k, sample)| {
        let before = k.checked_sub(1).map(|k| &way[k]);
        let apart = |&(frame, point): &(usize, Point3<f64>)| {
            sample.0 - frame > usual || nalgebra::distance(&point, &sample.1) > leap
        };
        [before.is_some_and(apart).then_some(None), Some(Some(place(sample)))].into_iter().flatten()
    })
}

/// How the joint fits: features on the unit circle, in a tube, at the plane, on a sphere, in one place.
fn fit(view: &PairView, clock: &Clock<'_>, colour: &str, most: usize) -> Option<String> {
    view.points().next()?;
    let tolerance = TOLERANCE * view.noise;
    let plane = Plane::of(view);
    let axis = view.axis.filter(|_| view.kind.connects());
    match (view.kind, axis) {
        (JointKind::Revolute | JointKind::Screw { .. } | JointKind::Cylindrical, Some(_)) => {
            let radius = |way: &Trajectory| {
                crate::joint_motion::median(way.iter().map(|(_, point)| norm(plane.at(point))).collect())
            };
            // Close to the axis there is no circle.
            let wide = |way: &&Trajectory| !way.is_empty() && radius(way) > 3.0 * view.noise && radius(way) > 1e-9;
            let ways: Vec<Trajectory> = view.trajectories.iter().filter(wide).cloned().collect();
            let typical = crate::joint_motion::median(ways.iter().map(radius).collect());
            if ways.is_empty() {
                return None;
            }
            let mut chart =
                Chart::new("On the unit circle", ([-1.3, 1.3], "in radii of each feature"), ([-1.3, 1.3], "")).square();
            let share = (tolerance / typical).min(0.9);
            chart.ring([0.0, 0.0], [1.0 - share, 1.0 + share], "band", BAND);
            for way in PairView::thinned(&ways, most) {
                let radius = radius(&way);
                chart.dots(way.iter().map(|(_, point)| plane.at(point).map(|x| x / radius)), 1.1, colour, 0.75);
            }
            chart.pivot([0.0, 0.0], AXIS);
            Some(chart.draw())
        }
        (JointKind::Prismatic, Some(_)) => {
            let ways = PairView::thinned(&centred(&view.trajectories), most);
            let stilled = PairView::thinned(&centred(&view.stilled()?), most);
            let offsets = stilled.iter().flatten().map(|(_, point)| 1e3 * plane_up(&plane, point));
            let [low, high] = range(offsets.chain([-1.6e3 * tolerance, 1.6e3 * tolerance]), 0.08);
            let (factor, name) = unit(reach(ways.iter().flatten().map(|(_, point)| point)));
            let along = |point: &Point3<f64>| factor * point.coords.dot(&plane.across);
            let across = range(ways.iter().flatten().map(|(_, point)| along(point)), 0.04);
            let mut chart = Chart::new(
                "In the tube",
                (across, &format!("along the axis [{name}]")),
                ([low, high], "beside it [mm]"),
            );
            chart.band([-1e3 * tolerance, 1e3 * tolerance], "band", BAND);
            for way in &ways {
                chart.dots(way.iter().map(|(_, p)| [along(p), 1e3 * plane_up(&plane, p)]), 1.1, colour, 0.75);
            }
            Some(chart.draw())
        }
        (JointKind::Planar, Some(axis)) => {
            let normal = axis.direction?.into_inner();
            let ways = PairView::thinned(&centred(&view.trajectories), most);
            let main = spread(ways.iter().flatten().map(|(_, point)| point));
            let (factor, name) = unit(reach(ways.iter().flatten().map(|(_, point)| point)));
            let at =
                |point: &Point3<f64>| [factor * point.coords.dot(&main.column(0)), 1e3 * point.coords.dot(&normal)];
            let all = || ways.iter().flatten().map(|(_, point)| at(point));
            let up = range(all().map(|p| p[1]).chain([-1.6e3 * tolerance, 1.6e3 * tolerance]), 0.08);
            let along = range(all().map(|p| p[0]), 0.04);
            let mut chart = Chart::new("At the plane", (along, &format!("along it [{name}]")), (up, "off it [mm]"));
            chart.band([-1e3 * tolerance, 1e3 * tolerance], "band", BAND);
            for way in &ways {
                chart.dots(way.iter().map(|(_, point)| at(point)), 1.1, colour, 0.75);
            }
            Some(chart.draw())
        }
        (JointKind::Spherical | JointKind::Universal, Some(axis)) => {
            let ways = PairView::thinned(&view.trajectories, most);
            let off = |way: &Trajectory| -> Vec<[f64; 2]> {
                let distances: Vec<f64> = way.iter().map(|(_, point)| nalgebra::distance(point, &axis.point)).collect();
                let middle = crate::joint_motion::median(distances.clone());
                way.iter().zip(distances).map(|((frame, _), d)| [clock.at(*frame), 1e3 * (d - middle)]).collect()
            };
            let lines: Vec<Vec<[f64; 2]>> = ways.iter().map(off).collect();
            let up = range(lines.iter().flatten().map(|p| p[1]).chain([-1.6e3 * tolerance, 1.6e3 * tolerance]), 0.08);
            let mut chart = Chart::new("On the sphere", clock.axis(), (up, "off it [mm]")).timed();
            chart.band([-1e3 * tolerance, 1e3 * tolerance], "band", BAND);
            for line in lines {
                chart.dots(line, 1.1, colour, 0.75);
            }
            Some(chart.draw())
        }
        (JointKind::Rigid, _) => {
            let ways = PairView::thinned(&centred(&view.trajectories), most);
            let at = |point: &Point3<f64>| [1e3 * point.coords.dot(&plane.across), 1e3 * point.coords.dot(&plane.up)];
            let all = || {
                ways.iter().flatten().flat_map(|(_, point)| at(point)).chain([-1.6e3 * tolerance, 1.6e3 * tolerance])
            };
            let both = range(all(), 0.08);
            let mut chart = Chart::new("In its place", (both, "[mm]"), (both, "[mm]")).square();
            chart.ring([0.0, 0.0], [0.0, 1e3 * tolerance], "band", BAND);
            for way in &ways {
                chart.dots(way.iter().map(|(_, point)| at(point)), 1.1, colour, 0.6);
            }
            Some(chart.draw())
        }
        _ => {
            let main = spread(view.points());
            let (factor, name) = unit(reach(view.points()));
            let side =
                Plane { origin: plane.origin, across: main.column(0).into_owned(), up: main.column(2).into_owned() };
            let at = |point: &Point3<f64>| side.at(point).map(|x| x * factor);
            let thinned = PairView::thinned(&view.trajectories, most);
            let all = || thinned.iter().flatten().map(|(_, point)| at(point));
            let label = format!("[{name}]");
            let mut chart = Chart::new(
                "Motion, from the side",
                (framed(all().map(|p| p[0]), None), &label),
                (framed(all().map(|p| p[1]), None), &label),
            )
            .square();
            for way in &thinned {
                chart.line(joined(way, &view.trajectories, |(_, point)| at(point)), colour, 0.6);
            }
            chart.dots(thinned.iter().filter_map(|way| way.last()).map(|(_, point)| at(point)), 2.6, colour, 1.0);
            Some(chart.draw())
        }
    }
}

fn norm([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

fn plane_up(plane: &Plane, point: &Point3<f64>) -> f64 {
    point.coords.dot(&plane.up)
}

/// Positions over time with the range they took: one chart of angles, one of lengths.
fn positions(pair: &PairDetection, view: &PairView, clock: &Clock<'_>, colour: &str, most: usize) -> Vec<String> {
    let Some(positions) = &pair.positions else { return Vec::new() };
    let freedoms = positions.freedoms();
    let is_angle = |freedom: usize| match view.kind {
        JointKind::Prismatic => false,
        JointKind::Cylindrical | JointKind::Planar => freedom == 0,
        _ => true,
    };
    let rows: Vec<Option<&[f64]>> = positions.iter().collect();
    let frames = jointscope_motion::evenly(rows.len(), most.max(50));
    let mut charts = Vec::new();
    for angles in [true, false] {
        let chosen: Vec<usize> = (0..freedoms).filter(|&freedom| is_angle(freedom) == angles).collect();
        if chosen.is_empty() || rows.iter().all(Option::is_none) {
            continue;
        }
        let values = || rows.iter().flatten().flat_map(|row| chosen.iter().map(|&k| row[k]));
        let largest = values().fold(0.0_f64, |most, q| most.max(q.abs()));
        let (factor, name) = if angles { (1_f64.to_degrees(), "deg") } else { unit(largest) };
        let up = range(values().map(|q| q * factor), 0.1);
        let title = if angles { "Angle" } else { "Travel" };
        let mut chart = Chart::new(title, clock.axis(), (up, &format!("[{name}]"))).timed();
        for (number, &freedom) in chosen.iter().enumerate() {
            let opacity = [1.0, 0.65, 0.4][number.min(2)];
            let at = |frame: &usize| rows[*frame].map(|row| [clock.at(*frame), row[freedom] * factor]);
            chart.line(frames.iter().map(at), colour, opacity);
        }
        if let &[only] = chosen.as_slice() {
            let [least, greatest] = range(rows.iter().flatten().map(|row| row[only] * factor), 0.0);
            let word = |q: f64| if name == "m" { format!("{q:.3}") } else { format!("{q:.1}") };
            chart.level(least, &word(least), FAINT);
            chart.level(greatest, &word(greatest), FAINT);
        }
        charts.push(chart.draw());
    }
    charts
}

/// What the joint does not explain, frame by frame, over the noise.
fn residuals(view: &PairView, clock: &Clock<'_>, colour: &str, most: usize) -> Option<String> {
    let all = &view.residuals;
    if all.is_empty() {
        return None;
    }
    let mut sorted: Vec<f64> = all.iter().map(|(_, residual)| 1e3 * residual).collect();
    // A single wild frame must not hide the others.
    let high = jointscope_motion::quantile(&mut sorted, 0.99) * 1.3;
    let expected = 1e3 * 3_f64.sqrt() * view.noise;
    let up = [0.0, high.max(1.25 * expected).max(1e-6)];
    let mut chart = Chart::new("Residuals", clock.axis(), (up, "rms [mm]")).timed();
    chart.band([0.0, expected], "band", BAND);
    let chosen = jointscope_motion::evenly(all.len(), most.max(50));
    chart.dots(chosen.iter().map(|&k| [clock.at(all[k].0), 1e3 * all[k].1]), 1.2, colour, 0.8);
    if expected > 0.0 {
        chart.level(expected, "noise", FAINT);
    }
    Some(chart.draw())
}

/// Every joint with its confidence, and what its model found.
fn models(pair: &PairDetection) -> String {
    let rows = &pair.verdict.confidences;
    let mut svg = format!(
        "<text class=\"ink\" x=\"14\" y=\"20\" font-size=\"13\" font-weight=\"600\" fill=\"{INK}\">Joints compared</text>\
         <g class=\"faint\" font-size=\"10.500\" fill=\"{FAINT}\" text-anchor=\"end\">\
         <text x=\"{0}\" y=\"20\">rms [mm]</text><text x=\"{1}\" y=\"20\">log evidence</text></g>",
        pixel(WIDTH - 6.0),
        pixel(WIDTH - 60.0)
    );
    let step = ((HEIGHT - 44.0) / rows.len().max(1) as f64).min(26.0);
    let found = |name: &str| pair.models.get(name).and_then(|finding: &ModelFinding| finding.as_ref().ok());
    let evidence = |name: &str| found(name)?.evidence.map(|evidence| -0.5 * evidence.noise_cost());
    let best = rows.iter().filter_map(|(name, _)| evidence(name)).fold(f64::NEG_INFINITY, f64::max);
    for (number, (name, confidence)) in rows.iter().enumerate() {
        let y = 40.0 + step * number as f64;
        let chosen = *name == pair.verdict.joint;
        let (bar, weight) = if chosen { (AXIS, "600") } else { (FAINT, "400") };
        let class = if chosen { "bar chosen" } else { "bar" };
        let evidence = evidence(name).map_or(String::new(), |evidence| {
            let behind = best - evidence;
            if behind < 0.05 { "best".into() } else { format!("−{}", compact(behind)) }
        });
        let residual = found(name).and_then(|fit| fit.residual_rms).map_or(String::new(), |rms| compact(1e3 * rms));
        let _ = write!(
            svg,
            "<text class=\"ink\" x=\"14\" y=\"{0}\" font-size=\"11.500\" font-weight=\"{weight}\" fill=\"{INK}\">{1}</text>\
             <rect class=\"rule-fill\" x=\"104\" y=\"{2}\" width=\"70\" height=\"9\" rx=\"4.500\" fill=\"{RULE}\"/>\
             <rect class=\"{class}\" x=\"104\" y=\"{2}\" width=\"{3}\" height=\"9\" rx=\"4.500\" fill=\"{bar}\"/>\
             <g class=\"faint\" font-size=\"10.500\" fill=\"{FAINT}\" text-anchor=\"end\"><text x=\"210\" y=\"{0}\">{4:.3}</text>\
             <text x=\"{5}\" y=\"{0}\">{evidence}</text><text x=\"{6}\" y=\"{0}\">{residual}</text></g>",
            pixel(y + 4.0),
            escaped(&shortened(name, 13)),
            pixel(y - 4.5),
            pixel((70.0 * confidence).max(0.0)),
            confidence,
            pixel(WIDTH - 60.0),
            pixel(WIDTH - 6.0)
        );
    }
    svg
}

/// Three digits, or fewer.
fn compact(x: f64) -> String {
    match x {
        x if x >= 1e5 => format!("{x:.0e}"),
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}
