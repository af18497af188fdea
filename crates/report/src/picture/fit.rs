//! How the joint fits: features on the unit circle or its ellipse, in a tube, at a plane, on a sphere, in one place.

use jointscope_detection::JointKind;
use nalgebra::{Point3, Unit, Vector3, distance};

use super::{
    chart::{Chart, range},
    plane::{Clock, Plane, centred, framed, joined, spread, unit},
    style::{AXIS, BAND},
};
use crate::{
    joint_motion::median,
    pair_view::{PairView, Trajectory, reach},
};

/// Noise, in standard deviations, that tolerance bands show; and how much more than that is shown at least.
const TOLERANCE: f64 = 2.0;
const ROOM: f64 = 1.6;
/// Radii that are no wider than so many standard deviations of noise show no circle.
const WIDE: f64 = 3.0;

/// The chart that suits the joint, with about `most` points; `None` where nothing is seen.
pub(super) fn fit(view: &PairView, clock: &Clock<'_>, colour: &str, most: usize) -> Option<String> {
    view.points().next()?;
    let axis = view.axis.filter(|_| view.kind.connects());
    let direction = axis.and_then(|axis| axis.direction);
    let chart = match (view.kind, direction, axis) {
        (JointKind::Revolute | JointKind::Screw { .. } | JointKind::Cylindrical, Some(_), _) => {
            on_the_ellipse(view, &Plane::of(view), 1.0, colour, most)?
        }
        (JointKind::Elliptical { ratio, long_axis }, Some(normal), Some(axis)) => {
            let plane = Plane { origin: axis.point, across: long_axis.into_inner(), up: normal.cross(&long_axis) };
            on_the_ellipse(view, &plane, ratio, colour, most)?
        }
        (JointKind::Prismatic, Some(_), _) => in_the_tube(view, colour, most)?,
        (JointKind::Planar, Some(normal), _) => at_the_plane(view, &normal, colour, most),
        (JointKind::Spherical | JointKind::Universal, _, Some(axis)) => {
            on_the_sphere(view, &axis.point, clock, colour, most)
        }
        (JointKind::Rigid, ..) => in_place(view, colour, most),
        _ => from_the_side(view, colour, most),
    };
    Some(chart.draw())
}

/// Millimetres of the tolerance, and of what is shown at least to either side.
fn tolerance(view: &PairView) -> (f64, [f64; 2]) {
    let tolerance = 1e3 * TOLERANCE * view.noise;
    (tolerance, [-ROOM * tolerance, ROOM * tolerance])
}

/// Every feature's way across the axis, in units of its own radius or long semi-axis, which lies across.
fn on_the_ellipse(view: &PairView, plane: &Plane, ratio: f64, colour: &str, most: usize) -> Option<Chart> {
    let norm = |[x, y]: [f64; 2]| x.hypot(y / ratio);
    let radius = |way: &Trajectory| median(way.iter().map(|(_, point)| norm(plane.at(point))).collect());
    let wide = |way: &&Trajectory| !way.is_empty() && radius(way) > (WIDE * view.noise).max(1e-9);
    let ways: Vec<Trajectory> = view.trajectories.iter().filter(wide).cloned().collect();
    if ways.is_empty() {
        return None;
    }
    let typical = median(ways.iter().map(radius).collect());
    let share = (TOLERANCE * view.noise / typical).min(0.9);
    let bounds = [-1.3, 1.3];
    let (title, label) = if ratio < 1.0 {
        ("On the ellipse", "in long semi-axes of each feature")
    } else {
        ("On the unit circle", "in radii of each feature")
    };
    let mut chart = Chart::new(title, (bounds, label), (bounds, "")).square();
    chart.ring([0.0, 0.0], [1.0 - share, 1.0 + share], ratio, "band", BAND);
    for way in PairView::thinned(&ways, most) {
        let radius = radius(&way);
        chart.dots(way.iter().map(|(_, point)| plane.at(point).map(|x| x / radius)), 1.1, colour, 0.75);
    }
    chart.pivot([0.0, 0.0], AXIS);
    Some(chart)
}

/// Every feature's way along the axis, and beside it.
fn in_the_tube(view: &PairView, colour: &str, most: usize) -> Option<Chart> {
    let plane = Plane::of(view);
    let (tolerance, room) = tolerance(view);
    let ways = PairView::thinned(&centred(&view.trajectories), most);
    let stilled = PairView::thinned(&centred(&view.stilled()?), most);
    let (factor, name) = unit(reach(ways.iter().flatten().map(|(_, point)| point)));
    let along = |point: &Point3<f64>| factor * point.coords.dot(&plane.across);
    let beside = |point: &Point3<f64>| 1e3 * point.coords.dot(&plane.up);
    let up = framed(stilled.iter().flatten().map(|(_, point)| beside(point)), None);
    let across = range(ways.iter().flatten().map(|(_, point)| along(point)), 0.04);
    let mut chart = Chart::new(
        "In the tube",
        (across, &format!("along the axis [{name}]")),
        (range(up.into_iter().chain(room), 0.02), "beside it [mm]"),
    );
    chart.band([-tolerance, tolerance], "band", BAND);
    for way in &ways {
        chart.dots(way.iter().map(|(_, point)| [along(point), beside(point)]), 1.1, colour, 0.75);
    }
    Some(chart)
}

