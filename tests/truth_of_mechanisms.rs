//! The default configuration against simulated truth: joints, axes, positions, noise, and what is said of their
//! uncertainty.

use std::sync::LazyLock;

use jointscope_detection::{Detector, PairDetection};
use jointscope_models::{Axis, JointFit};
use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_scenes::{PairTruth, Positions as TruePositions, SceneOptions, Simulation, simulate};
use jointscope_tests::detector;
use nalgebra::{Matrix2, Matrix3, Point3, Vector2, Vector3};
use rayon::prelude::*;

/// Noise of a coordinate, metres: usual, and nearly none.
const NOISE: f64 = 0.001;
const QUIET: f64 = 1e-6;
/// Scenes looked at where each must hold, and where their mean must.
const SCENES: u64 = 6;
const MANY_SCENES: u64 = 60;
/// Standard deviations by which an axis may be off: of a million, not one is farther than 5.3.
const DEVIATIONS: f64 = 4.0;
/// Ratio of the true error of an axis to the stated one, root mean squares over [`MANY_SCENES`], whose two or three
/// coordinates leave 7 % of chance; the statement is told to be good to 30 %.
const HONEST: std::ops::Range<f64> = 0.65..1.4;
/// Root mean square error of positions, radians and metres, per metre of noise: twenty features in a cube of 15 cm know
/// a turn to 3.7 rad/m and a place to 0.2, each of two bodies; and the first frame counts in all others.
const TURNS: f64 = 12.0;
const SHIFTS: f64 = 2.0;
/// Rounding of coordinates, and steps of fits that end at a change of their cost by a millionth: radians and metres.
const SETTLED: f64 = 2e-6;
/// Rounding of coordinates alone.
const ROUNDING: f64 = 1e-12;
/// Error of a screw's pitch of 5 cm per radian over 45 degrees, as a share of it.
const PITCH: f64 = 0.05;
/// Departure from 1 of the mean of `χ²` per degree of freedom over [`MANY_SCENES`] of some hundred degrees of freedom
/// each, whose standard error is 0.017 or less.
const CHI_SQUARED: f64 = 0.05;
/// Error of the noise that is told, as a share of it, over as many scenes.
const SIGMA: f64 = 0.05;

static DETECTOR: LazyLock<Detector> = LazyLock::new(|| detector(""));

fn options(seed: u64, noise: f64) -> SceneOptions {
    SceneOptions { seed, noise: Some(noise), ..SceneOptions::default() }
}

fn detect(recording: Recording) -> PairDetection {
    DETECTOR.detect(recording, None).expect("two bodies").pairs.remove(0)
}

fn look(joint: &str, options: &SceneOptions) -> (Simulation, PairDetection) {
    let simulation = simulate(joint, options).expect("a scene");
    let pair = detect(simulation.recording.clone());
    (simulation, pair)
}

fn truth(simulation: &Simulation) -> &PairTruth {
    &simulation.truth.pairs[0]
}

/// How far an axis is from the true one: angle in radians, and distance in metres of its point from the true axis,
/// or from the true centre. A slide and a plane are nowhere in particular.
fn off(found: &Axis, joint: &str, true_point: &Point3<f64>, true_direction: Option<Vector3<f64>>) -> (f64, f64) {
    let beside = found.point - true_point;
    match found.direction.zip(true_direction) {
        Some((direction, truth)) => {
            let across = if ["prismatic", "planar"].contains(&joint) { 0.0 } else { truth.cross(&beside).norm() };
            (direction.cross(&truth).norm(), across)
        }
        None => (0.0, beside.norm()),
    }
}

fn true_axis(truth: &PairTruth) -> Option<(Point3<f64>, Option<Vector3<f64>>)> {
    let axis = truth.axis.as_ref()?;
    Some((axis.point.into(), axis.direction.map(Vector3::from)))
}

/// The true position of the joint in every frame.
fn positions(truth: &PairTruth) -> Vec<Vec<f64>> {
    match truth.positions.as_ref().expect("positions") {
        TruePositions::Single(all) => all.iter().map(|q| vec![*q]).collect(),
        TruePositions::Several(all) => all.clone(),
    }
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = errors.fold((0.0, 0.0), |(count, sum), error| (count + 1.0, sum + error * error));
    f64::sqrt(sum / f64::max(count, 1.0))
}

/// Mean of the moving body's features in frame 0, as seen.
fn first_centroid(simulation: &Simulation) -> Point3<f64> {
    let Observation::Points { tracks, .. } = simulation.recording.bodies()[1].observation() else { panic!("points") };
    let first = tracks.frame(0);
    Point3::from(first.iter().map(|p| p.coords).sum::<Vector3<f64>>() / first.len() as f64)
}

