//! What must not change a detection: the recording's coordinates, its unit, the order and number of features, the
//! direction of time, the number of threads.

use std::sync::LazyLock;

use jointscope_detection::{Detection, Detector, PairDetection};
use jointscope_models::Axis;
use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_report::to_json;
use jointscope_scenes::{SceneOptions, scene, simulate};
use jointscope_tests::{THESIS, detector};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use proptest::{prelude::*, test_runner::RngSeed};
use rayon::ThreadPoolBuilder;

/// Change of a confidence by rounding of coordinates: 1e-16 of some metres, magnified by badly conditioned circles.
/// A sample that crosses an edge of a score would count 1e-4 or more; noise keeps samples that far from every edge,
/// and the seeds are fixed.
const CONFIDENCE: f64 = 1e-9;
/// The same where two registrations must meet from different starts: each stops within 1e-11 of the shape's size.
const SETTLED: f64 = 1e-7;
/// Change of an axis by rounding, where its joint is the verdict and sure: radians and metres.
const GEOMETRY: f64 = 1e-8;
/// Confidence from which an axis is compared; below, it may be ill-conditioned without limit.
const SURE: f64 = 0.5;
/// Departure of the sum of confidences from 1: rounding of a few products.
const SUM: f64 = 1e-12;

static DETECTOR: LazyLock<Detector> = LazyLock::new(|| detector(THESIS));
/// The thesis's models behind the registration that treats all frames alike.
static BY_SHAPE: LazyLock<Detector> = LazyLock::new(|| {
    let text = THESIS.replace("registration = \"chained\"", "registration = \"shape\"\nrobust = false");
    assert_ne!(text, THESIS);
    detector(&text)
});

fn config() -> ProptestConfig {
    ProptestConfig { cases: 256, failure_persistence: None, rng_seed: RngSeed::Fixed(44), ..ProptestConfig::default() }
}

fn kind() -> impl Strategy<Value = &'static str> {
    // Joints that the thesis knows come oftener than those that it does not.
    let kinds = ["rigid", "prismatic", "prismatic", "revolute", "revolute", "disconnected", "screw", "planar"];
    prop::sample::select(kinds.to_vec())
}

fn options() -> impl Strategy<Value = SceneOptions> {
    let dropout = prop_oneof![Just(None), (0.02..0.2).prop_map(Some)];
    let sizes = (30..60_usize, 6..12_usize, 20.0..120.0, 0.05..0.3);
    (any::<u64>(), 2e-4..4e-3, dropout, sizes).prop_map(|(seed, noise, dropout, (frames, features, sweep, travel))| {
        SceneOptions {
            seed,
            noise: Some(noise),
            dropout,
            frames: Some(frames),
            features: Some(features),
            sweep_deg: Some(sweep),
            travel: Some(travel),
            ..SceneOptions::default()
        }
    })
}

/// Two bodies, or three of which the last hangs on the second.
fn recording() -> impl Strategy<Value = Recording> {
    (kind(), prop::option::of(kind()), options()).prop_map(|(kind, third, options)| {
        let mut scene = scene(kind, &options).expect("a scene");
        if let Some(kind) = third {
            let other = SceneOptions { seed: options.seed ^ 1, ..options.clone() };
            let mut third = jointscope_scenes::scene(kind, &other).expect("a scene").bodies.remove(1);
            third.name = "third".into();
            third.attachment.parent = Some(1);
            scene.bodies.push(third);
        }
        scene.simulate(options.seed).expect("a recording").recording
    })
}

fn world() -> impl Strategy<Value = Pose> {
    let triple = |reach: f64| prop::array::uniform3(-reach..reach).prop_map(Vector3::from);
    (triple(5.0), triple(1.8))
        .prop_map(|(place, turn)| Pose::from_parts(Translation3::from(place), UnitQuaternion::from_scaled_axis(turn)))
}

/// The same recording with other frames, features or places.
fn remade(
    recording: &Recording,
    frames: &[usize],
    features: impl Fn(usize) -> Vec<usize>,
    place: impl Fn(&Point3<f64>) -> Point3<f64>,
) -> Recording {
    let body = |body: &Body| {
        let Observation::Points { tracks, .. } = body.observation() else { panic!("scenes show points") };
        let features = features(tracks.features());
        let sample = |(frame, feature)| tracks.get(frame, feature).map_or([f64::NAN; 3].into(), &place);
        let samples = frames.iter().flat_map(|&frame| features.iter().map(move |&feature| (frame, feature)));
        let labels = (0..features.len()).map(|feature| feature.to_string()).collect();
        let tracks = Tracks::new(features.len(), samples.map(sample).collect()).expect("whole frames");
        Body::from_points(body.name(), labels, tracks).expect("seen")
    };
    let bodies = recording.bodies().iter().map(body).collect();
    Recording::new((0..frames.len() as u64).collect(), None, bodies).expect("a recording")
}

