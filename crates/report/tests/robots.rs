//! Robot descriptions load in parsers of others, and move there as the recording does.

use std::collections::BTreeMap;

use jointscope_detection::{Configuration, Detection, Detector};
use jointscope_models::Catalog;
use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_report::{Report, to_mjcf, to_urdf};
use jointscope_scenes::{SceneOptions, simulate};
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Noise of the recordings, metres per coordinate.
const NOISE: f64 = 0.002;

fn detect(recording: &Recording, settings: &str) -> Detection {
    let configuration = Configuration::parse(settings, &Catalog::linked().expect("unique names")).expect("valid");
    Detector::new(configuration).detect(recording.clone(), None).expect("bodies")
}

fn scene(name: &str) -> Recording {
    let options = SceneOptions { noise: Some(NOISE), ..SceneOptions::default() };
    simulate(name, &options).expect("a scene").recording
}

/// Three bodies in a row on two hinges that are neither parallel nor meet, the first one still.
fn two_hinges() -> Recording {
    let frames: u32 = 120;
    let turn = |axis: Vector3<f64>, at: Point3<f64>, angle: f64| {
        let about =
            Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(axis.normalize() * angle));
        Pose::translation(at.x, at.y, at.z) * about * Pose::translation(-at.x, -at.y, -at.z)
    };
    let mut noise = Noise(1);
    let mut bodies: Vec<Vec<Point3<f64>>> = vec![Vec::new(); 3];
    for frame in 0..frames {
        let t = f64::from(frame) / 30.0;
        let first = turn(Vector3::new(0.1, 0.0, 1.0), Point3::new(0.3, 0.0, 1.5), 0.8 * (1.3 * t).sin());
        let second = first * turn(Vector3::new(0.2, 1.0, 0.1), Point3::new(0.7, 0.1, 1.5), 0.6 * (2.1 * t + 1.0).sin());
        for (body, pose) in [Pose::identity(), first, second].iter().enumerate() {
            for feature in 0..12_u32 {
                let corner = Vector3::from_fn(|axis, _| {
                    let steps = f64::from((feature * 7 + u32::try_from(axis).expect("small") * 5) % 11);
                    0.03 * (steps - 5.0)
                });
                let place = Point3::new(0.1 + 0.4 * body as f64, 0.0, 1.5) + corner;
                bodies[body].push(pose * place + Vector3::from_fn(|_, _| NOISE * noise.next()));
            }
        }
    }
    let labels: Vec<String> = (0..12).map(|feature| feature.to_string()).collect();
    let body = |(name, places): (&str, Vec<Point3<f64>>)| {
        Body::from_points(name, labels.clone(), Tracks::new(12, places).expect("whole frames")).expect("seen")
    };
    let times = (0..frames).map(|frame| f64::from(frame) / 30.0).collect();
    let frame_numbers = (0..u64::from(frames)).collect();
    let named = ["post", "arm", "hand"].into_iter().zip(bodies).map(body).collect();
    Recording::new(frame_numbers, Some(times), named).expect("valid")
}

/// Noise of variance 1 without a dependency: twelve uniform numbers make nearly a Gaussian one.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Root mean square distance per coordinate between features as recorded, and as the loaded robot has them in the
/// positions of the detection; every link on joints of one freedom counts, seen from where its chain begins.
fn departure(recording: &Recording, detection: &Detection) -> f64 {
    let report = Report { detection, recording, settings: "" };
    let urdf = urdf_rs::read_from_string(&to_urdf(&report)).expect("urdf-rs reads it");
    assert!(urdf.links.iter().all(|link| !link.name.is_empty()));
    let chain = loaded(&report);
    let of_joint: BTreeMap<String, usize> = detection
        .structure
        .branches
        .iter()
        .filter_map(|branch| {
            let name = |body: usize| &detection.bodies[body];
            Some((format!("{}-{}", name(branch.parent), name(branch.child)), branch.pair?))
        })
        .collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for branch in &detection.structure.branches {
        let Some(pair) = branch.pair.map(|pair| &detection.pairs[pair]) else { continue };
        let Some(positions) = pair.positions.as_ref().filter(|positions| positions.freedoms() == 1) else { continue };
        let rows: Vec<Option<f64>> = positions.iter().map(|row| row.map(|row| row[0])).collect();
        let Observation::Points { tracks, .. } = recording.bodies()[branch.child].observation() else { continue };
        let name = format!("{}-{}", detection.bodies[branch.parent], detection.bodies[branch.child]);
        let node = chain.find(&name).expect("the joint");
        // In the child's link every feature has one place: what it moves there is what the robot does not explain.
        let mut places: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); tracks.features()];
        for (frame, q) in rows.iter().enumerate() {
            let Some(q) = *q else { continue };
            let others: BTreeMap<&str, f64> = of_joint
                .iter()
                .filter_map(|(name, pair)| {
                    let row = detection.pairs[*pair].positions.as_ref()?.iter().nth(frame)??;
                    (row.len() == 1).then_some((name.as_str(), row[0]))
                })
                .collect();
            for other in chain.iter() {
                let position = others.get(other.joint().name.as_str());
                position.inspect(|position| other.set_joint_position_unchecked(**position));
            }
            assert!((node.joint_position().expect("moves") - q).abs() < 1e-12);
            chain.update_transforms();
            let root = parent_of_chain(detection, branch.parent);
            let Some(recording_from_root) = detection.poses[root][frame] else { continue };
            let recording_from_link = recording_from_root * isometry(&node.world_transform().expect("known"));
            for (feature, point) in tracks.seen(frame) {
                places[feature].push(recording_from_link.inverse_transform_point(point).coords);
            }
        }
        for places in places.iter().filter(|places| places.len() > 1) {
            let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
            sum += places.iter().map(|place| (place - mean).norm_squared()).sum::<f64>();
            count += 3.0 * places.len() as f64;
        }
    }
    assert!(count > 1000.0, "features were compared");
    (sum / f64::max(count, 1.0)).sqrt()
}

