//! Recordings that are written and read again are the same recordings.

use std::collections::BTreeSet;
use std::io::{Cursor, Read};
use std::path::Path;

use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};
use jointscope_recordings::{RecordingError, Unit, csv_table, npz, write_csv, write_npz};
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};
use proptest::prelude::*;

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![-10. ..10., Just(-0.), Just(5e-324), Just(1e59), Just(0.1 + 0.2)]
}

/// A sample that is missing now and then.
fn sample() -> impl Strategy<Value = Point3<f64>> {
    prop_oneof![
        3 => [coordinate(), coordinate(), coordinate()].prop_map(Point3::from),
        1 => Just(Point3::from([f64::NAN; 3])),
    ]
}

fn pose() -> impl Strategy<Value = Option<Pose>> {
    let quaternion = [-1. ..1., -1. ..1., -1. ..1., 0.1..1.];
    prop::option::weighted(0.8, ([coordinate(), coordinate(), coordinate()], quaternion)).prop_map(|sample| {
        sample.map(|(t, [x, y, z, w])| {
            let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            Pose::from_parts(Translation3::from(t), rotation)
        })
    })
}

/// Names with everything a table must quote.
fn names(count: usize) -> impl Strategy<Value = Vec<String>> {
    prop::collection::btree_set("[a-zé\"',;:#*\t\n 0-9]{0,5}[a-z雲\"#0-9]", count)
        .prop_map(|names: BTreeSet<String>| {
            names.into_iter().map(|name| name.trim().to_owned()).collect::<BTreeSet<_>>()
        })
        .prop_filter("names must differ", move |names| names.len() == count)
        .prop_map(|names| names.into_iter().rev().collect())
}

/// Frame numbers with gaps, and times or none.
fn frames() -> impl Strategy<Value = (Vec<u64>, Option<Vec<f64>>)> {
    let number = prop_oneof![0..20_u64, any::<u64>()];
    prop::collection::btree_set(number, 1..6).prop_flat_map(|numbers| {
        let count = numbers.len();
        (Just(numbers.into_iter().collect()), prop::option::of(prop::collection::vec(coordinate(), count)))
    })
}

fn points() -> impl Strategy<Value = Recording> {
    let body = |frames: usize| {
        (1..4_usize)
            .prop_flat_map(move |features| (names(features), prop::collection::vec(sample(), frames * features)))
    };
    (frames(), 1..4_usize)
        .prop_flat_map(move |((numbers, times), count)| {
            let frames = numbers.len();
            (Just((numbers, times)), names(count), prop::collection::vec(body(frames), count))
        })
        .prop_filter_map("every body needs a sample", |((numbers, times), names, bodies)| {
            let bodies = names.into_iter().zip(bodies).map(|(name, (labels, samples))| {
                Body::from_points(name, labels.clone(), Tracks::new(labels.len(), samples)?)
            });
            Recording::new(numbers, times, bodies.collect::<Result<_, _>>().ok()?).ok()
        })
}

fn poses() -> impl Strategy<Value = Recording> {
    (frames(), 1..4_usize)
        .prop_flat_map(|((numbers, times), count)| {
            let body = prop::collection::vec(pose(), numbers.len());
            (Just((numbers, times)), names(count), prop::collection::vec(body, count))
        })
        .prop_filter_map("every body needs a sample", |((numbers, times), names, bodies)| {
            let bodies = names.into_iter().zip(bodies).map(|(name, poses)| Body::from_poses(name, poses));
            Recording::new(numbers, times, bodies.collect::<Result<_, _>>().ok()?).ok()
        })
}

fn csv_again(recording: &Recording) -> Recording {
    let mut bytes = Vec::new();
    write_csv(recording, &mut bytes).expect("written");
    csv_table::parse(&bytes, Path::new("written.csv"), Unit::Metre).expect("what was written can be read")
}

#[cfg(feature = "parquet")]
fn parquet_again(recording: &Recording) -> Recording {
    let mut bytes = Vec::new();
    jointscope_recordings::write_parquet(recording, &mut bytes).expect("written");
    jointscope_recordings::parquet_table::parse(&bytes, Path::new("written.parquet"), Unit::Metre).expect("readable")
}

fn npz_bytes(recording: &Recording) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write_npz(recording, &mut file).expect("written");
    file.into_inner()
}

