//! S1 to S3: registrations of many frames to one shape.

use std::hint::black_box;
use std::path::Path;

use jointscope_motion::{Pose, Tracks, fit_rotations, register, register_frames};
use jointscope_scenes::workloads::{Registrations, registrations};
use nalgebra::{Matrix3, Vector3};

use crate::alternation::{Contestant, ROUNDS, Times, alternate};
use crate::document::Document;
use crate::peer::{Peer, write_numbers};
use crate::row::{Row, Wanted};
use crate::svd::{by_svd, rotation_by_svd};

const FRAMES: usize = 100_000;
const FEATURES: usize = 50;
/// Frames that peers register, so that a round does not last minutes.
const FRAMES_OF_PEERS: usize = 20_000;
/// Angle by which the registrations compared may differ, radians, or entries of their matrices: all are exact up to
/// rounding.
const SAME: f64 = 1e-10;

/// Whether the poses found in lanes are those of the scalar solve and of nalgebra's decomposition.
fn fault(work: &Registrations, poses: &[Option<Pose>]) -> Option<String> {
    for frame in (0..poses.len()).step_by(97) {
        let (reference, target) = (&work.reference, work.tracks.frame(frame));
        let scalar = register(reference.iter().zip(target)).ok();
        for (name, other) in [("the scalar solve", scalar), ("nalgebra's decomposition", by_svd(reference, target))] {
            let same = poses[frame].zip(other).is_some_and(|(a, b)| a.rotation.angle_to(&b.rotation) < SAME);
            if !same {
                return Some(format!("frame {frame} differs from {name}"));
            }
        }
    }
    None
}

fn numbers(tracks: &Tracks, frames: usize) -> Vec<f64> {
    (0..frames).flat_map(|frame| tracks.frame(frame)).flat_map(|point| [point.x, point.y, point.z]).collect()
}

pub(crate) fn measure(document: &mut Document) {
    let work = registrations(FRAMES, FEATURES, 1001).expect("a workload");
    let shape: Vec<_> = work.reference.iter().copied().map(Some).collect();
    let floor = numbers(&work.tracks, FRAMES);
    let mut poses = vec![None; FRAMES];
    register_frames(&shape, &work.tracks, &mut poses);
    let fault = fault(&work, &poses);

    let ours = Contestant::repeated("ours", 1, || register_frames(&shape, black_box(&work.tracks), &mut poses));
    let times = alternate(document, "W1 beside reading", ROUNDS, &floor, vec![ours]);
    if let Some(measured) = times.ratio("ours", "floor") {
        document.row(Row {
            goal: "S1",
            what: "W1: registering, by reading the same positions once".into(),
            wanted: Wanted::AtMost(1.4),
            unit: "×",
            measured,
            fault: fault.clone(),
            bound: "sums across lanes and poses, once a frame",
        });
    }
    beside_peers(document, &work, fault.as_ref());
    rotations(document);
}

