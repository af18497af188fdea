use std::io::Write;

use jointscope_motion::Observation;
use proptest::prelude::*;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;

/// An array of an archive: name, dtype, shape, elements.
type Entry<'a> = (&'a str, &'a str, &'a str, &'a [u8]);

fn archive(entries: &[Entry<'_>]) -> Vec<u8> {
    packed(entries, CompressionMethod::Deflated)
}

fn stored(entries: &[Entry<'_>]) -> Vec<u8> {
    packed(entries, CompressionMethod::Stored)
}

fn packed(entries: &[Entry<'_>], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, dtype, shape, data) in entries {
        let header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n");
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default().compression_method(method)).expect("begun");
        zip.write_all(&array(&header, data)).expect("written");
    }
    zip.finish().expect("finished").into_inner()
}

fn array(header: &str, data: &[u8]) -> Vec<u8> {
    let length = u16::try_from(header.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

/// The message with which an archive is refused.
fn refuse(bytes: &[u8]) -> String {
    parse(bytes, Path::new("a.npz"), Unit::Metre).expect_err("refused").to_string()
}

/// Where the directory at the end of an archive begins.
fn directory(archive: &[u8]) -> usize {
    archive.windows(4).position(|bytes| bytes == b"PK\x01\x02").expect("a directory")
}

fn read(entries: &[Entry<'_>]) -> Result<Recording, RecordingError> {
    parse(&archive(entries), Path::new("clips/fridge.npz"), Unit::Metre)
}

fn refused(entries: &[Entry<'_>]) -> String {
    read(entries).expect_err("refused").to_string()
}

fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Two frames of two features.
fn points() -> Vec<u8> {
    bytes(&[0., 1., 2., 3., 4., 5., 6., 7., 8., f64::NAN, 10., 11.])
}

fn labels(body: &Body) -> &[String] {
    let Observation::Points { labels, .. } = body.observation() else { panic!("points") };
    labels
}

fn tracks(body: &Body) -> &Tracks {
    let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
    tracks
}

#[test]
fn points_alone_are_one_body_named_after_the_file() {
    for name in ["points", "tracks_XYZ"] {
        let recording = read(&[(name, "<f8", "(2, 2, 3)", &points())]).expect("sound");
        let [body] = recording.bodies() else { panic!("one body") };
        assert_eq!((body.name(), labels(body)), ("fridge", &["0".to_owned(), "1".into()][..]));
        assert_eq!(tracks(body).get(1, 0), Some(&Point3::new(6., 7., 8.)));
        assert_eq!(tracks(body).get(1, 1), None);
        assert_eq!((recording.frame_numbers(), recording.times()), (&[0, 1][..], None));
    }
}

#[test]
fn visibility_bodies_names_and_times_are_taken_from_their_arrays() {
    let recording = read(&[
        ("points", "<f8", "(2, 2, 3)", &points()),
        ("visibility", "|b1", "(2, 2)", &[1, 1, 0, 1]),
        ("body_ids", "|u1", "(2,)", &[1, 0]),
        ("body_names", "|S4", "(2,)", b"walldoor"),
        ("times", "<f8", "(2,)", &bytes(&[0.5, 0.75])),
        ("intrinsics", "|O", "()", b"pickled, but not looked at"),
    ])
    .expect("sound");
    let [wall, door] = recording.bodies() else { panic!("two bodies") };
    assert_eq!(
        (wall.name(), labels(wall), door.name(), labels(door)),
        ("wall", &["1".into()][..], "door", &["0".into()][..])
    );
    assert_eq!((tracks(door).get(0, 0), tracks(door).get(1, 0)), (Some(&Point3::new(0., 1., 2.)), None));
    assert_eq!(recording.times(), Some(&[0.5, 0.75][..]));
}

#[test]
fn bodies_without_names_are_named_by_their_ids() {
    let points = ("points", "<f8", "(1, 3, 3)", &bytes(&[0.; 9])[..]);
    let recording = read(&[points, ("body_ids", "|i1", "(3,)", &[7, 255, 7])]).expect("sound");
    let bodies: Vec<_> = recording.bodies().iter().map(|body| (body.name(), labels(body).join(" "))).collect();
    assert_eq!(bodies, [("7", "0 2".into()), ("-1", "1".into())]);
}

#[test]
fn the_unit_scales_positions() {
    let archive = archive(&[("points", "<f8", "(1, 1, 3)", &bytes(&[1000., 0., 0.]))]);
    let recording = parse(&archive, Path::new("a.npz"), Unit::Millimetre).expect("sound");
    assert_eq!(tracks(&recording.bodies()[0]).get(0, 0), Some(&Point3::new(1., 0., 0.)));
}

#[test]
fn what_is_no_archive_or_has_no_points_is_refused() {
    let error = parse(b"\x93NUMPY", Path::new("a.npz"), Unit::Metre).expect_err("an array alone").to_string();
    assert!(error.starts_with("a.npz: needed an archive of numpy's arrays, found none"), "{error}");
    let error = refused(&[("xyz", "<f8", "(1, 1, 3)", &bytes(&[0.; 3]))]);
    assert_eq!(
        error,
        "clips/fridge.npz: needed array `points` (frames, features, 3), found `xyz`; rename the array of positions"
    );
    assert!(refused(&[]).contains("found no array"));
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let error = refused(&[("points", "<f8", "(2, 6)", &points())]);
    assert!(error.contains("array `points`: needed shape (frames, features, 3), found [2, 6]"), "{error}");
    assert!(refused(&[("points", "<f8", "(0, 2, 3)", &[])]).contains("found 0 frames of 2"));
    let points = points();
    let with = |entry: Entry<'_>| refused(&[("points", "<f8", "(2, 2, 3)", &points), entry]);
    assert!(
        with(("visibility", "|b1", "(2, 1)", &[1; 2])).contains("needed shape [2, 2] to fit the points, found [2, 1]")
    );
    assert!(with(("body_ids", "|u1", "(3,)", &[0; 3])).contains("array `body_ids`: needed shape [2]"));
    assert!(with(("times", "<f8", "()", &bytes(&[0.]))).contains("array `times`: needed shape [2]"));
    assert!(with(("body_names", "|S1", "()", b"a")).contains("array `body_names`: needed shape (bodies), found []"));
}

#[test]
fn types_that_do_not_fit_are_refused() {
    assert!(refused(&[("points", "|O", "(1, 1, 3)", b"pickle")]).contains("objects and records are not read"));
    assert!(
        refused(&[("points", "<i8", "(1, 1, 3)", &[0; 24])]).contains("needed float64 or float32, found dtype `i8`")
    );
    let points = points();
    let with = |entry: Entry<'_>| refused(&[("points", "<f8", "(2, 2, 3)", &points), entry]);
    assert!(with(("visibility", "<f4", "(2, 2)", &[0; 16])).contains("array `visibility`: needed bool or uint8"));
    assert!(with(("body_ids", "<f4", "(2,)", &[0; 8])).contains("array `body_ids`: needed integers"));
}

#[test]
fn ids_and_names_that_disagree_are_refused() {
    let points = points();
    let with = |ids: &[u8], names: &[u8]| {
        let (ids_shape, names_shape) = (format!("({},)", ids.len()), format!("({},)", names.len()));
        let (ids, names) = (("body_ids", "|i1", &ids_shape[..], ids), ("body_names", "|S1", &names_shape[..], names));
        refused(&[("points", "<f8", "(2, 2, 3)", &points), ids, names])
    };
    assert!(with(&[0, 2], b"ab").contains("feature 1 has body 2, but `body_names` names bodies 0 to 2 - 1"));
    assert!(with(&[0, 255], b"ab").contains("feature 1 has body -1"));
    assert!(with(&[0, 0], b"ab").contains("body `b` of `body_names` has no feature"));
    assert!(with(&[0, 1], b"aa").contains("two bodies are named `a`"));
    let error = refused(&[("points", "<f8", "(2, 2, 3)", &points), ("body_names", "|S1", "(2,)", b"ab")]);
    assert!(error.contains("2 names, but array `body_ids` is missing"), "{error}");
}

#[test]
fn a_misspelled_array_is_refused_with_the_nearest_name() {
    let error = refused(&[("points", "<f8", "(2, 2, 3)", &points()), ("visiblity", "|b1", "(2, 2)", &[0; 4])]);
    assert!(error.contains("array `visiblity` is unknown, did you mean `visibility`?"), "{error}");
}

#[test]
fn infinity_and_bodies_without_samples_are_refused_with_the_file() {
    let infinite = bytes(&[0., f64::INFINITY, 0.]);
    let error = refused(&[("points", "<f8", "(1, 1, 3)", &infinite)]);
    assert!(error.starts_with("clips/fridge.npz: body `fridge`, feature `0`, frame 0: a coordinate is infinite"));
    let unseen = [("points", "<f8", "(1, 1, 3)", &infinite[..]), ("visibility", "|b1", "(1, 1)", &[0])];
    assert!(refused(&unseen).contains("has no sample in any frame"));
    let points = points();
    let times = bytes(&[0., f64::NAN]);
    let error = refused(&[("points", "<f8", "(2, 2, 3)", &points), ("times", "<f8", "(2,)", &times)]);
    assert!(error.contains("the times of a recording must be one finite number per frame"), "{error}");
}

#[test]
fn shapes_are_checked_before_memory_is_asked_for() {
    for shape in ["(4000000000, 4000000000, 3)", "(1000000000, 1, 3)"] {
        assert!(refused(&[("points", "<f8", shape, &[0; 24])]).contains("is too large for this file"));
    }
    assert!(refused(&[("points", "<f8", "(2, 1, 3)", &[0; 24])]).contains("needs 48 bytes, found 24"));
    assert!(refused(&[("points", "<f8", "(1, 1, 3)", &[0; 48])]).contains("needs 24 bytes, found more"));
}

#[test]
fn damaged_and_encrypted_archives_are_refused() {
    let sound = stored(&[("points", "<f8", "(1, 1, 3)", &[0; 24])]);
    assert!(parse(&sound, Path::new("a.npz"), Unit::Metre).is_ok());
    let directory = directory(&sound);
    let mut damaged = sound.clone();
    damaged[directory - 1] ^= 1;
    assert!(refuse(&damaged).contains("array `points`: cannot be unpacked (its checksum is"), "{}", refuse(&damaged));
    let mut encrypted = sound.clone();
    // The flags of the entry, in its own header and in the directory.
    encrypted[6] |= 1;
    encrypted[directory + 8] |= 1;
    assert!(refuse(&encrypted).contains("Password required"), "{}", refuse(&encrypted));
    for length in 0..sound.len() {
        refuse(&sound[..length]);
    }
}

#[test]
fn stored_and_deflated_arrays_give_the_same_recording() {
    let value = |at: usize| at as f64 / 8.;
    let wide: Vec<f64> = (0..12).map(value).collect();
    let turned: Vec<f64> = (0..12).map(|at| value([0, 6, 3, 9, 1, 7, 4, 10, 2, 8, 5, 11][at])).collect();
    let big: Vec<u8> = wide.iter().flat_map(|value| value.to_be_bytes()).collect();
    #[expect(clippy::cast_possible_truncation, reason = "eighths are exact")]
    let narrow: Vec<u8> = wide.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    let expected = read(&[("points", "<f8", "(2, 2, 3)", &bytes(&wide))]).expect("sound");
    for (dtype, order, data) in [
        ("<f8", "False", bytes(&wide)),
        ("<f8", "True", bytes(&turned)),
        (">f8", "False", big),
        ("<f4", "False", narrow),
    ] {
        // Headers of every length, so that elements begin at any byte.
        for blanks in 0..8 {
            for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
                let blanks = " ".repeat(blanks);
                let header =
                    format!("{{'descr': '{dtype}', 'fortran_order': {order}, 'shape': (2, 2, 3), {blanks}}}\n");
                let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
                let options = SimpleFileOptions::default().compression_method(method);
                zip.start_file("points.npy", options).expect("begun");
                zip.write_all(&array(&header, &data)).expect("written");
                let archive = zip.finish().expect("finished").into_inner();
                let found = parse(&archive, Path::new("fridge.npz"), Unit::Metre).expect("sound");
                assert_eq!(found, expected, "{dtype}, Fortran order {order}, {method}");
            }
        }
    }
}

#[test]
fn stored_arrays_that_claim_other_sizes_are_refused() {
    let entry = |shape| stored(&[("points", "<f8", shape, &[0; 24])]);
    assert!(refuse(&entry("(4000000000, 4000000000, 3)")).contains("is too large for this file"));
    assert!(refuse(&entry("(1000000000, 1, 3)")).contains("is too large for this file"));
    assert!(refuse(&entry("(2, 1, 3)")).contains("needs 48 bytes, found 24"));
    assert!(refuse(&entry("(0, 1, 3)")).contains("needs 0 bytes, found more"));

    // The sizes in the directory: packed, and unpacked.
    let sound = entry("(1, 1, 3)");
    let directory = directory(&sound);
    for (both, message) in [(true, "its bytes would lie outside of the archive"), (false, "cannot be unpacked")] {
        let mut longer = sound.clone();
        longer[directory + 24..directory + 28].copy_from_slice(&100_000_u32.to_le_bytes());
        if both {
            longer[directory + 20..directory + 24].copy_from_slice(&100_000_u32.to_le_bytes());
        }
        assert!(refuse(&longer).contains(message), "{}", refuse(&longer));
    }
}

#[test]
fn stored_arrays_that_lie_over_each_other_are_read_as_they_stand_or_refused() {
    let points = points();
    let sound = stored(&[("points", "<f8", "(2, 2, 3)", &points), ("times", "<f8", "(2,)", &bytes(&[0.5, 0.75]))]);
    let times = sound.windows(9).rposition(|name| name == b"times.npy").expect("an entry") - 46;
    // Where the directory says that the header of `times` is: everywhere in the archive.
    for offset in 0..u32::try_from(sound.len()).expect("short") {
        let mut moved = sound.clone();
        moved[times + 42..times + 46].copy_from_slice(&offset.to_le_bytes());
        match parse(&moved, Path::new("a.npz"), Unit::Metre) {
            Ok(recording) => assert_eq!(recording.times(), Some(&[0.5, 0.75][..]), "at {offset}"),
            Err(error) => assert!(error.to_string().starts_with("a.npz: "), "{error}"),
        }
    }
}

proptest! {
    #[test]
    fn arbitrary_bytes_give_a_recording_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = parse(&bytes, Path::new("a.npz"), Unit::Metre);
    }

    #[test]
    fn a_changed_byte_gives_a_recording_or_an_error(
        place in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        pack in prop::sample::select(vec![archive, stored]),
    ) {
        let mut archive = pack(&[
            ("points", "<f8", "(2, 2, 3)", &points()),
            ("body_ids", "|u1", "(2,)", &[1, 0]),
            ("body_names", "<U1", "(2,)", &[97, 0, 0, 0, 98, 0, 0, 0]),
        ]);
        let place = place.index(archive.len());
        archive[place] = byte;
        let _ = parse(&archive, Path::new("a.npz"), Unit::Metre);
    }

    #[test]
    fn arbitrary_headers_give_a_recording_or_an_error(
        dtype in "[<>|=]?[fiubUSO][0-9]{1,3}",
        shape in r"\(([0-9]{1,20}, ?){0,4}\)",
        data in prop::collection::vec(any::<u8>(), 0..100),
    ) {
        let _ = read(&[("points", &dtype, &shape, &data)]);
        let points = points();
        for name in ["visibility", "body_ids", "body_names", "times"] {
            let _ = read(&[("points", "<f8", "(2, 2, 3)", &points), (name, &dtype, &shape, &data)]);
        }
    }
}
