use jointscope_motion::{Body, Observation, Tracks};
use proptest::prelude::*;

use super::*;

const HEADER: &str = "frame,time,body,feature,x,y,z\n";

fn read(text: &str) -> Result<Recording, RecordingError> {
    parse(text.as_bytes(), Path::new("a.csv"), Unit::Metre)
}

fn refused(text: &str) -> String {
    read(text).expect_err("refused").to_string()
}

fn refused_row(row: &str) -> String {
    refused(&format!("{HEADER}0,0,door,1,1,2,3\n{row}\n"))
}

fn tracks(body: &Body) -> &Tracks {
    let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
    tracks
}

#[test]
fn separators_marks_quotes_line_ends_and_order_do_not_matter() {
    let plain = read("frame,time,body,feature,x,y,z\n0,0.5,door,a,1,2,3\n7,1,door,a,4,5,6\n").expect("plain");
    for other in [
        "frame;time;body;feature;x;y;z\n0;0.5;door;a;1;2;3\n7;1;door;a;4;5;6\n",
        "frame\ttime\tbody\tfeature\tx\ty\tz\n0\t0.5\tdoor\ta\t1\t2\t3\n7\t1\tdoor\ta\t4\t5\t6",
        "\u{feff}frame,time,body,feature,x,y,z\r\n0,0.5,door,a,1,2,3\r\n\r\n7,1,door,a,4,5,6\r\n",
        "\n\"Frame\", Time ,BODY,feature,x,y,z\n7,1.0,\"door\",a,4,5,6\n0,.5, door ,a,1e0,+2,3.\n  \n",
        "z,y,x,feature,body,time,frame\n3,2,1,a,door,0.5,0.0\n6,5,4,a,door,1,7\n",
        "frame,time,body,feature,x,y,z\n0,,door,a,1,2,3\n0,0.5,door,a2,,,\n7,1,door,a,4,5,6\n",
    ] {
        let other = read(other).expect("the same recording");
        assert_eq!((other.frame_numbers(), other.times()), (plain.frame_numbers(), plain.times()));
        assert_eq!(tracks(&other.bodies()[0]).get(1, 0), tracks(&plain.bodies()[0]).get(1, 0));
    }
    assert_eq!(plain.frame_numbers(), [0, 7]);
    assert_eq!(plain.times(), Some(&[0.5, 1.][..]));
}

#[test]
fn absent_rows_and_empty_or_nan_cells_are_missing_samples() {
    let recording = read("frame,body,feature,x,y,z\n0,d,a,1,2,3\n0,d,b,1,,3\n1,d,a,nan,2,3\n").expect("sound");
    let tracks = tracks(&recording.bodies()[0]);
    let seen = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(frame, feature)| tracks.is_visible(frame, feature));
    assert_eq!(seen, [true, false, false, false]);
}

#[test]
fn the_unit_scales_positions_but_not_rotations() {
    let millimetres = |text: &str| parse(text.as_bytes(), Path::new("a.csv"), Unit::Millimetre).expect("sound");
    let points = millimetres("frame,body,feature,x,y,z\n0,d,a,1000,0,0\n");
    assert_eq!(tracks(&points.bodies()[0]).get(0, 0), Some(&Point3::new(1., 0., 0.)));
    let poses = millimetres("frame,body,x,y,z,qx,qy,qz,qw\n0,d,1000,0,0,0,0,0,1\n1,d,0,0,0,0,0,0,0\n");
    let Observation::Poses(poses) = poses.bodies()[0].observation() else { panic!("poses") };
    assert!(poses[0].expect("seen").translation.x == 1. && poses[1].is_none());
}

#[test]
fn frames_far_apart_are_two_frames() {
    let recording = read("frame,body,feature,x,y,z\n1000000000000000,d,a,1,2,3\n0,d,a,1,2,3\n").expect("two frames");
    assert_eq!(recording.frame_numbers(), [0, 1_000_000_000_000_000]);
}

