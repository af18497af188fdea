//! What must not change a detection by the default configuration: the recording's coordinates, its unit, the order of
//! features and bodies, the direction of time, the number of threads.

use std::sync::LazyLock;

use jointscope_detection::{Detection, Detector, PairDetection};
use jointscope_models::Axis;
use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_report::{to_json, to_table};
use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::detector;
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use proptest::{prelude::*, test_runner::RngSeed};
use rayon::ThreadPoolBuilder;

/// Change of a confidence by rounding: fits take the same way, and what they end at differs in the last digits, which a
/// difference of two costs of some hundreds magnifies.
const ROUNDING: f64 = 1e-6;
/// Change of a confidence where fits take another way: each ends where a step gains a millionth of its cost, and the
/// spread of the positions is found to a ten-thousandth.
const CONFIDENCE: f64 = 5e-3;
/// The same where a rival fits that the motion does not place: any slide fits two bodies that do not move, and a ball
/// whose centre is far away fits a plane. Such a fit ends anywhere in a flat valley, and may cost 0.4 more or less.
const RIVAL: f64 = 0.1;
/// The same where frames are merged into runs, since bodies seem not to move: backwards other frames make up a run.
const OTHER_RUNS: f64 = 0.3;
/// Change of an axis where fits take another way, in stated standard deviations.
const AXIS: f64 = 0.03;
/// Change of an axis by rounding, radians and metres.
const GEOMETRY: f64 = 1e-8;

/// The default, with the universal joint beside the lower pairs.
const WITH_UNIVERSAL: &str = "[models.rigid]\n[models.prismatic]\n[models.revolute]\n[models.screw]\n\
     [models.cylindrical]\n[models.planar]\n[models.spherical]\n[models.universal]\n\
     [models.disconnected]\nkind = 'free'\n";

const JOINTS: [&str; 9] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "spherical", "disconnected", "universal"];

static DEFAULT: LazyLock<Detector> = LazyLock::new(|| detector(""));
static UNIVERSAL: LazyLock<Detector> = LazyLock::new(|| detector(WITH_UNIVERSAL));

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(23), ..ProptestConfig::default() }
}

/// A nominal scene of any joint.
#[derive(Clone)]
struct Nominal {
    joint: &'static str,
    options: SceneOptions,
    recording: Recording,
}

/// What the scene is made of, not its thousand samples.
impl std::fmt::Debug for Nominal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.joint, self.options)
    }
}

fn options() -> impl Strategy<Value = SceneOptions> {
    let sizes = (30..60_usize, 8..20_usize, 25.0..120.0, 0.08..0.3);
    (any::<u64>(), 2e-4..4e-3, sizes).prop_map(|(seed, noise, (frames, features, sweep, travel))| SceneOptions {
        seed,
        noise: Some(noise),
        frames: Some(frames),
        features: Some(features),
        sweep_deg: Some(sweep),
        travel: Some(travel),
        ..SceneOptions::default()
    })
}