/// Every feature's way in its plane, and off it.
fn at_the_plane(view: &PairView, normal: &Unit<Vector3<f64>>, colour: &str, most: usize) -> Chart {
    let (tolerance, room) = tolerance(view);
    // The middle of a way that bends in a plane lies off it, coordinate by coordinate.
    let level = |way: Trajectory| -> Trajectory {
        let off = median(way.iter().map(|(_, point)| point.coords.dot(normal)).collect());
        way.into_iter().map(|(frame, point)| (frame, point - normal.into_inner() * off)).collect()
    };
    let ways: Vec<Trajectory> = centred(&view.trajectories).into_iter().map(level).collect();
    let ways = PairView::thinned(&ways, most);
    let main = spread(ways.iter().flatten().map(|(_, point)| point));
    let (factor, name) = unit(reach(ways.iter().flatten().map(|(_, point)| point)));
    let at = |point: &Point3<f64>| [factor * point.coords.dot(&main.column(0)), 1e3 * point.coords.dot(normal)];
    let all = || ways.iter().flatten().map(|(_, point)| at(point));
    let up = framed(all().map(|p| p[1]), None);
    let along = range(all().map(|p| p[0]), 0.04);
    let up = range(up.into_iter().chain(room), 0.02);
    let mut chart = Chart::new("At the plane", (along, &format!("along it [{name}]")), (up, "off it [mm]"));
    chart.band([-tolerance, tolerance], "band", BAND);
    for way in &ways {
        chart.dots(way.iter().map(|(_, point)| at(point)), 1.1, colour, 0.75);
    }
    chart
}

/// Every feature's distance from the centre, less what it mostly is, over time.
fn on_the_sphere(view: &PairView, centre: &Point3<f64>, clock: &Clock<'_>, colour: &str, most: usize) -> Chart {
    let (tolerance, room) = tolerance(view);
    let off = |way: &Trajectory| -> Vec<[f64; 2]> {
        let distances: Vec<f64> = way.iter().map(|(_, point)| distance(point, centre)).collect();
        let middle = median(distances.clone());
        way.iter().zip(distances).map(|((frame, _), d)| [clock.at(*frame), 1e3 * (d - middle)]).collect()
    };
    let lines: Vec<Vec<[f64; 2]>> = PairView::thinned(&view.trajectories, most).iter().map(off).collect();
    let up = framed(lines.iter().flatten().map(|p| p[1]), None);
    let up = range(up.into_iter().chain(room), 0.02);
    let mut chart = Chart::new("On the sphere", clock.axis(), (up, "off it [mm]")).timed();
    chart.band([-tolerance, tolerance], "band", BAND);
    for line in lines {
        chart.dots(line, 1.1, colour, 0.75);
    }
    chart
}

/// Every feature about its own middle.
fn in_place(view: &PairView, colour: &str, most: usize) -> Chart {
    let plane = Plane::of(view);
    let (tolerance, room) = tolerance(view);
    let ways = PairView::thinned(&centred(&view.trajectories), most);
    let at = |point: &Point3<f64>| [1e3 * point.coords.dot(&plane.across), 1e3 * point.coords.dot(&plane.up)];
    let seen = framed(ways.iter().flatten().flat_map(|(_, point)| at(point)), None);
    let both = range(seen.into_iter().chain(room), 0.02);
    let mut chart = Chart::new("In its place", (both, "[mm]"), (both, "[mm]")).square();
    chart.ring([0.0, 0.0], [0.0, tolerance], 1.0, "band", BAND);
    for way in &ways {
        chart.dots(way.iter().map(|(_, point)| at(point)), 1.1, colour, 0.6);
    }
    chart
}

/// Without a joint: the motion once more, across the first view.
fn from_the_side(view: &PairView, colour: &str, most: usize) -> Chart {
    let main = spread(view.points());
    let (factor, name) = unit(reach(view.points()));
    let origin = Plane::of(view).origin;
    let side = Plane { origin, across: main.column(0).into_owned(), up: main.column(2).into_owned() };
    let at = |point: &Point3<f64>| side.at(point).map(|x| x * factor);
    let thinned = PairView::thinned(&view.trajectories, most);
    let bounds = |axis: usize| framed(thinned.iter().flatten().map(|(_, point)| at(point)[axis]), None);
    let label = format!("[{name}]");
    let mut chart = Chart::new("Motion, from the side", (bounds(0), &label), (bounds(1), &label)).square();
    for way in &thinned {
        chart.line(joined(way, &view.trajectories, |(_, point)| at(point)), colour, 0.6);
    }
    chart.dots(thinned.iter().filter_map(|way| way.last()).map(|(_, point)| at(point)), 2.6, colour, 1.0);
    chart
}