#[test]
fn an_empty_file_and_a_header_alone_are_refused() {
    for empty in ["", "\n\r\n", "\u{feff}", "  \n"] {
        assert_eq!(refused(empty), "a.csv: the file is empty; needed a header line and rows of samples");
    }
    assert_eq!(refused(HEADER), "a.csv: the table has a header but no rows; needed at least one sample");
}

#[test]
fn a_bad_header_is_refused_with_its_line() {
    assert!(refused("\nframe,tme\n").starts_with("a.csv, line 2: column `tme` is unknown"));
    assert!(refused("# made by hand\n").starts_with("a.csv, line 1: column `# made by hand` is unknown"));
}

#[test]
fn a_row_of_the_wrong_length_is_refused() {
    assert!(refused_row("1,0,door,1,1,2").starts_with("a.csv, line 3: needed 7 cells, one per column of the header"));
    assert!(refused_row("1,0,door,1,1,2,3,4").contains("found 8"));
    assert!(refused_row("1,0,\"door,1,1,2,3\n1,0,door,1,1,2,3").contains("a quote seems to be left open"));
}

#[test]
fn lines_are_counted_over_blank_lines_and_quoted_line_ends() {
    let text = format!("{HEADER}\n\n0,0,\"do\nor\",1,1,2,3\n\r\n\n1,0,door,1,left,2,3\n");
    assert!(
        refused(&text).starts_with("a.csv, line 8: column `x`: needed a number, found `left`"),
        "{}",
        refused(&text)
    );
    let crlf = format!("{HEADER}0,0,door,1,1,2,3\n\n1,0,door,1,left,2,3\n").replace('\n', "\r\n");
    assert!(refused(&crlf).starts_with("a.csv, line 4: column `x`"), "{}", refused(&crlf));
}

#[test]
fn text_and_infinity_in_number_cells_are_refused() {
    assert!(refused_row("1,0,door,1,1,left,3").starts_with("a.csv, line 3: column `y`: needed a number, found `left`"));
    assert!(refused_row("1,0,door,1,1,inf,3").starts_with("a.csv, line 3: column `y`: needed a finite number"));
    assert!(refused_row("1,0,door,1,1,1e999,3").contains("needed a finite number"));
    assert!(refused_row("1,-inf,door,1,1,2,3").starts_with("a.csv, line 3: column `time`: needed a finite number"));
    let european = refused("frame;body;feature;x;y;z\n0;door;1;0,5;0;0\n");
    assert!(european.ends_with("write decimals with a point"), "{european}");
}

#[test]
fn frame_numbers_are_whole_and_not_negative() {
    for bad in ["0.5", "-1", "", "nan", "one", "1e300", "18446744073709551616"] {
        let error = refused_row(&format!("{bad},0,door,1,1,2,3"));
        assert!(error.starts_with("a.csv, line 3: column `frame`: needed a whole number from 0"), "{error}");
    }
    let largest = read(&format!("{HEADER}18446744073709551615,0,door,1,1,2,3\n")).expect("the largest frame number");
    assert_eq!(largest.frame_numbers(), [u64::MAX]);
}

#[test]
fn a_second_row_for_a_sample_is_refused_with_both_lines() {
    let error = refused_row("0,0,door,1,,,");
    assert!(error.starts_with("a.csv, line 3: needed one row per sample, found a second one for frame 0"), "{error}");
    assert!(error.contains("body `door`, feature `1`, after line 2"), "{error}");
    let error = refused("frame,body,x,y,z,qx,qy,qz,qw\n4,d,0,0,0,0,0,0,1\n4,d,0,0,0,0,0,0,1\n");
    assert!(error.contains("frame 4, body `d`, after line 2"), "{error}");
}

#[test]
fn bodies_and_features_need_names() {
    assert!(refused_row("1,0,,1,1,2,3").starts_with("a.csv, line 3: column `body`: needed a name"));
    assert!(refused_row("1,0,door, ,1,2,3").starts_with("a.csv, line 3: column `feature`: needed a name"));
}

