//! The pictures of one pair.

use jointscope_detection::{JointKind, PairDetection};
use jointscope_motion::Recording;
use nalgebra::Point3;

use super::{
    chart::{Chart, range},
    fit::fit,
    models::models,
    plane::{Clock, Plane, framed, joined, unit},
    scale::scores,
    style::{AXIS, BAND, FAINT},
};
use crate::pair_view::{PairView, reach};

/// Charts of a pair: the relative motion, how the joint fits it, positions, residuals, scores over
/// scales, models; of the bodies' colours
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
    charts.extend(scores(pair));
    charts.push(models(pair));
    charts
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
        JointKind::Revolute | JointKind::Elliptical { .. } | JointKind::Screw { .. } | JointKind::Cylindrical => {
            "Motion, along the axis"
        }
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

/// How far features are from where the joint puts them, frame by frame, over the noise. Features on ellipses do not move
/// as one body does, so that no position of the joint puts them anywhere.
fn residuals(view: &PairView, clock: &Clock<'_>, colour: &str, most: usize) -> Option<String> {
    let all = &view.residuals;
    if all.is_empty() || matches!(view.kind, JointKind::Elliptical { .. }) {
        return None;
    }
    let mut sorted: Vec<f64> = all.iter().map(|(_, residual)| 1e3 * residual).collect();
    // A single wild frame must not hide the others.
    let high = jointscope_motion::quantile(&mut sorted, 0.99) * 1.3;
    let expected = 1e3 * 3_f64.sqrt() * view.noise;
    let up = [0.0, high.max(1.25 * expected).max(1e-6)];
    let mut chart = Chart::new("Features off the joint", clock.axis(), (up, "rms in a frame [mm]")).timed();
    chart.band([0.0, expected], "band", BAND);
    let chosen = jointscope_motion::evenly(all.len(), most.max(50));
    chart.dots(chosen.iter().map(|&k| [clock.at(all[k].0), 1e3 * all[k].1]), 1.2, colour, 0.8);
    if expected > 0.0 {
        chart.level(expected, "noise", FAINT);
    }
    Some(chart.draw())
}