fn beside_peers(document: &mut Document, work: &Registrations, fault: Option<&String>) {
    let folder = tempfile::tempdir().expect("a folder of temporary files");
    write_numbers(&folder.path().join("frames.f64"), &numbers(&work.tracks, FRAMES_OF_PEERS));
    let of_reference = work.reference.iter().flat_map(|point| [point.x, point.y, point.z]);
    write_numbers(&folder.path().join("reference.f64"), &of_reference.collect::<Vec<_>>());
    let positions = (0..FRAMES_OF_PEERS).flat_map(|frame| work.tracks.frame(frame).to_vec()).collect();
    let tracks = Tracks::new(FEATURES, positions).expect("whole frames");
    let shape: Vec<_> = work.reference.iter().copied().map(Some).collect();
    let mut poses = vec![None; FRAMES_OF_PEERS];
    register_frames(&shape, &tracks, &mut poses);
    let sample: Vec<f64> = (0..1000).step_by(97).flat_map(|frame| row_major(poses[frame])).collect();

    let ours = Contestant::new("ours", || per_frame(|| register_frames(&shape, black_box(&tracks), &mut poses)));
    let svd = Contestant::new("nalgebra", || {
        per_frame(|| {
            let poses = (0..FRAMES_OF_PEERS).filter_map(|frame| by_svd(&work.reference, tracks.frame(frame)));
            black_box(poses.map(|pose| pose.translation.x).sum::<f64>());
        })
    });
    let mut contestants = vec![ours, svd];
    let mut faults = Vec::new();
    for (start, names) in [
        (Peer::cpp as fn(&str, &Path) -> _, &["registration.cpp", "Eigen"][..]),
        (Peer::python, &["registration.py", "numpy", "scipy"]),
    ] {
        match start(names[0], folder.path()) {
            Ok(peer) => {
                let peer = std::rc::Rc::new(std::cell::RefCell::new(peer));
                for &name in &names[1..] {
                    let found = peer.borrow_mut().run(name);
                    let same = found.is_some_and(|(_, theirs)| {
                        theirs.len() == sample.len() && theirs.iter().zip(&sample).all(|(a, b)| (a - b).abs() < SAME)
                    });
                    if !same {
                        faults.push(name);
                    }
                    let peer = peer.clone();
                    contestants.push(Contestant::new(name, move || {
                        peer.borrow_mut().run(name).map_or(f64::NAN, |(seconds, _)| seconds)
                    }));
                }
            }
            Err(reason) => document.absent(reason),
        }
    }
    // Of fewer frames it would depend on what a peer has left in the caches.
    let floor = numbers(&work.tracks, FRAMES);
    let times = alternate(document, "W1 beside peers", ROUNDS, &floor, contestants);
    for (name, what, least) in [
        ("Eigen", "Eigen's `umeyama`", 8.0),
        ("numpy", "the best of numpy, batched", 18.0),
        ("scipy", "a loop over scipy's `align_vectors`", 400.0),
        ("nalgebra", "a loop over nalgebra's decomposition", f64::NAN),
    ] {
        let Some(measured) = times.ratio(name, "ours") else { continue };
        let differs = faults.contains(&name).then(|| "its results differ".to_owned());
        document.row(Row {
            goal: "S2",
            what: format!("W1: {what}, by ours"),
            wanted: if least.is_nan() { Wanted::Nothing } else { Wanted::AtLeast(least) },
            unit: "×",
            measured,
            fault: fault.cloned().or(differs),
            bound: if least.is_nan() { "" } else { "ours is at the speed of memory" },
        });
    }
}

/// S3: the same cross-covariances, ours in lanes.
fn rotations(document: &mut Document) {
    const FEATURES: usize = 12;
    const COUNT: usize = 10_000;
    let work = registrations(COUNT, FEATURES, 1001).expect("a workload");
    let centre = work.reference.iter().map(|p| p.coords).sum::<Vector3<f64>>() / FEATURES as f64;
    let covariance = |frame: usize| -> Matrix3<f64> {
        let pairs = work.reference.iter().zip(work.tracks.frame(frame));
        pairs.map(|(p, q)| (p.coords - centre) * q.coords.transpose()).sum()
    };
    let covariances: Vec<Matrix3<f64>> = (0..COUNT).map(covariance).collect();
    let mut rotations = vec![None; COUNT];
    fit_rotations(&covariances, &mut rotations);
    let differs = rotations.iter().zip(&covariances).position(|(ours, covariance)| {
        let both = ours.zip(rotation_by_svd(*covariance));
        both.is_none_or(|(ours, theirs)| ours.angle_to(&theirs) > SAME)
    });
    let contestants = vec![
        Contestant::repeated("ours", 10, || fit_rotations(black_box(&covariances), &mut rotations)),
        Contestant::repeated("nalgebra", 1, || {
            let rotations = black_box(&covariances).iter().filter_map(|h| rotation_by_svd(*h));
            black_box(rotations.map(|rotation| rotation.w).sum::<f64>());
        }),
    ];
    let floor = crate::floor::beyond_caches();
    let times: Times = alternate(document, "rotations", ROUNDS, &floor, contestants);
    if let Some(measured) = times.ratio("nalgebra", "ours") {
        document.row(Row {
            goal: "S3",
            what: "rotations from cross-covariances by nalgebra's decomposition, by ours".into(),
            wanted: Wanted::AtLeast(30.0),
            unit: "×",
            measured,
            fault: differs.map(|number| format!("rotation {number} differs from nalgebra's decomposition")),
            bound: "bringing matrices into lanes and quaternions out of them",
        });
    }
}

fn row_major(pose: Option<Pose>) -> Vec<f64> {
    let matrix = pose.unwrap_or_default().rotation.to_rotation_matrix();
    matrix.matrix().transpose().iter().copied().collect()
}

fn per_frame(work: impl FnMut()) -> f64 {
    crate::alternation::seconds_of(1, work) / FRAMES_OF_PEERS as f64
}