#[test]
fn times_agree_within_a_frame_and_all_frames_have_one_or_none_has() {
    let error = refused_row("0,0.25,door,2,1,2,3");
    assert!(error.starts_with("a.csv, line 3: needed one time per frame, found 0.25 for frame 0 after 0 in line 2"));
    let error = refused_row("1,,door,1,1,2,3");
    assert!(error.starts_with("a.csv, line 3: frame 1 has no time in any row"), "{error}");
    let none = read(&format!("{HEADER}0,,door,1,1,2,3\n")).expect("no times");
    assert_eq!(none.times(), None);
}

#[test]
fn a_body_without_any_sample_is_refused_with_the_file() {
    assert!(refused_row("0,0,wall,1,,,").starts_with("a.csv: body `wall` has no sample in any frame"));
}

#[test]
fn a_quaternion_of_another_norm_is_refused_with_its_line() {
    let error = refused("frame,body,x,y,z,qx,qy,qz,qw\n0,d,0,0,0,1,0,0,1\n");
    assert!(error.starts_with("a.csv, line 2: needed a unit quaternion, found (1 0 0 1) of norm 1.414"), "{error}");
}

#[test]
fn text_that_is_not_utf_8_is_refused_with_its_line() {
    let error = parse(b"frame\n\xff\n", Path::new("a.csv"), Unit::Metre).expect_err("not UTF-8").to_string();
    assert!(error.starts_with("a.csv, line 2: needed UTF-8 text"), "{error}");
}

#[test]
fn a_sparse_table_cannot_ask_for_all_memory() {
    let rows: Vec<_> = (0..20_000).map(|row| format!("{row},,door,{row},1,2,3")).collect();
    assert!(refused(&format!("{HEADER}{}\n", rows.join("\n"))).contains("20000 frames of 20000 features"));
}

/// The recording or the message, read in pieces of at least so many bytes.
fn in_pieces_of(size: usize, text: &str) -> Result<Recording, String> {
    in_pieces(size, text.as_bytes(), Path::new("a.csv"), Unit::Metre).map_err(|error| error.to_string())
}

#[test]
fn pieces_change_neither_recordings_nor_errors() {
    let names = ["door", "\"wa\nll\"", "\"a \"\"b\"\"\n\n,;\r\n\"", "shelf"];
    let row = |row: usize| format!("{},{},{},{},{row},2,3\n", row / 8, row / 8, names[row % 4], row % 8 / 4);
    let sound = (0..40).fold(HEADER.to_owned(), |text, number| text + &row(number));
    let expected = in_pieces_of(sound.len(), &sound).expect("sound");
    assert_eq!((expected.frames(), expected.bodies().len()), (5, 4));
    let texts =
        ["7,left,door,1,1,2,3\n", "0,0,door,0,1,2,3\n", "0,1,door,9,1,2,3\n", "9,,door,0,1,2,3\n", "9,9,\"door\n"];
    let damaged = texts.map(|text| sound.clone() + text + &row(100) + "last\n");
    let errors = damaged.each_ref().map(|text| in_pieces_of(text.len(), text).expect_err("damaged"));
    for size in 1..sound.len() {
        assert_eq!(in_pieces_of(size, &sound).as_ref(), Ok(&expected), "{size} bytes");
        for (text, error) in damaged.iter().zip(&errors) {
            assert_eq!(in_pieces_of(size, text).as_ref(), Err(error), "{size} bytes");
        }
    }
}

proptest! {
    #[test]
    fn arbitrary_bytes_give_a_recording_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = parse(&bytes, Path::new("a.csv"), Unit::Metre);
    }

    #[test]
    fn arbitrary_tables_give_a_recording_or_an_error(
        header in prop::sample::select(vec![HEADER, "frame,body,x,y,z,qx,qy,qz,qw\n", "frame;body;feature;x;y;z\r\n"]),
        cells in "([0-9a,;.\"\n\r\t -]|nan|inf|1,1,1,1,1,1\n){0,120}",
    ) {
        let text = format!("{header}{cells}");
        let whole = in_pieces_of(text.len(), &text);
        for size in [1, 7, 50] {
            prop_assert_eq!(&in_pieces_of(size, &text), &whole);
        }
    }
}
