//! Recordings of a single camera: bodies at scales of their own.

use std::collections::BTreeMap;

use jointscope_detection::{Configuration, Detection, Detector, PairDetection};
use jointscope_models::Catalog;
use jointscope_motion::nalgebra::{Point3, UnitQuaternion, Vector3};
use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_scenes::{SceneOptions, simulate};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const FRAMES: u32 = 60;
/// What the second body is seen at, so that it must be multiplied by 0.94.
const SEEN_AT: f64 = 1.0 / 0.94;
const CLOSED_FORM: &str = "[scale]\nsearch = 'closed-form'\n";

fn detect(configuration: &str, recording: Recording) -> Vec<PairDetection> {
    detection(configuration, recording).pairs
}

fn detection(configuration: &str, recording: Recording) -> Detection {
    let catalog = Catalog::linked().expect("unique");
    let configuration = Configuration::parse(configuration, &catalog).expect("valid");
    Detector::new(configuration).detect(recording, None).expect("detected")
}

/// Bodies of ten features seen with noise of 1 mm, each at a scale of its own.
fn seen<const N: usize>(poses: impl Fn(f64) -> [Pose; N], scales: [f64; N], seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal =
        |sigma: f64| Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng));
    let centres = poses(0.0).map(|pose: Pose| pose.translation.vector);
    let bodies = std::array::from_fn::<_, N, _>(|number| {
        let shape: Vec<Vector3<f64>> = (0..10).map(|_| normal(0.06)).collect();
        let scale = scales[number];
        let points = (0..FRAMES).flat_map(|frame| {
            let pose = poses(f64::from(frame) / f64::from(FRAMES - 1))[number];
            shape.iter().map(|place| pose * Point3::from(*place)).collect::<Vec<_>>()
        });
        let points: Vec<Point3<f64>> = points.map(|point| point * scale).collect();
        let points = points.into_iter().map(|point| point + normal(0.001)).collect();
        let labels = (0..10).map(|feature| feature.to_string()).collect();
        Body::from_points(["a", "b", "c"][number], labels, Tracks::new(10, points).expect("rectangular"))
            .expect("a body")
    });
    assert!(centres.iter().all(|centre| centre.norm() > 0.5), "bodies are in front of the camera");
    Recording::new((0..u64::from(FRAMES)).collect(), None, bodies.into()).expect("a recording")
}

fn place(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

fn turn(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z)))
}

fn wave(times: f64, t: f64) -> f64 {
    (times * std::f64::consts::TAU * t).sin()
}

/// A way that turns and slides in all directions.
fn roaming(t: f64) -> Pose {
    place(0.15 * wave(0.4, t), -0.1 * wave(0.7, t), 1.0 + 0.2 * wave(0.5, t))
        * turn(0.4 * wave(0.6, t), 0.5 * wave(0.3, t), -0.3 * wave(0.9, t))
}

/// A way without turns.
fn sliding(t: f64) -> Pose {
    place(0.15 * wave(0.4, t), -0.1 * wave(0.7, t), 1.0 + 0.2 * wave(0.5, t))
}

/// How two bodies go, from 0 to 1.
type Way<'w> = &'w dyn Fn(f64) -> [Pose; 2];