fn all_frames(recording: &Recording) -> Vec<usize> {
    (0..recording.frames()).collect()
}

fn placed(recording: &Recording, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> Recording {
    remade(recording, &all_frames(recording), |features| (0..features).collect(), place)
}

fn detected(recording: &Recording) -> Detection {
    let detection = DETECTOR.detect(recording.clone(), None).expect("bodies");
    for pair in &detection.pairs {
        let sum: f64 = pair.verdict.confidences.iter().map(|(_, confidence)| confidence).sum();
        assert!((sum - 1.0).abs() <= SUM, "confidences sum to {sum}");
        assert!(pair.models.values().all(Result::is_ok), "every model can judge these");
    }
    detection
}

/// Confidences agree, and so do verdicts, unless two joints are equally likely.
fn same_confidences(before: &Detection, after: &Detection) -> Result<(), TestCaseError> {
    prop_assert_eq!(before.pairs.len(), after.pairs.len());
    for (before, after) in before.pairs.iter().zip(&after.pairs) {
        for ((joint, a), (_, b)) in before.verdict.confidences.iter().zip(&after.verdict.confidences) {
            prop_assert!((a - b).abs() <= CONFIDENCE, "{joint}: {a} became {b}");
        }
        for (name, fit) in &before.models {
            let [a, b] = [fit, &after.models[name]].map(|fit| fit.as_ref().expect("judged").confidence.value());
            prop_assert!((a - b).abs() <= CONFIDENCE, "model {name}: {a} became {b}");
        }
        let mut ranked: Vec<f64> = before.verdict.confidences.iter().map(|(_, confidence)| *confidence).collect();
        ranked.sort_by(f64::total_cmp);
        let lead = ranked[ranked.len() - 1] - ranked[ranked.len() - 2];
        prop_assert!(lead <= CONFIDENCE || before.verdict.joint == after.verdict.joint);
        prop_assert_eq!(before.frames_used, after.frames_used);
    }
    Ok(())
}

/// Axes of sure verdicts are where they should be: by the angle between them and the distance between lines.
fn same_axes(
    before: &Detection,
    after: &Detection,
    place: impl Fn(&Axis) -> Axis,
    unit: f64,
) -> Result<(), TestCaseError> {
    let sure = |pair: &&PairDetection| pair.verdict.confidence > SURE;
    for (before, after) in before.pairs.iter().zip(&after.pairs).filter(|(before, _)| sure(before)) {
        for (before, after) in [(before.axis, after.axis), (before.axis_in_moving, after.axis_in_moving)] {
            prop_assert_eq!(before.is_some(), after.is_some());
            let Some((expected, found)) = before.map(|axis| place(&axis)).zip(after) else { continue };
            let [a, b] = [expected, found].map(|axis| axis.direction.expect("the thesis's joints have directions"));
            let (angle, distance) = (a.cross(&b).norm(), a.cross(&(found.point - expected.point)).norm() / unit);
            prop_assert!(angle <= GEOMETRY && distance <= GEOMETRY, "{angle:e} rad, {distance:e} m");
            prop_assert_eq!(expected.pitch, found.pitch);
        }
    }
    Ok(())
}

fn scaled(axis: &Axis, unit: f64) -> Axis {
    Axis { point: axis.point * unit, ..*axis }
}

/// A confidence by a model's name.
fn says(detection: &Detection, pair: usize, model: &str) -> f64 {
    detection.pairs[pair].models[model].as_ref().expect("judged").confidence.value()
}

/// The same recording played backwards.
fn backwards(recording: &Recording) -> Recording {
    let frames: Vec<usize> = (0..recording.frames()).rev().collect();
    remade(recording, &frames, |features| (0..features).collect(), |p| *p)
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn the_choice_of_the_world_s_coordinates_does_not_matter_and_axes_turn_with_it(
        recording in recording(), world in world(),
    ) {
        let (before, after) = (detected(&recording), detected(&placed(&recording, |p| world * p)));
        same_confidences(&before, &after)?;
        same_axes(&before, &after, |axis| axis.seen_from(&world), 1.0)?;
    }

    #[test]
    fn neither_the_order_nor_the_repetition_of_features_matters(
        recording in recording(), shift in 1..5_usize, reverse in any::<bool>(),
    ) {
        let before = detected(&recording);
        let shuffled = |features: usize| -> Vec<usize> {
            let turned = (0..features).map(|feature| (feature + shift) % features);
            if reverse { turned.rev().collect() } else { turned.collect() }
        };
        let twice = |features: usize| -> Vec<usize> { (0..features).chain(0..features).collect() };
        for changed in [
            remade(&recording, &all_frames(&recording), shuffled, |p| *p),
            remade(&recording, &all_frames(&recording), twice, |p| *p),
        ] {
            let after = detected(&changed);
            same_confidences(&before, &after)?;
            same_axes(&before, &after, |axis| *axis, 1.0)?;
        }
    }

    #[test]
    fn the_unit_does_not_matter(recording in recording()) {
        let before = detected(&recording);
        let after = detected(&placed(&recording, |p| p * 1000.0));
        same_confidences(&before, &after)?;
        same_axes(&before, &after, |axis| scaled(axis, 1000.0), 1000.0)?;
    }

    #[test]
    fn a_unit_that_is_a_power_of_two_changes_not_a_bit(recording in recording(), exponent in -20..=20) {
        let unit = 2_f64.powi(exponent);
        let (before, after) = (detected(&recording), detected(&placed(&recording, |p| p * unit)));
        for (before, after) in before.pairs.iter().zip(&after.pairs) {
            prop_assert_eq!(&before.verdict, &after.verdict);
            prop_assert_eq!(before.determined, after.determined);
            prop_assert_eq!(before.noise_moving.position.map(|sigma| sigma * unit), after.noise_moving.position);
            prop_assert_eq!(before.axis.map(|axis| scaled(&axis, unit)), after.axis);
            prop_assert_eq!(before.axis_in_moving.map(|axis| scaled(&axis, unit)), after.axis_in_moving);
            for (name, fit) in &before.models {
                let [before, after] = [fit, &after.models[name]].map(|fit| fit.as_ref().expect("judged"));
                prop_assert_eq!(before.confidence, after.confidence);
                prop_assert_eq!(before.residual_rms.map(|rms| rms * unit), after.residual_rms);
                for (part, value) in &before.parts {
                    let is_length = part.starts_with("distance") || *part == "length";
                    let expected = if is_length { value * unit } else { *value };
                    prop_assert_eq!(expected, after.parts[part], "{} of {}", part, name);
                }
            }
        }
    }

    #[test]
    fn time_may_run_backwards_before_a_reference_that_rests(kind in kind(), options in options()) {
        let mut scene = scene(kind, &SceneOptions { still_base: true, ..options.clone() }).expect("a scene");
        scene.bodies[0].noise_factor = 0.0;
        let (frames, times, mut bodies) = scene.simulate(options.seed).expect("a recording").recording.into_parts();
        // A chain that sees the reference with gaps may lose other frames in the other direction.
        scene.sensor.dropout = 0.0;
        bodies[0] = scene.simulate(options.seed).expect("a recording").recording.bodies()[0].clone();
        let recording = Recording::new(frames, times, bodies).expect("the same frames");
        let (before, after) = (detected(&recording), detected(&backwards(&recording)));
        for model in ["rigid", "revolute"] {
            let (a, b) = (says(&before, 0, model), says(&after, 0, model));
            prop_assert!((a - b).abs() <= CONFIDENCE, "{model}: {a} became {b}");
        }
    }

    #[test]
    fn time_may_run_backwards_where_all_frames_are_registered_alike(recording in recording()) {
        let [before, after] = [recording.clone(), backwards(&recording)]
            .map(|recording| BY_SHAPE.detect(recording, None).expect("bodies"));
        for pair in 0..before.pairs.len() {
            for model in ["rigid", "revolute"] {
                let (a, b) = (says(&before, pair, model), says(&after, pair, model));
                prop_assert!((a - b).abs() <= SETTLED, "{model}: {a} became {b}");
            }
        }
    }
}

#[test]
fn neither_the_number_of_threads_nor_the_run_changes_a_byte() {
    let options = SceneOptions { seed: 7, frames: Some(60), dropout: Some(0.1), ..SceneOptions::default() };
    for name in ["drawers", "revolute", "train"] {
        let recording = simulate(name, &options).expect(name).recording;
        let json = |detector: &Detector| to_json(&detector.detect(recording.clone(), None).expect("bodies"));
        let first = json(&DETECTOR);
        assert!(first.contains("\"confidences\""), "{name} has pairs");
        for threads in [1, 2, 5] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            for run in 0..2 {
                // A detector of its own each time, so that nothing is left over.
                let again = pool.install(|| json(&detector(THESIS)));
                assert!(again == first, "{name}: run {run} with {threads} threads differs");
            }
        }
    }
}