/// Where a point of the moving body goes as seen from the reference, per frame, in truth.
fn true_shifts(simulation: &Simulation, point: Point3<f64>) -> Vec<Vector3<f64>> {
    let [reference, moving] = [&simulation.poses[0], &simulation.poses[1]];
    reference.iter().zip(moving).map(|(r, m)| r.inverse() * (m * point) - point).collect()
}

/// Checks joint, axis and positions of nominal scenes.
fn check(joint: &str, noise: f64) {
    for seed in 0..SCENES {
        let (simulation, pair) = look(joint, &options(seed, noise));
        let truth = truth(&simulation);
        let place = format!("{joint}, seed {seed}, noise {noise} m");
        assert_eq!((pair.verdict.joint.as_str(), truth.joint.as_str()), (joint, joint), "{place}");
        let Some((true_point, true_direction)) = true_axis(truth) else {
            assert!(pair.axis.is_none() && pair.axis_in_moving.is_none() && pair.positions.is_none(), "{place}");
            continue;
        };
        let axis = pair.axis.expect("an axis");
        let stated = pair.axis_uncertainty.expect("stated");
        assert_eq!(
            (axis.direction.is_some(), stated.angle.is_some()),
            (true_direction.is_some(), axis.direction.is_some())
        );
        // At frame 0, where both are seen, their coordinates are the same.
        for axis in [axis, pair.axis_in_moving.expect("an axis")] {
            let (angle, distance) = off(&axis, joint, &true_point, true_direction);
            let (may_turn, may_move) = (stated.angle.unwrap_or(0.0), stated.distance.unwrap_or(0.0));
            assert!(angle <= DEVIATIONS * may_turn + SETTLED, "{place}: {angle:e} rad off, {may_turn:e} stated");
            assert!(distance <= DEVIATIONS * may_move + SETTLED, "{place}: {distance:e} m off, {may_move:e} stated");
        }
        check_pitch(&axis, truth, noise, &place);
        check_positions(&simulation, &pair, noise, &place);
    }
}

fn check_pitch(axis: &Axis, truth: &PairTruth, noise: f64, place: &str) {
    let expected = truth.axis.as_ref().expect("an axis").pitch;
    assert_eq!(axis.pitch.is_some(), expected.is_some(), "{place}");
    if let Some((found, expected)) = axis.pitch.zip(expected) {
        let allowed = PITCH * expected.abs() * (noise / NOISE) + SETTLED;
        // The pitch does not change its sign with the direction.
        assert!((found - expected).abs() <= allowed, "{place}: pitch {found}, truth {expected}");
    }
}

