//! Detection frame by frame gives what detection of the whole gives.

use jointscope_detection::{Configuration, Detection, Detector, LiveDetector};
use jointscope_models::Catalog;
use jointscope_motion::{Body, Observation, Recording, nalgebra::Point3};
use jointscope_scenes::workloads::kitchen;

/// Five bodies, of which some samples are missing, and one of which is not seen well at first.
fn recorded() -> Recording {
    let seen = kitchen(5, 61, 8, 7).expect("a workload").recording;
    let missing = |body: usize, frame: usize, feature: usize| match body {
        1 => frame < 3 && feature > 1,
        2 => (frame * 7 + feature * 3).is_multiple_of(11),
        3 => frame == 20,
        _ => false,
    };
    let body = |(index, body): (usize, &Body)| {
        let Observation::Points { labels, tracks } = body.observation() else { panic!("points") };
        let sample = |frame: usize, feature: usize| {
            let there = tracks.get(frame, feature).filter(|_| !missing(index, frame, feature));
            there.copied().unwrap_or(Point3::from([f64::NAN; 3]))
        };
        let samples = (0..tracks.frames()).flat_map(|t| (0..tracks.features()).map(move |f| sample(t, f)));
        let tracks = jointscope_motion::Tracks::new(tracks.features(), samples.collect()).expect("whole frames");
        Body::from_points(body.name(), labels.clone(), tracks).expect("seen")
    };
    let bodies = seen.bodies().iter().enumerate().map(body).collect();
    let times = (0..seen.frames()).map(|frame| frame as f64 / 30.0).collect();
    Recording::new((0..seen.frames() as u64).collect(), Some(times), bodies).expect("as before")
}

fn positions(body: &Body, frame: usize) -> Vec<Point3<f64>> {
    let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
    (0..tracks.features())
        .map(|feature| tracks.get(frame, feature).copied().unwrap_or(Point3::from([f64::NAN; 3])))
        .collect()
}

/// The first frames of a recording.
fn beginning(recording: &Recording, frames: usize) -> Recording {
    let body = |body: &Body| {
        let Observation::Points { labels, .. } = body.observation() else { panic!("points") };
        let samples = (0..frames).flat_map(|frame| positions(body, frame)).collect();
        let tracks = jointscope_motion::Tracks::new(labels.len(), samples).expect("whole frames");
        Body::from_points(body.name(), labels.clone(), tracks).expect("seen")
    };
    let times = recording.times().map(|times| times[..frames].to_vec());
    Recording::new((0..frames as u64).collect(), times, recording.bodies().iter().map(body).collect()).expect("fits")
}

fn configuration(text: &str) -> Configuration {
    Configuration::parse(text, &Catalog::linked().expect("unique names")).expect("valid")
}

fn live(text: &str, recording: &Recording, asked: &mut dyn FnMut(&LiveDetector)) {
    let labels = |body: &Body| match body.observation() {
        Observation::Points { labels, .. } => labels.clone(),
        _ => panic!("points"),
    };
    let bodies = recording.bodies().iter().map(|body| (body.name().to_owned(), labels(body))).collect();
    let mut live = LiveDetector::new(configuration(text), bodies).expect("names");
    for (frame, time) in recording.times().expect("times").iter().enumerate() {
        let frame: Vec<_> = recording.bodies().iter().map(|body| positions(body, frame)).collect();
        live.push(*time, &frame).expect("fits");
        asked(&live);
    }
}

fn whole(text: &str, recording: &Recording) -> Detection {
    Detector::new(configuration(text)).detect(recording.clone(), None).expect("names")
}

/// To the last digit; positions that are not known are no numbers, and so equal nothing.
fn are_equal(found: &Detection, expected: &Detection) -> bool {
    format!("{found:?}") == format!("{expected:?}")
}

#[test]
fn the_joints_of_all_frames_so_far_are_those_of_a_recording_of_them() {
    let thesis = include_str!("../../../configs/thesis.toml");
    let first = thesis.replace(r#"registration = "chained""#, r#"registration = "first""#);
    let recording = recorded();
    for text in [thesis, &first] {
        live(text, &recording, &mut |live| {
            if [5, 16, 23, 61].contains(&live.frames()) {
                let expected = whole(text, &beginning(&recording, live.frames()));
                assert!(are_equal(&live.detect().expect("seen"), &expected), "{} frames", live.frames());
                for (body, poses) in expected.poses.iter().enumerate() {
                    assert_eq!(live.pose(body), poses[live.frames() - 1]);
                }
            }
        });
    }
}

#[test]
fn by_likelihood_they_are_too_and_poses_are_near_before() {
    let recording = recorded();
    live("", &recording, &mut |live| {
        if live.frames() == 61 {
            let detection = live.detect().expect("seen");
            assert!(are_equal(&detection, &whole("", &recording)));
            for (body, poses) in detection.poses.iter().enumerate() {
                let (Some(first), Some(found)) = (live.pose(body), poses[60]) else { panic!("posed") };
                let off = first.inverse() * found;
                assert!(off.rotation.angle() < 0.02 && off.translation.vector.norm() < 0.02, "body {body}: {off}");
            }
        }
    });
}

#[test]
fn one_body_is_seen_from_the_world() {
    let recording = recorded();
    let (name, labels) = ("lid".to_owned(), (1..=8).map(|label| label.to_string()).collect::<Vec<_>>());
    let thesis = include_str!("../../../configs/thesis.toml");
    let mut live = LiveDetector::new(configuration(thesis), vec![(name, labels)]).expect("a name");
    assert!(live.detect().is_err(), "nothing is recorded yet");
    for frame in 0..30 {
        live.push(frame as f64, &[positions(&recording.bodies()[4], frame)]).expect("fits");
    }
    let detection = live.detect().expect("seen");
    assert_eq!((detection.pairs[0].reference.as_str(), detection.pairs[0].moving.as_str()), ("world", "lid"));
    let refused = live.push(31.0, &[positions(&recording.bodies()[4], 30)[..7].to_vec()]).expect_err("a feature less");
    assert!(refused.to_string().contains("has 7 positions of body `lid`, which has 8 features"), "{refused}");
    assert_eq!(live.frames(), 30);
}
