//! One motion in every format is one recording.

#![expect(clippy::cast_possible_truncation, reason = "samples are few and small")]

mod samples;

use std::fs;

use jointscope_motion::{Body, Observation, Recording};
use jointscope_recordings::{
    BodyPatterns, Format, Grouping, Marker, Markers, ReadOptions, Unit, group, inspect, read, read_markers,
    read_with_notes,
};

use samples::{C3d, FRAMES, NAMES, Numbers, Processor, millimetres};

/// Writes a sample under a name, and reads it.
fn markers(name: &str, bytes: impl AsRef<[u8]>) -> Markers {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("written");
    read_markers(&path, &ReadOptions::default()).expect("sound")
}

/// Checks markers against what was written.
fn check(found: &Markers, first_frame: u64) {
    let names: Vec<&str> = found.markers.iter().map(|marker| marker.name.as_str()).collect();
    assert_eq!(names, NAMES);
    assert_eq!(found.markers[3].body.as_deref(), Some("lid"));
    assert_eq!(found.markers[6].body, None);
    assert_eq!(found.unit, Unit::Millimetre);
    assert_eq!(found.rate, Some(50.));
    assert_eq!(found.frame_numbers, (first_frame..).take(FRAMES).collect::<Vec<_>>());
    let times: Vec<f64> = (0..FRAMES).map(|frame| frame as f64 / 50.).collect();
    assert_eq!(found.times.as_ref(), Some(&times));
    for frame in 0..FRAMES {
        for marker in 0..NAMES.len() {
            let point = found.positions[frame * NAMES.len() + marker];
            match millimetres(frame, marker) {
                Some(position) => assert_eq!(point.coords.as_slice(), position.map(|x| x / 1000.), "{frame} {marker}"),
                None => assert!(point.x.is_nan(), "frame {frame}, marker {marker}"),
            }
        }
    }
}

#[test]
fn six_encodings_of_c3d_are_one_recording() {
    for processor in [Processor::Intel, Processor::Dec, Processor::Sgi] {
        for numbers in [Numbers::Integer, Numbers::Real] {
            let found = markers("a.c3d", C3d::of(processor, numbers).bytes());
            assert_eq!(found.format, Format::C3d);
            assert!(found.unit_stated && found.notes.is_empty());
            check(&found, 4);
        }
    }
}

#[test]
fn labels_of_c3d_go_on_in_a_second_parameter_and_without_unit_millimetres_are_assumed() {
    let found = markers("a.c3d", C3d { first_labels: 2, unit: None, analogue: 0, ..C3d::PLAIN }.bytes());
    assert!(!found.unit_stated);
    assert_eq!(found.notes, ["the file states no unit of length; millimetres are assumed"]);
    check(&found, 4);
}

#[test]
fn tables_of_markers_are_recognised_by_their_content() {
    for (name, text, format, first) in [
        ("a.trc", samples::trc(), Format::Trc, 1),
        ("a.tsv", samples::qualisys(), Format::Qualisys, 1),
        ("a.csv", samples::vicon(), Format::Vicon, 1),
        ("b.csv", samples::motive(), Format::Motive, 0),
        ("a.txt", samples::trc(), Format::Trc, 1),
    ] {
        let found = markers(name, text.replace('\n', "\r\n"));
        assert_eq!(found.format, format);
        check(&found, first);
        assert_eq!(found.poses.len(), usize::from(format == Format::Motive));
    }
}

#[cfg(feature = "parquet")]
#[test]
fn tables_in_columns_of_other_programs_are_the_same_recording() {
    use std::fmt::Write;

    let mut text = String::from("frame,time,body,feature,x,y,z\n");
    for frame in 0..3 {
        for (body, feature) in [("box", 1), ("box", 2), ("lid", 1), ("lid", 2)] {
            let y = if (frame, feature) == (1, 2) { String::new() } else { format!("{feature}0") };
            let (number, time) = (frame + 1, f64::from(frame) / 4.);
            let _ = writeln!(text, "{number},{time},{body},{feature},{frame}.5,{y},-0.25");
        }
    }
    let of_text = markers("a.csv", text);
    for (name, bytes) in &samples::in_columns()[1..] {
        // The content tells the format.
        assert_eq!(markers(&name.replace("parquet", "csv"), bytes).format, Format::Parquet);
        let found = Markers { format: Format::Csv, ..markers(name, bytes) };
        let positions = |markers: &Markers| -> Vec<_> {
            markers.positions.iter().flat_map(|point| [point.x, point.y, point.z].map(f64::to_bits)).collect()
        };
        assert_eq!(positions(&found), positions(&of_text), "{name}");
        assert_eq!(Markers { positions: Vec::new(), ..found }, Markers { positions: Vec::new(), ..of_text.clone() });
    }
}