fn nominal() -> impl Strategy<Value = Nominal> {
    (prop::sample::select(JOINTS.to_vec()), options()).prop_map(|(joint, options)| {
        let recording = simulate(joint, &options).expect("a scene").recording;
        Nominal { joint, options, recording }
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
    frames: &(impl Iterator<Item = usize> + Clone),
    features: impl Fn(usize) -> Vec<usize>,
    place: impl Fn(&Point3<f64>) -> Point3<f64>,
) -> Recording {
    let body = |body: &Body| {
        let Observation::Points { tracks, .. } = body.observation() else { panic!("nominal scenes show points") };
        let features = features(tracks.features());
        let sample = |(frame, feature)| tracks.get(frame, feature).map_or([f64::NAN; 3].into(), &place);
        let samples = frames.clone().flat_map(|frame| features.iter().map(move |&feature| (frame, feature)));
        let labels = (0..features.len()).map(|feature| feature.to_string()).collect();
        let tracks = Tracks::new(features.len(), samples.map(sample).collect()).expect("whole frames");
        Body::from_points(body.name(), labels, tracks).expect("seen")
    };
    let bodies = recording.bodies().iter().map(body).collect();
    Recording::new((0..recording.frames() as u64).collect(), None, bodies).expect("a recording")
}

fn all(features: usize) -> Vec<usize> {
    (0..features).collect()
}

fn placed(recording: &Recording, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> Recording {
    remade(recording, &(0..recording.frames()), all, place)
}

impl Nominal {
    fn detected(&self, recording: &Recording) -> PairDetection {
        let detector = if self.joint == "universal" { &*UNIVERSAL } else { &*DEFAULT };
        detector.detect(recording.clone(), None).expect("bodies").pairs.remove(0)
    }

    /// How much a confidence may change where fits take another way.
    fn confidence(&self) -> f64 {
        if ["rigid", "planar"].contains(&self.joint) { RIVAL } else { CONFIDENCE }
    }
}

fn confidence(pair: &PairDetection, joint: &str) -> f64 {
    pair.verdict.confidences.iter().find(|(name, _)| name == joint).expect("a joint").1
}

/// Confidences agree, and so do verdicts, unless two joints are equally likely.
fn same_verdict(before: &PairDetection, after: &PairDetection, allowed: f64) -> Result<(), TestCaseError> {
    for (joint, a) in &before.verdict.confidences {
        let b = confidence(after, joint);
        prop_assert!((a - b).abs() <= allowed, "{joint}: {a} became {b}");
    }
    let rival = before.verdict.confidences.iter().filter(|(joint, _)| *joint != before.verdict.joint);
    let lead = before.verdict.confidence - rival.map(|(_, confidence)| *confidence).fold(0.0, f64::max);
    let (a, b) = (&before.verdict.joint, &after.verdict.joint);
    prop_assert!(lead <= 2.0 * allowed || a == b, "{a}, leading by {lead}, became {b}");
    prop_assert_eq!(before.frames_used, after.frames_used);
    Ok(())
}

/// How far two axes of one joint are apart: radians and metres. A slide and a plane are nowhere in particular.
fn apart(a: &Axis, b: &Axis) -> (f64, f64) {
    let beside = b.point - a.point;
    match a.direction.zip(b.direction) {
        Some((along, other)) => {
            let away = if a.pitch.is_some() { along.cross(&beside).norm() } else { 0.0 };
            (along.cross(&other).norm(), away)
        }
        None => (0.0, beside.norm()),
    }
}

/// The axes of one verdict agree to within a share of what is stated of them.
fn same_axis(
    before: &PairDetection,
    expected: Option<Axis>,
    found: Option<Axis>,
    unit: f64,
    share: f64,
) -> Result<(), TestCaseError> {
    let Some((expected, found)) = expected.zip(found) else {
        prop_assert_eq!(expected.is_some(), found.is_some());
        return Ok(());
    };
    let stated = before.axis_uncertainty.expect("stated");
    let (angle, distance) = apart(&expected, &found);
    let allowed = |stated: Option<f64>| GEOMETRY + share * stated.unwrap_or(0.0);
    prop_assert!(angle <= allowed(stated.angle), "{angle:e} rad apart, {stated:?} stated");
    prop_assert!(distance / unit <= allowed(stated.distance), "{distance:e} m apart, {stated:?} stated");
    let steep = expected.pitch.unwrap_or(0.0).abs().max(unit * 0.01);
    let pitches = expected.pitch.zip(found.pitch).map_or(0.0, |(a, b)| (a - b).abs() / steep);
    prop_assert!(pitches <= share, "the pitch {:?} became {:?}", expected.pitch, found.pitch);
    Ok(())
}

/// Noise that seems to differ along the ray from the origin does depend on where the origin is.
fn sees_a_ray(pair: &PairDetection) -> bool {
    pair.notes.iter().any(|note| note.contains("along the ray from the origin"))
}

proptest! {
    #![proptest_config(config(54))]

    #[test]
    fn the_choice_of_the_world_s_coordinates_does_not_matter_and_axes_turn_with_it(
        nominal in nominal(), world in world(),
    ) {
        let moved = placed(&nominal.recording, |p| world * p);
        let (before, after) = (nominal.detected(&nominal.recording), nominal.detected(&moved));
        prop_assume!(!sees_a_ray(&before) && !sees_a_ray(&after));
        same_verdict(&before, &after, nominal.confidence())?;
        if before.verdict.joint == after.verdict.joint {
            same_axis(&before, before.axis.map(|axis| axis.seen_from(&world)), after.axis, 1.0, AXIS)?;
            let in_moving = before.axis_in_moving.map(|axis| axis.seen_from(&world));
            same_axis(&before, in_moving, after.axis_in_moving, 1.0, AXIS)?;
        }
    }

    #[test]
    fn the_order_of_features_does_not_matter(nominal in nominal(), shift in 1..7_usize, reverse in any::<bool>()) {
        let shuffled = |features: usize| -> Vec<usize> {
            let turned = (0..features).map(|feature| (feature + shift) % features);
            if reverse { turned.rev().collect() } else { turned.collect() }
        };
        let changed = remade(&nominal.recording, &(0..nominal.recording.frames()), shuffled, |p| *p);
        let (before, after) = (nominal.detected(&nominal.recording), nominal.detected(&changed));
        same_verdict(&before, &after, ROUNDING)?;
        same_axis(&before, before.axis, after.axis, 1.0, ROUNDING)?;
        same_axis(&before, before.axis_in_moving, after.axis_in_moving, 1.0, ROUNDING)?;
    }

    #[test]
    fn it_does_not_matter_which_body_is_the_reference(nominal in nominal()) {
        let (frames, times, mut bodies) = nominal.recording.clone().into_parts();
        bodies.reverse();
        let exchanged = Recording::new(frames, times, bodies).expect("the same bodies");
        let (before, after) = (nominal.detected(&nominal.recording), nominal.detected(&exchanged));
        prop_assert_eq!((&before.reference, &before.moving), (&after.moving, &after.reference));
        // Both orders compute the same numbers.
        prop_assert_eq!(&before.verdict, &after.verdict);
        prop_assert_eq!(before.determined, after.determined);
        // An axis is less sure in the coordinates of a body that is less well known.
        prop_assert_eq!(before.axis_uncertainty.is_some(), after.axis_uncertainty.is_some());
        same_axis(&before, before.axis, after.axis_in_moving, 1.0, 0.0)?;
        same_axis(&before, before.axis_in_moving, after.axis, 1.0, 0.0)?;
        // Seen from the other body a joint of one freedom goes the same way along the opposite direction.
        let direction = |axis: Option<Axis>| axis.and_then(|axis| axis.direction);
        if let Some((a, b)) = direction(before.axis).zip(direction(after.axis_in_moving)) {
            prop_assert!(a.dot(&b) < 0.0, "{a:?} became {b:?}");
        }
        let one_freedom = before.positions.as_ref().is_some_and(|positions| positions.freedoms() == 1);
        prop_assert!(!one_freedom || before.positions == after.positions);
    }

    #[test]
    fn the_unit_does_not_matter(nominal in nominal(), unit in prop::sample::select(vec![1000.0, 0.001])) {
        let (before, after) =
            (nominal.detected(&nominal.recording), nominal.detected(&placed(&nominal.recording, |p| p * unit)));
        same_verdict(&before, &after, nominal.confidence())?;
        if before.verdict.joint == after.verdict.joint {
            let scaled = |axis: Axis| Axis { point: axis.point * unit, pitch: axis.pitch.map(|p| p * unit), ..axis };
            same_axis(&before, before.axis.map(scaled), after.axis, unit, AXIS)?;
        }
        let noise = before.noise_moving.position.expect("estimated") * unit;
        prop_assert!((after.noise_moving.position.expect("estimated") / noise - 1.0).abs() <= ROUNDING);
    }

    #[test]
    fn time_may_run_backwards(joint in prop::sample::select(JOINTS.to_vec()), options in options()) {
        // Seen from the world, whose coordinates do not hang on the first frame.
        let options = SceneOptions { still_base: true, ..options };
        let scene = simulate(joint, &options).expect("a scene");
        let (frames, times, mut bodies) = scene.recording.into_parts();
        let recording = Recording::new(frames, times, vec![bodies.remove(1)]).expect("one body");
        let nominal = Nominal { joint, options, recording };
        let backwards = remade(&nominal.recording, &(0..nominal.recording.frames()).rev(), all, |p| *p);
        let (before, after) = (nominal.detected(&nominal.recording), nominal.detected(&backwards));
        prop_assume!(!sees_a_ray(&before) && !sees_a_ray(&after));
        same_verdict(&before, &after, if joint == "rigid" { OTHER_RUNS } else { nominal.confidence() })?;
        if before.verdict.joint == after.verdict.joint {
            same_axis(&before, before.axis, after.axis, 1.0, AXIS)?;
        }
        let ranges = |pair: &PairDetection| Some(pair.positions.as_ref()?.ranges()?.iter().map(|[a, b]| b - a).collect());
        let (a, b): (Option<Vec<f64>>, Option<Vec<f64>>) = (ranges(&before), ranges(&after));
        if let (true, Some((a, b))) = (before.verdict.joint == after.verdict.joint, a.zip(b)) {
            // Of several freedoms, the axes of the others are anybody's choice.
            prop_assert!((a[0] - b[0]).abs() <= 0.01 * a[0] || a.len() == 3, "a range of {a:?} became {b:?}");
        }
    }
}

#[test]
fn neither_the_number_of_threads_nor_the_run_changes_a_byte() {
    for name in ["drawers", "revolute", "spherical", "disconnected"] {
        let options = SceneOptions { seed: 7, frames: Some(40), dropout: Some(0.1), ..SceneOptions::default() };
        let recording = simulate(name, &options).expect(name).recording;
        let json = |detector: &Detector| to_json(&detector.detect(recording.clone(), None).expect("bodies"));
        let first = json(&DEFAULT);
        assert!(first.contains("\"log_evidence\""), "{name} has evidence");
        for threads in [1, 2, 5] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            // A detector of its own each time, so that nothing is left over.
            let again = pool.install(|| json(&detector("")));
            assert!(again == first, "{name} with {threads} threads differs");
        }
    }
}

#[test]
fn a_universal_joint_is_found_where_its_model_is_there() {
    for seed in 0..6 {
        let options = SceneOptions { seed, noise: Some(0.001), ..SceneOptions::default() };
        let recording = simulate("universal", &options).expect("a scene").recording;
        let pair = UNIVERSAL.detect(recording, None).expect("two bodies").pairs.remove(0);
        assert_eq!(pair.verdict.joint, "universal", "seed {seed}: {:?}", pair.verdict.confidences);
        // A ball fits as well, and has as many parameters; all else is ruled out.
        let either = ["universal", "spherical"].map(|joint| confidence(&pair, joint));
        assert!(either.iter().sum::<f64>() > 0.999, "seed {seed}: {:?}", pair.verdict.confidences);
    }
}

/// A wall, a door that turns by 83 degrees, and a single point that slides along the wall.
fn wall_door_and_knob() -> Detection {
    const SHAPE: [[f64; 3]; 4] = [[0.5, 0., 0.], [0.7, 0., 0.1], [0.5, 0.2, 0.25], [0.6, 0.1, 0.4]];
    let frames = 30;
    let body = |name: &str, features: usize, place: &dyn Fn(usize, usize) -> Point3<f64>| {
        let samples = (0..frames).flat_map(|t| (0..features).map(move |f| (t, f))).map(|(t, f)| place(t, f));
        let tracks = Tracks::new(features, samples.collect()).expect("whole frames");
        Body::from_points(name, (0..features).map(|f| f.to_string()).collect(), tracks).expect("seen")
    };
    let turn = |t: usize| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.05 * t as f64);
    let bodies = vec![
        body("wall", 4, &|_, f| SHAPE[f].into()),
        body("door", 4, &|t, f| turn(t) * Point3::from(SHAPE[f]) + Vector3::x()),
        body("knob", 1, &|t, _| Point3::new(0.3 + 0.02 * t as f64, 0.2, 0.1)),
    ];
    let recording = Recording::new((0..frames as u64).collect(), None, bodies).expect("a recording");
    DEFAULT.detect(recording, None).expect("bodies")
}

#[test]
fn columns_of_the_table_hold_what_their_heads_say_for_every_pair() {
    let detection = wall_door_and_knob();
    let table = to_table(&detection);
    let mut lines = table.lines().skip(2);
    let heads: Vec<&str> = lines.next().expect("heads").split_whitespace().collect();
    for (pair, line) in detection.pairs.iter().zip(lines) {
        let cells: Vec<&str> = line.split_whitespace().filter(|cell| *cell != "?").collect();
        for (joint, confidence) in &pair.verdict.confidences {
            let column = heads.iter().position(|head| head == joint).expect("a column");
            assert_eq!(cells[column], format!("{confidence:.3}"), "{joint} in\n{table}");
        }
    }
}

#[test]
fn the_table_tells_angles_in_degrees_and_lengths_in_metres() {
    for (joint, units) in [
        ("cylindrical", vec!["deg,", "m"]),
        ("planar", vec!["deg,", "m,", "m"]),
        ("spherical", vec!["deg,", "deg,", "deg"]),
    ] {
        let options = SceneOptions { noise: Some(0.001), ..SceneOptions::default() };
        let recording = simulate(joint, &options).expect("a scene").recording;
        let table = to_table(&DEFAULT.detect(recording, None).expect("two bodies"));
        let row = table.lines().nth(3).expect("a row");
        let found: Vec<&str> =
            row.split_whitespace().filter(|word| word.starts_with("deg") || word.starts_with('m')).collect();
        assert_eq!(found, units, "{joint}:\n{table}");
    }
}