/// Joints by the way of their reference, and whether it shows the scale.
#[test]
fn a_scale_is_told_where_it_shows_and_is_no_number_where_it_does_not() {
    let beside = place(0.2, 0.05, 0.0);
    let hinge = |t: f64| place(0.1, 0.0, 0.0) * turn(0.0, 0.0, 0.9 * t) * place(0.1, 0.05, 0.0);
    let ball = |t: f64| {
        place(0.1, 0.0, 0.0) * turn(0.5 * wave(0.4, t), 0.6 * wave(0.55, t), 0.9 * wave(0.3, t)) * place(0.1, 0.05, 0.0)
    };
    let slide = |t: f64| place(0.2 + 0.15 * wave(0.35, t), 0.05, 0.0);
    let about_camera = |t: f64| turn(0.3 * wave(0.6, t), 0.4 * wave(0.3, t), 0.5 * wave(0.9, t)) * place(0.0, 0.0, 1.0);
    let along = |t: f64| place(0.2 * wave(0.5, t), 0.0, 1.0);
    let cases: [(&str, bool, &str, Way<'_>); 11] = [
        ("rigid, roaming", true, "rigid", &|t| [roaming(t), roaming(t) * beside]),
        ("rigid, sliding", true, "rigid", &|t| [sliding(t), sliding(t) * beside]),
        ("prismatic, roaming", true, "prismatic", &|t| [roaming(t), roaming(t) * slide(t)]),
        ("prismatic, sliding", true, "prismatic", &|t| [sliding(t), sliding(t) * slide(t)]),
        ("revolute, roaming", true, "revolute", &|t| [roaming(t), roaming(t) * hinge(t)]),
        ("revolute, sliding", true, "revolute", &|t| [sliding(t), sliding(t) * hinge(t)]),
        ("spherical, roaming", true, "spherical", &|t| [roaming(t), roaming(t) * ball(t)]),
        ("reference at rest", false, "", &|t| [place(0.0, 0.0, 1.0), place(0.0, 0.0, 1.0) * hinge(t)]),
        ("rigid, turning about the camera", false, "rigid", &|t| [about_camera(t), about_camera(t) * beside]),
        ("prismatic, along its own axis", false, "", &|t| [along(t), along(t) * slide(t)]),
        ("spherical, turning about the camera", false, "", &|t| [about_camera(t), about_camera(t) * ball(t)]),
    ];
    for (name, shows, joint, way) in cases {
        for seed in 0..2 {
            let pair = &detect(CLOSED_FORM, seen(way, [1.0, SEEN_AT], seed))[0];
            let scale = pair.scale.as_ref().expect("sought");
            assert_eq!(scale.observable, shows, "{name} {seed}: {} {scale:?}", pair.verdict.joint);
            assert_eq!((scale.factor.is_some(), scale.standard_error.is_some()), (shows, shows), "{name} {seed}");
            let note = if shows { "agrees with" } else { "the scale between the bodies does not show" };
            assert!(pair.notes.iter().any(|told| told.contains(note)), "{name} {seed}: {:?}", pair.notes);
            if !joint.is_empty() {
                assert_eq!(pair.verdict.joint, joint, "{name} {seed}: {scale:?} {:?}", pair.notes);
            }
            if let (Some(factor), Some(error)) = (scale.factor, scale.standard_error) {
                let off = factor / 0.94 - 1.0;
                assert!(
                    off.abs() < 0.005 && off.abs() < 5.0 * error,
                    "{name} {seed}: off by {off:.5}, stated {error:.5}"
                );
            }
        }
    }
}

/// The second body's positions multiplied.
fn multiplied(recording: &Recording, factor: f64) -> Recording {
    let bodies = recording.bodies().iter().enumerate().map(|(number, body)| {
        let Observation::Points { tracks, labels } = body.observation() else { return body.clone() };
        let factor = if number == 1 { factor } else { 1.0 };
        let sample = |frame, feature| tracks.get(frame, feature).map_or([f64::NAN; 3].into(), |p| p * factor);
        let points = (0..tracks.frames()).flat_map(|t| (0..tracks.features()).map(move |f| sample(t, f)));
        let tracks = Tracks::new(tracks.features(), points.collect()).expect("rectangular");
        Body::from_points(body.name(), labels.clone(), tracks).expect("a body")
    });
    Recording::new(recording.frame_numbers().to_vec(), None, bodies.collect()).expect("a recording")
}

const THESIS: &str = "[motion]\nregistration = 'chained'\n[models.rigid]\nkind = 'thesis-rigid'\n[models.prismatic]\nkind = \
                      'thesis-prismatic'\n[models.revolute]\nkind = 'thesis-revolute'\n[scoring]\nrule = 'cascade'\n";

/// Confidence by which a search by moments may fall short of the grid's best: peaks of rough scores that it climbs are not
/// always the highest.
const SECOND_PEAK: f64 = 0.02;

/// A scene of the thesis by a single camera: the body that is seen at another scale is the second one.
fn of_the_thesis(scene: &str, seed: u64) -> Recording {
    let options = SceneOptions { monocular: true, seed, ..SceneOptions::default() };
    let recording = simulate(scene, &options).expect("simulated").recording;
    let two = recording.bodies()[1..].iter().rev().cloned().collect();
    Recording::new(recording.frame_numbers().to_vec(), None, two).expect("a recording")
}

#[test]
fn the_grid_scores_as_separate_detections_of_multiplied_recordings() {
    const GRID: &str = "[scale]\nsearch = 'grid'\nfrom = 0.9\nto = 1.0\nstep = 0.02\n";
    for (scene, joint, best) in [("laptop", "revolute", 0.94), ("drawers", "prismatic", 0.96)] {
        let recording = of_the_thesis(scene, 0);
        let found = &detect(&format!("{THESIS}{GRID}"), recording.clone())[0];
        let curve = found.scale.as_ref().and_then(|scale| scale.curve.as_ref()).expect("a curve");
        assert_eq!(curve.factors.len(), 6);
        assert!(found.scale.as_ref().is_some_and(|scale| scale.standard_error.is_none()), "a score has no error");
        for (number, factor) in curve.factors.iter().enumerate() {
            let apart = &detect(THESIS, multiplied(&recording, *factor))[0];
            let scores: BTreeMap<_, _> = apart
                .models
                .iter()
                .map(|(name, fit)| (name, fit.as_ref().map_or(0.0, |fit| fit.confidence.value())))
                .collect();
            for (name, scores_of_grid) in &curve.scores {
                let (one, other) = (scores_of_grid[number], scores[name]);
                assert!((one - other).abs() < 1e-9, "{scene} {name} at {factor}: {one} and {other}");
            }
        }
        let scale = found.scale.as_ref().expect("sought");
        assert_eq!(found.verdict.joint, joint, "{scene}: {curve:?}");
        assert!(scale.observable && (scale.factor.expect("observable") - best).abs() < 0.021, "{scene}: {scale:?}");
    }
}

#[test]
fn moments_lead_to_the_scales_that_the_whole_grid_finds() {
    let mut elsewhere = Vec::new();
    for (scene, seed) in ["laptop", "drawers"].into_iter().flat_map(|scene| (0..6).map(move |seed| (scene, seed))) {
        let found = |search: &str| {
            let configuration = format!("{THESIS}[scale]\nsearch = '{search}'\n");
            let pair = detect(&configuration, of_the_thesis(scene, seed)).remove(0);
            let scale = pair.scale.expect("sought");
            (pair.verdict, scale.factor.expect("observable"), scale.curve.expect("a curve"))
        };
        let (grid, moments) = (found("grid"), found("moments"));
        let place = format!("{scene} {seed}: {} {} of {:?}", grid.1, moments.1, moments.2.factors);
        assert_eq!(moments.0.joint, grid.0.joint, "{place}");
        assert!(moments.0.confidence > grid.0.confidence - SECOND_PEAK, "{place}");
        assert!(grid.2.factors.len() == 101 && moments.2.factors.len() < 20, "{place}");
        for (number, factor) in moments.2.factors.iter().enumerate() {
            let same = grid.2.factors.iter().position(|other| other == factor).expect("of the grid");
            for (name, scores) in &moments.2.scores {
                assert_eq!(scores[number], grid.2.scores[name][same], "{place}: {name} at {factor}");
            }
        }
        elsewhere.extend((moments.1 != grid.1).then_some(place));
    }
    // Scores count points, and may have a second peak.
    assert!(elsewhere.len() < 2, "{elsewhere:?}");
}

#[test]
fn a_scale_at_the_end_of_the_range_is_not_determined() {
    // As it was seen no joint connects the laptop's halves, but one does at 0.94.
    for (range, ends) in
        [("from = 0.96\nto = 1.2", true), ("from = 0.8\nto = 1.1", false), ("from = 1.0\nto = 1.0", true)]
    {
        let configuration = format!("{THESIS}[scale]\nsearch = 'grid'\nstep = 0.02\n{range}\n");
        let pair = detect(&configuration, of_the_thesis("laptop", 0)).remove(0);
        let told = pair.notes.iter().any(|note| note.contains("give a wider range"));
        assert_eq!(told, ends, "{range}: {:?}", pair.notes);
        assert!(!(told && pair.determined), "{range}");
    }
}

#[test]
fn scales_that_score_alike_tell_none() {
    let options = SceneOptions { seed: 7, noise: Some(0.0), ..SceneOptions::default() };
    let recording = simulate("drawers", &options).expect("a scene").recording;
    let grid = include_str!("../configs/scale.toml");
    for pair in detect(grid, recording) {
        let scale = pair.scale.as_ref().expect("sought");
        let curve = scale.curve.as_ref().expect("a grid");
        assert_eq!((pair.verdict.joint.as_str(), pair.determined), ("prismatic", true), "{pair:?}");
        let scores = &curve.scores["prismatic"];
        let best = scores.iter().copied().fold(0.0, f64::max);
        // But for rounding.
        let alike: Vec<f64> = curve
            .factors
            .iter()
            .zip(scores)
            .filter(|(_, score)| best - **score < 1e-9)
            .map(|(factor, _)| *factor)
            .collect();
        assert!(alike.len() > 3 && alike.contains(&1.0), "{alike:?}");
        assert_eq!(scale.alike, Some([alike[0], alike[alike.len() - 1]]));
        assert_eq!((scale.factor, scale.observable), (None, false));
        assert!(pair.notes.iter().any(|note| note.contains("does equally well")), "{:?}", pair.notes);
        // Of those, the joint is told at the scale nearest to 1, where everything is as it was seen.
        let travel = pair.positions.as_ref().expect("positions").iter().flatten().flatten().copied();
        let travel = travel.fold(0.0, f64::max);
        assert!((0.3..0.36).contains(&travel), "{travel} m");
    }
}

#[test]
fn what_moments_do_not_point_to_is_looked_for_all_over_the_range() {
    let best = |search: &str, body: &str| {
        let text =
            include_str!("../configs/scale.toml").replace("\"grid\"", &format!("\"{search}\"\nbody = \"{body}\""));
        let pair = detect(&text, of_the_thesis("laptop", 0)).remove(0);
        (pair.verdict.joint, pair.verdict.confidence)
    };
    for body in ["moving", "reference"] {
        let (grid, moments) = (best("grid", body), best("moments", body));
        assert!(grid.0 == moments.0 && moments.1 > grid.1 - SECOND_PEAK, "{body}: {grid:?} {moments:?}");
    }
}

#[test]
fn moments_find_joints_of_likelihood_as_the_whole_grid_does() {
    for (joint, seen_at, seed) in
        [("planar", 0.7, 3), ("spherical", 0.83, 0), ("spherical", 0.83, 2), ("revolute", 1.3, 0)]
    {
        let options = SceneOptions { scale: Some(seen_at), frames: Some(40), seed, ..SceneOptions::default() };
        let recording = simulate(joint, &options).expect("simulated").recording;
        let found = |search: &str| {
            let pair = detect(&format!("[scale]\nsearch = '{search}'\n"), recording.clone()).remove(0);
            let scale = pair.scale.expect("sought");
            (pair.verdict.joint, scale.factor, scale.curve.map_or(0, |curve| curve.factors.len()))
        };
        let (grid, moments) = (found("grid"), found("moments"));
        assert_eq!((grid.0.as_str(), &grid.0, grid.1), (joint, &moments.0, moments.1), "{joint} {seed}");
        assert!(moments.2 < grid.2, "{joint} {seed}: {} scales", moments.2);
    }
}

/// Half a step of the grid moves a body by 5 mm at 1 m: without noise no joint but a freer one would be left.
#[test]
fn scales_between_those_of_the_grid_are_tried_where_noise_is_less_than_a_step() {
    for (joint, noise) in [("rigid", 0.0), ("rigid", 0.0002), ("prismatic", 0.0), ("spherical", 0.002)] {
        let options = SceneOptions { scale: Some(0.94), noise: Some(noise), seed: 3, ..SceneOptions::default() };
        let recording = simulate(joint, &options).expect("simulated").recording;
        for search in ["grid", "moments"] {
            let pair = detect(&format!("[scale]\nsearch = '{search}'\n"), recording.clone()).remove(0);
            assert_eq!(
                (pair.verdict.joint.as_str(), pair.determined),
                (joint, true),
                "{noise} {search}: {:?}",
                pair.notes
            );
            // Noise in metres, of bodies 1.5 m away; without it, parabolas end where the misfit may fall by 1.
            let off = pair.scale.and_then(|scale| scale.factor).expect("shown") * 0.94 - 1.0;
            assert!(off.abs() < 1e-5 + 0.4 * noise, "{joint} {noise} {search}: off by {off:.6}");
        }
        // A fitted scale costs no more than any other parameter: it leaves no doubt about joints of many freedoms.
        let pair = &detect(CLOSED_FORM, recording)[0];
        assert_eq!((pair.verdict.joint.as_str(), pair.determined), (joint, true), "{noise}: {:?}", pair.notes);
    }
}

/// Joints that only fit beyond the range are none within it.
#[test]
fn no_joint_within_a_range_of_scales_is_not_determined_where_one_fits_beyond() {
    let narrow = "from = 0.9\nto = 1.1\n";
    for (joint, seen_at, range) in [("rigid", 0.6, ""), ("revolute", 0.3, ""), ("spherical", 0.8, narrow)] {
        let options = SceneOptions { scale: Some(seen_at), noise: Some(0.003), seed: 1, ..SceneOptions::default() };
        let recording = simulate(joint, &options).expect("simulated").recording;
        for search in ["grid", "moments"] {
            let pair = detect(&format!("[scale]\nsearch = '{search}'\n{range}"), recording.clone()).remove(0);
            let beyond = format!("`{joint}` fits at ");
            let told = pair.notes.iter().find_map(|note| note.strip_prefix(&beyond)?.split_once(','));
            let factor = told.map(|(factor, _)| factor.parse::<f64>().expect("a number"));
            // Scales that linear estimates begin with are drawn towards 0 by noise.
            let near = factor.is_some_and(|factor| (factor * seen_at - 1.0).abs() < 0.02);
            assert!(near && !pair.determined, "{joint} {search}: {} {:?}", pair.verdict.joint, pair.notes);
        }
    }
    let options = SceneOptions { scale: Some(0.6), seed: 1, ..SceneOptions::default() };
    let pair = detect("[scale]\nsearch = 'grid'\n", simulate("disconnected", &options).expect("simulated").recording);
    assert!(pair[0].determined && pair[0].verdict.joint == "disconnected", "{:?}", pair[0].notes);
}

/// What looks like no joint may be one at a scale that nobody can seek.
#[test]
fn a_single_feature_of_unknown_scale_determines_nothing_unless_the_base_rests() {
    for still_base in [false, true] {
        let options = SceneOptions { scale: Some(0.94), still_base, seed: 3, ..SceneOptions::default() };
        let recording = simulate("revolute", &options).expect("simulated").recording;
        let Observation::Points { tracks, .. } = recording.bodies()[1].observation() else { panic!("points") };
        let points = (0..tracks.frames()).map(|frame| tracks.frame(frame)[0]).collect();
        let one =
            Body::from_points("part", vec!["0".into()], Tracks::new(1, points).expect("one each")).expect("a body");
        let bodies = vec![recording.bodies()[0].clone(), one];
        let recording = Recording::new(recording.frame_numbers().to_vec(), None, bodies).expect("a recording");
        for search in ["grid", "moments", "closed-form"] {
            let pair = detect(&format!("[scale]\nsearch = '{search}'\n"), recording.clone()).remove(0);
            let told = pair.notes.iter().any(|note| note.contains("takes poses of both"));
            assert!(
                if still_base { pair.verdict.joint == "revolute" && !told } else { told && !pair.determined },
                "{search}: {:?}",
                pair.notes
            );
        }
    }
}

#[test]
fn all_pairs_agree_on_one_scale_per_body() {
    let hinge = |t: f64| place(0.1, 0.0, 0.0) * turn(0.0, 0.0, 0.9 * t) * place(0.1, 0.05, 0.0);
    let slide = |t: f64| place(0.0, 0.05, 0.2 + 0.15 * wave(0.35, t));
    let way = |t: f64| [roaming(t), roaming(t) * hinge(t), roaming(t) * hinge(t) * slide(t)];
    let detection = detection(CLOSED_FORM, seen(way, [1.0, SEEN_AT, 1.08], 1));
    let pairs = &detection.pairs;
    let joints: Vec<&str> = pairs.iter().map(|pair| pair.verdict.joint.as_str()).collect();
    // A hinge and a slide along its axis: from the first to the last body they are a cylinder.
    assert_eq!(joints, ["revolute", "cylindrical", "prismatic"]);
    let scales: Vec<_> = pairs.iter().filter_map(|pair| pair.scale.as_ref()).collect();
    let factor = |number: usize| scales[number].factor.expect("told");
    for (number, expected) in [0.94, 1.0 / 1.08, 0.94_f64.recip() / 1.08].into_iter().enumerate() {
        assert!((factor(number) / expected - 1.0).abs() < 0.005, "{number}: {}", factor(number));
        assert!(
            scales[number].closure_error.is_some_and(|error| error.abs() < 0.005),
            "{number}: {:?}",
            scales[number]
        );
    }
    assert!((factor(0) * factor(2) / factor(1) - 1.0).abs() < 1e-12);
    // Everything is told in the scale of the first body: the other bodies are where they truly are, and what slides
    // from the one to the other goes as far as it truly does.
    let scales = detection.scales.expect("sought");
    assert!(
        scales[0] == 1.0 && (scales[1] / factor(0) - 1.0).abs() < 1e-12 && (scales[2] / factor(1) - 1.0).abs() < 1e-12
    );
    let truth = seen(way, [1.0; 3], 1);
    let repaired = detection.repaired.expect("bodies were multiplied");
    for (repaired, truth) in repaired.bodies().iter().zip(truth.bodies()) {
        let first = |body: &Body| match body.observation() {
            Observation::Points { tracks, .. } => tracks.frame(0)[0],
            _ => unreachable!("bodies are seen as points"),
        };
        assert!((first(repaired) - first(truth)).norm() < 0.005, "{} {}", first(repaired), first(truth));
    }
    let slid = pairs[2].positions.as_ref().and_then(jointscope_models::Positions::ranges).expect("seen")[0];
    assert!((slid[1] - slid[0] - 0.15).abs() < 0.002, "{slid:?}");
    let through = |number: usize| pairs[number].axis.expect("an axis").point;
    let [hinge, cylinder] = [through(0), through(1)];
    let direction = pairs[0].axis.and_then(|axis| axis.direction).expect("an axis");
    assert!((cylinder - hinge).cross(&direction).norm() < 0.003, "one axis, in the first body's coordinates");
}

#[test]
fn a_search_for_the_scale_invents_no_joints() {
    let false_joints = |configuration: &str| {
        let wrong = |(scene, seed): (&str, u64)| {
            let options = SceneOptions { seed, ..SceneOptions::default() };
            let recording = simulate(scene, &options).expect("simulated").recording;
            let joint = detect(configuration, recording)[0].verdict.joint.clone();
            usize::from(["rigid", "prismatic", "revolute"].contains(&joint.as_str()))
        };
        let scenes = ["planar", "disconnected", "cylindrical"];
        scenes.into_iter().flat_map(|scene| (100..105).map(move |seed| (scene, seed))).map(wrong).sum::<usize>()
    };
    let (with, without) = (false_joints(CLOSED_FORM), false_joints(""));
    assert!(with <= without, "{with} of 15 with, {without} without");
}