fn names(recording: &Recording) -> Vec<&str> {
    recording.bodies().iter().map(Body::name).collect()
}

fn labels(body: &Body) -> &[String] {
    let Observation::Points { labels, .. } = body.observation() else { panic!("points") };
    labels
}

fn grouped(bodies: &[(&str, &[&str])]) -> Result<(Recording, Vec<String>), String> {
    let body = |(name, patterns): &(&str, &[&str])| BodyPatterns {
        name: (*name).into(),
        patterns: patterns.iter().map(ToString::to_string).collect(),
    };
    let grouping = Grouping::Patterns(bodies.iter().map(body).collect());
    let found = markers("a.csv", samples::motive());
    group(found, &grouping, "a.csv".as_ref()).map_err(|error| error.to_string())
}

#[test]
fn prefixes_make_bodies_and_what_is_left_out_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.csv");
    fs::write(&path, samples::motive()).expect("written");
    let (recording, notes) = read_with_notes(&path, &ReadOptions::default()).expect("sound");
    assert_eq!(names(&recording), ["box", "lid", "Hammer"]);
    assert_eq!(labels(&recording.bodies()[1]), ["a", "b", "c"]);
    assert_eq!(notes, ["marker `nail` is in no body, and left out"]);
    let all = read(&path, &ReadOptions { grouping: Grouping::All, ..ReadOptions::default() }).expect("sound");
    assert_eq!(names(&all), ["box", "lid", "Hammer", "a"]);
}

#[test]
fn markers_that_are_never_seen_are_named() {
    let none =
        Markers { positions: vec![[f64::NAN; 3].into(); FRAMES * NAMES.len()], ..markers("a.trc", samples::trc()) };
    for grouping in [Grouping::Own, Grouping::All] {
        let error = group(none.clone(), &grouping, "a.trc".as_ref()).expect_err("nothing is seen").to_string();
        let needed = "a.trc: needed a sample of at least one marker or body, found none of `box:a`, `box:b`";
        assert!(error.starts_with(needed) && error.ends_with("export the recording with its positions"), "{error}");
    }
    let mut no_lid = markers("a.trc", samples::trc());
    for frame in no_lid.positions.chunks_mut(NAMES.len()) {
        frame[3..6].fill([f64::NAN; 3].into());
    }
    let (recording, notes) = group(no_lid, &Grouping::All, "a.trc".as_ref()).expect("the box and the nail");
    assert_eq!(names(&recording), ["box", "a"]);
    assert_eq!(notes, ["body `lid` is never seen, and left out"]);
}

#[test]
fn patterns_make_bodies_in_their_own_order() {
    let (recording, notes) =
        grouped(&[("tool", &["Hammer"]), ("top", &["lid:c", "lid:[ab]"]), ("rest", &["nail", "box:?"])])
            .expect("sound");
    assert_eq!(names(&recording), ["tool", "top", "rest"]);
    assert!(matches!(recording.bodies()[0].observation(), Observation::Poses(_)));
    assert_eq!(labels(&recording.bodies()[1]), ["lid:c", "lid:a", "lid:b"]);
    assert_eq!(labels(&recording.bodies()[2]), ["nail", "box:a", "box:b", "box:c"]);
    assert_eq!(notes, [""; 0]);
    let (_, notes) = grouped(&[("top", &["lid:*"])]).expect("sound");
    assert_eq!(notes, ["4 markers are in no body, and left out: `box:a`, `box:b`, `box:c`, `nail`"]);
}