/// The body on which a chain of joints begins.
fn parent_of_chain(detection: &Detection, body: usize) -> usize {
    match detection.structure.branches.iter().find(|branch| branch.child == body) {
        Some(branch) if branch.pair.is_some() => parent_of_chain(detection, branch.parent),
        _ => body,
    }
}

fn isometry(pose: &k::Isometry3<f64>) -> Pose {
    let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
    Pose::from_parts(
        Vector3::new(t.x, t.y, t.z).into(),
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q.w, q.i, q.j, q.k)),
    )
}

#[test]
fn drawers_and_a_chain_of_two_hinges_move_as_recorded_within_twice_the_noise() {
    for (name, recording) in [("drawers", scene("drawers")), ("two hinges", two_hinges())] {
        let detection = detect(&recording, "");
        let departure = departure(&recording, &detection);
        assert!((0.5 * NOISE..2.0 * NOISE).contains(&departure), "{name}: {departure:.5} m");
    }
}

#[test]
fn the_wheel_of_a_tricycle_moves_as_recorded_as_seen_from_its_top() {
    let recording = scene("tricycle");
    let detection = detect(&recording, "output.base = 'top'");
    assert_eq!(detection.bodies[detection.structure.base], "top");
    let departure = departure(&recording, &detection);
    assert!((0.5 * NOISE..2.0 * NOISE).contains(&departure), "{departure:.5} m");
}

#[test]
fn a_chain_of_two_hinges_is_told_as_such() {
    let recording = two_hinges();
    let detection = detect(&recording, "");
    let report = Report { detection: &detection, recording: &recording, settings: "" };
    let urdf = urdf_rs::read_from_string(&to_urdf(&report)).expect("urdf-rs reads it");
    let joints: Vec<_> = urdf.joints.iter().map(|joint| (joint.name.as_str(), &joint.joint_type)).collect();
    assert_eq!(joints.len(), 2);
    assert!(matches!(joints[0], ("post-arm", urdf_rs::JointType::Revolute)), "{joints:?}");
    assert!(matches!(joints[1], ("arm-hand", urdf_rs::JointType::Revolute)), "{joints:?}");
    let [ends] = detection.structure.indirect.as_slice() else { panic!("one pair follows") };
    assert!(!ends.closes_loop && ends.way.len() == 2);
}

#[test]
fn every_kind_of_joint_loads() {
    for name in
        ["rigid", "prismatic", "screw", "cylindrical", "planar", "spherical", "universal", "disconnected", "fridge"]
    {
        let recording = scene(name);
        let detection = detect(&recording, "");
        let report = Report { detection: &detection, recording: &recording, settings: "" };
        let urdf = urdf_rs::read_from_string(&to_urdf(&report)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(urdf.links.len(), urdf.joints.len() + 1, "{name} is a tree");
        for joint in urdf.joints.iter().filter_map(|joint| joint.mimic.as_ref()) {
            assert!(urdf.joints.iter().any(|other| other.name == joint.joint));
        }
        assert!(loaded(&report).iter().count() >= urdf.joints.len());
        assert!(to_mjcf(&report).ends_with("</mujoco>\n"));
    }
}

/// The robot as the crate `k` loads it, which takes files only.
fn loaded(report: &Report<'_>) -> k::Chain<f64> {
    let file = tempfile::NamedTempFile::with_suffix(".urdf").expect("a file");
    std::fs::write(file.path(), to_urdf(report)).expect("written");
    k::Chain::from_urdf_file(file.path()).expect("k reads it")
}

#[test]
fn names_of_bodies_are_text_and_nothing_else() {
    let mut recording = two_hinges();
    let (frames, times, bodies) = recording.clone().into_parts();
    let odd = ["<link name=\"x\"/>", "a & 'b' \u{1}", "\"]]>"];
    let renamed = bodies.iter().zip(odd).map(|(body, name)| match body.observation() {
        Observation::Points { labels, tracks } => {
            Body::from_points(name, labels.clone(), tracks.clone()).expect("seen")
        }
        _ => body.clone(),
    });
    recording = Recording::new(frames, times, renamed.collect()).expect("valid");
    let detection = detect(&recording, "");
    let report = Report { detection: &detection, recording: &recording, settings: "" };
    let urdf = urdf_rs::read_from_string(&to_urdf(&report)).expect("urdf-rs reads it");
    let names: Vec<&str> = urdf.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["<link name=\"x\"/>", "a & 'b' \\u{1}", "\"]]>"]);
}