fn check_positions(simulation: &Simulation, pair: &PairDetection, noise: f64, place: &str) {
    let truth = truth(simulation);
    let found = pair.positions.as_ref().expect("positions");
    let rows: Vec<&[f64]> = found.iter().map(|row| row.expect("seen")).collect();
    assert!(rows[0].iter().all(|q| q.abs() < ROUNDING), "{place}: positions start at 0");
    let expected = positions(truth);
    let true_direction = truth.axis.as_ref().and_then(|axis| axis.direction).map(Vector3::from);
    let direction = pair.axis.and_then(|axis| axis.direction);
    let sense = direction.zip(true_direction).map_or(1.0, |(a, b)| a.dot(&b).signum());
    let along = |k: usize| rms(rows.iter().zip(&expected).map(|(q, truth)| q[k] - sense * truth[k]));
    let near = |what: &str, off: f64, per_noise: f64| {
        assert!(off <= per_noise * noise + SETTLED, "{place}: {what} {off:e} off, {:e} allowed", per_noise * noise);
    };
    match truth.joint.as_str() {
        "prismatic" => near("slides are", along(0), SHIFTS),
        "revolute" | "screw" => near("turns are", along(0), TURNS),
        "cylindrical" => {
            near("turns are", along(0), TURNS);
            // A slide along the axis is read off beside it, where a turn of the coordinates moves it.
            near("slides are", along(1), SHIFTS + TURNS * 0.15);
        }
        "planar" => {
            near("turns are", along(0), TURNS);
            // The plane's own axes are anybody's choice.
            let centre = first_centroid(simulation);
            let shifts = true_shifts(simulation, centre);
            let expected: Vec<f64> = shifts.iter().map(Vector3::norm).collect();
            near(
                "shifts are",
                rms(rows.iter().zip(&expected).map(|(q, e)| q[1].hypot(q[2]) - e)),
                SHIFTS + TURNS * 0.15,
            );
            let normal = direction.expect("a normal").into_inner();
            let x = shifts.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).expect("frames");
            let x = (x - normal * normal.dot(x)).normalize();
            let flat: Vec<Vector2<f64>> =
                shifts.iter().map(|s| Vector2::new(x.dot(s), normal.cross(&x).dot(s))).collect();
            let seen: Vec<Vector2<f64>> = rows.iter().map(|q| Vector2::new(q[1], q[2])).collect();
            let product: Matrix2<f64> = flat.iter().zip(&seen).map(|(a, b)| a * b.transpose()).sum();
            let svd = product.svd(true, true);
            let turn = svd.u.expect("asked for") * svd.v_t.expect("asked for");
            near("shifts are", rms(flat.iter().zip(&seen).map(|(a, b)| (a - turn * b).norm())), SHIFTS + TURNS * 0.15);
        }
        "spherical" => {
            let turns: Vec<Vector3<f64>> = simulation.poses[0]
                .iter()
                .zip(&simulation.poses[1])
                .map(|(r, m)| (r.inverse() * m).rotation.scaled_axis())
                .collect();
            let seen: Vec<Vector3<f64>> = rows.iter().map(|q| Vector3::new(q[0], q[1], q[2])).collect();
            let product: Matrix3<f64> = turns.iter().zip(&seen).map(|(a, b)| a * b.transpose()).sum();
            let svd = product.svd(true, true);
            let turn = svd.u.expect("asked for") * svd.v_t.expect("asked for");
            assert!(turn.determinant() > 0.0, "{place}: turns are mirrored");
            near("turns are", rms(turns.iter().zip(&seen).map(|(a, b)| (a - turn * b).norm())), 1.8 * TURNS);
        }
        other => panic!("{other} has no positions"),
    }
}

macro_rules! of_joint {
    ($exact:ident, $noisy:ident, $joint:literal) => {
        #[test]
        fn $exact() {
            check($joint, QUIET);
        }

        #[test]
        fn $noisy() {
            check($joint, NOISE);
        }
    };
}

of_joint!(quiet_rigid_pairs_are_found, noisy_rigid_pairs_are_found, "rigid");
of_joint!(quiet_slides_are_found, noisy_slides_are_found_within_their_uncertainty, "prismatic");
of_joint!(quiet_hinges_are_found, noisy_hinges_are_found_within_their_uncertainty, "revolute");
of_joint!(quiet_screws_are_found, noisy_screws_are_found_within_their_uncertainty, "screw");
of_joint!(quiet_cylinders_are_found, noisy_cylinders_are_found_within_their_uncertainty, "cylindrical");
of_joint!(quiet_planes_are_found, noisy_planes_are_found_within_their_uncertainty, "planar");
of_joint!(quiet_balls_are_found, noisy_balls_are_found_within_their_uncertainty, "spherical");
of_joint!(quiet_free_bodies_are_found, noisy_free_bodies_are_found, "disconnected");

const JOINTS: [&str; 8] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "spherical", "disconnected"];

#[test]
fn every_joint_of_a_nominal_scene_is_determined_with_noise_and_without() {
    let mut open = Vec::new();
    for noise in [NOISE, QUIET] {
        for joint in JOINTS {
            for seed in 0..SCENES {
                let (_, pair) = look(joint, &options(seed, noise));
                if !pair.determined {
                    open.push(format!("{joint}, seed {seed}, noise {noise} m: {:?}", pair.notes));
                }
            }
        }
    }
    assert!(open.is_empty(), "{}", open.join("\n"));
}

#[test]
fn joints_that_cannot_move_like_this_are_ruled_out() {
    /// Confidence of a joint that noise and play together rule out.
    const RULED_OUT: f64 = 1e-3;
    // A plane knows no slide along its normal, a ball none at all.
    for (joint, impossible) in [
        ("prismatic", ["rigid", "rigid"]),
        ("revolute", ["rigid", "prismatic"]),
        ("screw", ["revolute", "planar"]),
        ("cylindrical", ["screw", "planar"]),
        ("spherical", ["planar", "cylindrical"]),
        ("disconnected", ["spherical", "planar"]),
    ] {
        for seed in 0..SCENES {
            let (_, pair) = look(joint, &options(seed, NOISE));
            for (name, confidence) in &pair.verdict.confidences {
                let possible = *confidence <= RULED_OUT || !impossible.contains(&name.as_str());
                assert!(possible, "{joint}, seed {seed}: {name} has {confidence}");
            }
        }
    }
}