#[test]
fn patterns_that_do_not_fit_are_refused_with_what_helps() {
    for (bodies, message) in [
        (
            &[("top", &["lyd:*"][..])][..],
            "a.csv: body `top`, pattern `lyd:*`: no marker has such a name; the nearest names are `lid:",
        ),
        (&[("top", &["lid:***"])], "a.csv: body `top`, pattern `lid:***`: the pattern cannot be understood"),
        (
            &[("top", &["lid:*"]), ("all", &["*:a"])],
            "a.csv: body `all`, pattern `*:a`: marker `lid:a` is in body `top` already",
        ),
        (&[("top", &["Hammer", "nail"])], "a.csv: body `top`, pattern `nail`: both markers and poses have such names"),
        (&[("top", &[])], "a.csv: body `top`, pattern ``: the body has no marker"),
    ] {
        let error = grouped(bodies).expect_err("refused");
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn markers_without_prefixes_need_bodies() {
    let text = samples::vicon().replace("box:", "box").replace("lid:", "lid");
    let found = markers("a.csv", &text);
    let error = group(found.clone(), &Grouping::Own, "a.csv".as_ref()).expect_err("no bodies").to_string();
    assert!(error.starts_with("a.csv: the file has 7 markers, `boxa`, `boxb`, `boxc`"), "{error}");
    let (recording, notes) = group(found, &Grouping::Suggested, "a.csv".as_ref()).expect("two bodies");
    // The nail is in the lid.
    assert_eq!(names(&recording), ["box", "body 1"]);
    assert_eq!(labels(&recording.bodies()[1]), ["lida", "lidb", "lidc", "nail"]);
    assert_eq!(notes, [""; 0]);
}

#[test]
fn one_note_tells_of_suggested_bodies_which_markers_are_in_none() {
    let place = |frame: f64, marker: usize| {
        let (sin, cos) = f64::sin_cos(0.03 * frame);
        let corner = [[0.3, 0.1, 0.2], [0.5, 0.2, 0.9], [0.2, 0.6, 0.4], [0.7, 0.5, 0.1]][marker % 4];
        match marker {
            0..4 => corner,
            4..8 => [corner[0] * cos - corner[1] * sin, corner[0] * sin + corner[1] * cos, corner[2]],
            // On the axis of the hinge; on nothing.
            8 => [0., 0., 0.5],
            _ => [(0.7 * frame).sin(), (0.3 * frame).cos(), 1. + 0.1 * frame],
        }
    };
    let suggested = |names: &[&str]| {
        let markers = Markers {
            format: Format::Trc,
            unit: Unit::Metre,
            unit_stated: true,
            rate: None,
            frame_numbers: (0..40).collect(),
            times: None,
            markers: names
                .iter()
                .map(|name| Marker { name: (*name).into(), label: (*name).into(), body: None })
                .collect(),
            positions: (0..40)
                .flat_map(|frame| (0..names.len()).map(move |marker| place(f64::from(frame), marker).into()))
                .collect(),
            poses: Vec::new(),
            notes: Vec::new(),
        };
        group(markers, &Grouping::Suggested, "a.trc".as_ref()).expect("two bodies").1
    };
    let names = ["w1", "w2", "w3", "w4", "d1", "d2", "d3", "d4", "pin", "fly"];
    assert_eq!(suggested(&names[..8]), [""; 0]);
    assert_eq!(suggested(&names[..9]), ["marker `pin` keeps its distances to more than one body, and is left out"]);
    assert_eq!(
        suggested(&names),
        ["2 markers are in no body, and left out: `pin`, `fly`; keeping their distances to more than one body: `pin`"]
    );
}

#[test]
fn bodies_of_tables_can_be_put_together_anew() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.csv");
    fs::write(&path, samples::csv_of_points()).expect("written");
    let body = BodyPatterns { name: "corner".into(), patterns: vec!["*:a".into()] };
    let options = ReadOptions { grouping: Grouping::Patterns(vec![body]), ..ReadOptions::default() };
    let recording = read(&path, &options).expect("sound");
    assert_eq!(labels(&recording.bodies()[0]), ["box:a", "lid:a"]);
}

#[test]
fn inspecting_tells_gaps_bodies_and_how_rigid_they_are() {
    let found = markers("a.csv", samples::vicon());
    let inspection = inspect(&found, "a.csv".as_ref(), false);
    assert_eq!((inspection.frames, inspection.frame_numbers, inspection.rate), (FRAMES, [1, FRAMES as u64], Some(50.)));
    let lost = (0..FRAMES).filter(|&frame| millimetres(frame, 1).is_none()).count();
    assert!((inspection.markers[1].missing - lost as f64 / FRAMES as f64).abs() < 1e-12);
    let bodies: Vec<(&str, Option<&str>)> =
        inspection.bodies.iter().map(|body| (body.name.as_str(), body.pattern.as_deref())).collect();
    assert_eq!(bodies, [("box", Some("box:*")), ("lid", Some("lid:*"))]);
    assert_eq!(inspection.alone, ["nail"]);
    // Positions are rounded to millimetres.
    assert!(inspection.bodies.iter().all(|body| body.variation.is_some_and(|variation| variation < 0.002)));
}