/// What NPZ keeps of a recording: frames are numbered from 0, features labelled by their column.
fn without_numbers_and_labels(recording: Recording) -> Recording {
    let (numbers, times, bodies) = recording.into_parts();
    let mut columns = 0..;
    let bodies = bodies.iter().map(|body| {
        let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
        let labels = columns.by_ref().take(tracks.features()).map(|column: usize| column.to_string()).collect();
        Body::from_points(body.name(), labels, tracks_again(tracks))
    });
    let bodies = bodies.collect::<Result<_, _>>().expect("sound bodies");
    Recording::new((0..numbers.len() as u64).collect(), times, bodies).expect("sound recording")
}

fn tracks_again(tracks: &Tracks) -> Tracks {
    let cells = (0..tracks.frames()).flat_map(|frame| (0..tracks.features()).map(move |feature| (frame, feature)));
    let missing = Point3::from([f64::NAN; 3]);
    let samples = cells.map(|(frame, feature)| tracks.get(frame, feature).copied().unwrap_or(missing));
    Tracks::new(tracks.features(), samples.collect()).expect("full frames")
}

proptest! {
    #[test]
    fn tables_of_points_come_back_exactly(recording in points()) {
        prop_assert_eq!(csv_again(&recording), recording);
    }

    #[test]
    fn tables_of_poses_come_back_exactly(recording in poses()) {
        prop_assert_eq!(csv_again(&recording), recording);
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn tables_in_columns_come_back_exactly(recording in prop_oneof![points(), poses()]) {
        prop_assert_eq!(parquet_again(&recording), recording);
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn tables_as_text_are_the_same_after_they_were_columns(recording in prop_oneof![points(), poses()]) {
        let text = |recording: &Recording| {
            let mut bytes = Vec::new();
            write_csv(recording, &mut bytes).map(|()| bytes)
        };
        let through_columns = parquet_again(&csv_again(&recording));
        prop_assert_eq!(text(&through_columns).expect("written"), text(&recording).expect("written"));
    }

    #[test]
    fn archives_come_back_exactly_but_for_numbers_and_labels(recording in points()) {
        let again = npz::parse(&npz_bytes(&recording), Path::new("written.npz"), Unit::Metre).expect("readable");
        prop_assert_eq!(again, without_numbers_and_labels(recording));
    }
}

fn two_points() -> Recording {
    let tracks = Tracks::new(2, vec![Point3::new(1., 2., 3.), Point3::from([f64::NAN; 3])]).expect("one frame");
    let body = Body::from_points("door", vec!["a".into(), "b".into()], tracks).expect("sound body");
    Recording::new(vec![7], Some(vec![0.25]), vec![body]).expect("sound recording")
}

fn one_pose() -> Body {
    Body::from_poses("tag", vec![Some(Pose::identity())]).expect("sound body")
}

#[test]
fn tables_are_plain() {
    let mut bytes = Vec::new();
    write_csv(&two_points(), &mut bytes).expect("written");
    assert_eq!(
        String::from_utf8(bytes).expect("text"),
        "frame,time,body,feature,x,y,z\n7,0.25,door,a,1,2,3\n7,0.25,door,b,,,\n"
    );
    let mut bytes = Vec::new();
    write_csv(&Recording::new(vec![0], None, vec![one_pose()]).expect("sound"), &mut bytes).expect("written");
    assert_eq!(String::from_utf8(bytes).expect("text"), "frame,body,x,y,z,qx,qy,qz,qw\n0,tag,0,0,0,0,0,0,1\n");
}

#[test]
fn archives_are_those_of_numpy() {
    let bytes = npz_bytes(&two_points());
    assert_eq!(bytes, npz_bytes(&two_points()), "the same recording gives the same bytes");
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let mut array = |name: &str| {
        let mut bytes = Vec::new();
        zip.by_name(name).expect("an array").read_to_end(&mut bytes).expect("unpacked");
        bytes
    };
    let points = array("points.npy");
    let points = npyz::NpyFile::new(&points[..]).expect("a header");
    assert_eq!(points.shape(), [1, 2, 3]);
    let points: Vec<f64> = points.into_vec().expect("float64");
    assert!(points[..3] == [1., 2., 3.] && points[3..].iter().all(|value| value.is_nan()));
    let visibility: Vec<bool> =
        npyz::NpyFile::new(&array("visibility.npy")[..]).expect("a header").into_vec().expect("bool");
    assert_eq!(visibility, [true, false]);
    let ids: Vec<i64> = npyz::NpyFile::new(&array("body_ids.npy")[..]).expect("a header").into_vec().expect("int64");
    assert_eq!(ids, [0, 0]);
    let names: Vec<String> =
        npyz::NpyFile::new(&array("body_names.npy")[..]).expect("a header").into_vec().expect("str");
    assert_eq!(names, ["door"]);
    let times: Vec<f64> = npyz::NpyFile::new(&array("times.npy")[..]).expect("a header").into_vec().expect("float64");
    assert!(times == [0.25]);
}

#[cfg(feature = "parquet")]
#[test]
fn columns_hold_many_groups_of_rows_and_what_cannot_be_written_is_refused() {
    let (frames, features) = (1000, 300);
    let samples = (0..frames * features).map(|index| Point3::from([index as f64; 3]));
    let labels = (0..features).map(|feature| format!("f{feature}")).collect();
    let tracks = Tracks::new(features, samples.collect()).expect("full frames");
    let body = Body::from_points("wall", labels, tracks).expect("sound body");
    let large = Recording::new((0..frames as u64).collect(), None, vec![body]).expect("sound");
    assert_eq!(parquet_again(&large), large);

    let mixed = Recording::new(vec![7], None, vec![two_points().bodies()[0].clone(), one_pose()]).expect("sound");
    let mut bytes = Vec::new();
    let error = jointscope_recordings::write_parquet(&mixed, &mut bytes).expect_err("mixed").to_string();
    assert!(error.ends_with("write them to two files") && bytes.is_empty(), "{error}");
    let mut full = Cursor::new([0; 4]);
    let error = jointscope_recordings::write_parquet(&two_points(), &mut full).expect_err("no space").to_string();
    assert!(error.starts_with("the recording cannot be written: "), "{error}");
}

#[test]
fn what_a_format_cannot_hold_is_refused_before_anything_is_written() {
    let refused = |bodies: Vec<Body>| {
        let recording = Recording::new(vec![7], None, bodies).expect("sound recording");
        let (mut csv, mut npz) = (Vec::new(), Cursor::new(Vec::new()));
        let refused = |result: Result<(), RecordingError>| result.expect_err("refused").to_string();
        let errors = [refused(write_csv(&recording, &mut csv)), refused(write_npz(&recording, &mut npz))];
        assert!(csv.is_empty() && npz.into_inner().is_empty());
        errors
    };
    let points = two_points().bodies()[0].clone();
    let named = |name: &str, labels: [&str; 2]| {
        let Observation::Points { tracks, .. } = points.observation() else { panic!("points") };
        Body::from_points(name, labels.map(String::from).to_vec(), tracks.clone()).expect("sound body")
    };
    for error in refused(vec![points.clone(), one_pose()]) {
        assert!(error.ends_with("found `door` as points and `tag` as poses; write them to two files"), "{error}");
    }
    for error in refused(vec![Body::at_rest("world", 1), points.clone()]) {
        assert!(error.ends_with("body `world` is at rest and has no samples; leave it out"), "{error}");
    }
    for name in ["", " door", "door\t", "do\0or"] {
        for error in refused(vec![named(name, ["a", "b"])]) {
            assert!(error.contains("needed a body name without blanks around it"), "{error}");
        }
    }
    let mut csv = Vec::new();
    for (labels, part) in [(["a", "a"], "two features labelled `a`"), (["a", ""], "needed a feature name")] {
        let recording = Recording::new(vec![7], None, vec![named("door", labels)]).expect("sound recording");
        let error = write_csv(&recording, &mut csv).expect_err("labels").to_string();
        assert!(error.contains(part) && csv.is_empty(), "{error}");
    }
    let poses = Recording::new(vec![7], None, vec![one_pose()]).expect("sound recording");
    let error = write_npz(&poses, Cursor::new(Vec::new())).expect_err("poses").to_string();
    assert!(error.ends_with("found poses of body `tag`; write poses as csv or parquet"), "{error}");
}

#[test]
fn a_writer_that_fails_is_reported() {
    let mut full = Cursor::new([0; 4]);
    let error = write_csv(&two_points(), &mut full).expect_err("no space").to_string();
    assert!(error.starts_with("the recording cannot be written: "), "{error}");
}