#[test]
fn axes_of_slides_and_planes_go_through_the_moving_body_and_those_of_hinges_abreast_of_it() {
    /// The centre of twenty features with noise, metres; and a little of the axis's own error on an arm of 15 cm.
    const CENTRE: f64 = 0.002;
    for joint in ["prismatic", "planar", "revolute", "screw", "cylindrical"] {
        for seed in 0..SCENES {
            let (simulation, pair) = look(joint, &options(seed, NOISE));
            let centre = first_centroid(&simulation);
            for axis in [pair.axis, pair.axis_in_moving].map(|axis| axis.expect("an axis")) {
                let beside = centre - axis.point;
                let along = axis.direction.expect("a direction").dot(&beside).abs();
                let away = if ["prismatic", "planar"].contains(&joint) { beside.norm() } else { along };
                assert!(away <= CENTRE, "{joint}, seed {seed}: the axis's point is {away} m from the moving body");
            }
        }
    }
}

#[test]
fn turns_about_a_centre_are_told_in_the_reference_s_axes() {
    for seed in 0..SCENES {
        let (simulation, pair) = look("spherical", &options(seed, QUIET));
        let found = pair.positions.as_ref().expect("positions");
        let poses = simulation.poses[0].iter().zip(&simulation.poses[1]);
        for (frame, (row, (reference, moving))) in found.iter().zip(poses).enumerate() {
            let row = row.expect("seen");
            let turn = (reference.inverse() * moving).rotation.scaled_axis();
            let away = (Vector3::new(row[0], row[1], row[2]) - turn).norm();
            assert!(away <= 10.0 * SETTLED.max(TURNS * QUIET), "seed {seed}, frame {frame}: {row:?}, truth {turn}");
        }
    }
}

/// The recording without some samples of either body.
fn without(recording: &Recording, missing: impl Fn(usize, usize) -> bool) -> Recording {
    let body = |(number, body): (usize, &Body)| {
        let Observation::Points { labels, tracks } = body.observation() else { panic!("points") };
        let gone = vec![Point3::from([f64::NAN; 3]); tracks.features()];
        let row = |frame| if missing(number, frame) { gone.clone() } else { tracks.frame(frame).to_vec() };
        let samples = (0..tracks.frames()).flat_map(row).collect();
        let tracks = Tracks::new(tracks.features(), samples).expect("whole frames");
        Body::from_points(body.name(), labels.clone(), tracks).expect("seen")
    };
    let (frames, times, bodies) = recording.clone().into_parts();
    Recording::new(frames, times, bodies.iter().enumerate().map(body).collect()).expect("the same frames")
}

#[test]
fn axes_are_told_in_both_bodies_coordinates_wherever_those_begin() {
    for joint in ["prismatic", "revolute", "screw", "cylindrical", "planar", "spherical"] {
        for (late, appears) in [(0, 9), (1, 9)] {
            let (mut worst, scenes) = (0.0_f64, SCENES);
            for seed in 0..scenes {
                let simulation = simulate(joint, &options(seed, NOISE)).expect("a scene");
                let pair = detect(without(&simulation.recording, |body, frame| body == late && frame < appears));
                assert_eq!(pair.verdict.joint, joint, "body {late} is late");
                let (point, direction) = true_axis(truth(&simulation)).expect("an axis");
                // The true axis is on the reference, and a body's coordinates are the recording's when it appears.
                let start = |body: usize| if body == late { appears } else { 0 };
                let stated = pair.axis_uncertainty.expect("stated");
                for (body, axis) in [(0, pair.axis), (1, pair.axis_in_moving)] {
                    // Bodies that are there in frame 0 have the axis where it is then; it moves on with the base, or,
                    // as part of the moving body, with that.
                    let carry: Pose = simulation.poses[body][start(body)];
                    let (point, direction) = (carry * point, direction.map(|d| carry * d));
                    let (angle, distance) = off(&axis.expect("an axis"), joint, &point, direction);
                    let turned = stated.angle.map_or(0.0, |stated| angle / stated);
                    let moved = stated.distance.map_or(0.0, |stated| distance / stated);
                    worst = worst.max(turned).max(moved);
                }
            }
            assert!(worst <= DEVIATIONS, "{joint}, body {late} late: {worst:.1} standard deviations");
        }
    }
}

/// What is told of many scenes of a joint: stated and true.
struct Told {
    chi_squared: f64,
    noise: (f64, f64),
    angle: (f64, f64),
    distance: (f64, f64),
}

fn told(joint: &str, options: &SceneOptions) -> Told {
    let alone = detector(&format!("[models.{joint}]"));
    let scenes: Vec<(JointFit, [f64; 2], (f64, f64))> = (0..MANY_SCENES)
        .into_par_iter()
        .map(|seed| {
            let simulation = simulate(joint, &SceneOptions { seed, ..options.clone() }).expect("a scene");
            let pair = alone.detect(simulation.recording.clone(), None).expect("two bodies").pairs.remove(0);
            let fit = pair.models[joint].as_ref().expect("judged").clone();
            let noise = [pair.noise_reference, pair.noise_moving].map(|noise| noise.position.expect("estimated"));
            let errors = fit.joint.axis.zip(true_axis(truth(&simulation)));
            let errors = errors.map_or((0.0, 0.0), |(axis, (point, direction))| off(&axis, joint, &point, direction));
            (fit, noise, errors)
        })
        .collect();
    let stated = |part: fn(&JointFit) -> Option<f64>| rms(scenes.iter().filter_map(|(fit, ..)| part(fit)));
    let chi_squared = scenes.iter().map(|(fit, ..)| fit.evidence.expect("stated").chi_squared_per_freedom());
    Told {
        chi_squared: chi_squared.sum::<f64>() / MANY_SCENES as f64,
        noise: (rms(scenes.iter().flat_map(|(_, noise, _)| noise.iter().copied())), options.noise.expect("given")),
        angle: (stated(|fit| fit.axis_uncertainty?.angle), rms(scenes.iter().map(|(.., (angle, _))| *angle))),
        distance: (stated(|fit| fit.axis_uncertainty?.distance), rms(scenes.iter().map(|(.., (_, away))| *away))),
    }
}

#[test]
fn noise_and_misfit_are_told_truly_whatever_the_samples_are_like() {
    let nominal = options(0, NOISE);
    for (condition, options) in [
        ("nominal", nominal.clone()),
        ("30 % of the samples are missing", SceneOptions { dropout: Some(0.3), ..nominal.clone() }),
        ("5 % of the samples are wild", SceneOptions { outlier_samples: Some(0.05), ..nominal.clone() }),
        ("20 % of the features are strays", SceneOptions { outlier_features: Some(0.2), ..nominal }),
    ] {
        for joint in ["rigid", "revolute", "planar", "spherical"] {
            let Told { chi_squared, noise: (stated, truth), .. } = told(joint, &options);
            assert!(
                (stated / truth - 1.0).abs() <= SIGMA,
                "{joint}, {condition}: noise {stated:e} m, truth {truth:e} m"
            );
            assert!((chi_squared - 1.0).abs() <= CHI_SQUARED, "{joint}, {condition}: {chi_squared:.3} per freedom");
        }
    }
}

#[test]
#[ignore = "chi squared of planes is 5.2 percent too large where 30 % of 8 features are missing: cargo test -p jointscope-tests --test truth_of_mechanisms -- --ignored"]
fn misfit_is_told_truly_where_some_frames_show_few_features() {
    // Frames are then known unevenly, and none is wrong for being known badly.
    let options = SceneOptions { dropout: Some(0.3), features: Some(8), ..options(0, NOISE) };
    for joint in ["rigid", "revolute", "planar", "spherical"] {
        let Told { chi_squared, .. } = told(joint, &options);
        assert!((chi_squared - 1.0).abs() <= CHI_SQUARED, "{joint}: {chi_squared:.3} per freedom");
    }
}

#[test]
fn stated_uncertainties_are_what_happens() {
    let nominal = options(0, NOISE);
    for (condition, options) in [
        ("nominal", nominal.clone()),
        ("3 mm of noise", SceneOptions { noise: Some(0.003), ..nominal.clone() }),
        ("90 degrees", SceneOptions { sweep_deg: Some(90.0), ..nominal.clone() }),
        ("30 % of the samples are missing", SceneOptions { dropout: Some(0.3), ..nominal }),
    ] {
        for joint in ["prismatic", "revolute", "screw", "cylindrical", "planar", "spherical"] {
            let Told { angle, distance, .. } = told(joint, &options);
            for (what, (stated, truth)) in [("rad", angle), ("m", distance)] {
                let honest = stated == 0.0 || HONEST.contains(&(truth / stated));
                assert!(honest, "{joint}, {condition}: {truth:e} {what} off, {stated:e} stated");
            }
        }
    }
}
