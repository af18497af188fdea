//! Recordings that are refused, and strange ones that are not.

use std::fmt::Write as _;

use crate::place::{DATA, Place, RUN, RUN_JSON, door, door_with, json, notes, shown, table, turning, undecided};

#[test]
fn an_empty_file_is_refused() {
    Place::with("").refused(&RUN, DATA, &["r.csv: the file is empty; needed a header line and rows"]);
    Place::with("\n\n").refused(&RUN, DATA, &["r.csv: the file is empty"]);
}

#[test]
fn a_header_alone_is_refused() {
    let place = Place::with("frame,body,feature,x,y,z\n");
    place.refused(&RUN, DATA, &["r.csv: the table has a header but no rows; needed at least one sample"]);
}

#[test]
fn a_missing_column_is_named() {
    let place = Place::with("frame,body,feature,x,y\n0,wall,0,1,2\n");
    place.refused(
        &RUN,
        DATA,
        &["r.csv, line 1: column `z` is missing, found only frame, body", "add it to the header"],
    );
}

#[test]
fn a_misspelt_column_gets_the_nearest_name() {
    let place = Place::with("fram,body,feature,x,y,z\n0,wall,0,1,2,3\n");
    place.refused(&RUN, DATA, &["r.csv, line 1: column `fram` is unknown", "did you mean `frame`?"]);
}

#[test]
fn text_in_place_of_a_number_is_shown_with_its_line_and_column() {
    let place = Place::with(door_with("left"));
    place.refused(&RUN, DATA, &["r.csv, line 32: column `x`: needed a number, found `left`", "leave missing samples"]);
}

#[test]
fn infinity_is_refused_and_nan_is_a_missing_sample() {
    for infinity in ["inf", "-Infinity", "1e999"] {
        let place = Place::with(door_with(infinity));
        let found = format!("r.csv, line 32: column `x`: needed a finite number, found `{infinity}`");
        place.refused(&RUN, DATA, &[&found, "leave missing samples empty or NaN"]);
    }
    let missing = ["NaN", "nan", ""].map(|cell| Place::with(door_with(cell)).done(&RUN));
    assert!(missing[0].contains("revolute"), "{}", missing[0]);
    assert!(missing.iter().all(|table| *table == missing[0]));
}

#[test]
fn a_row_that_occurs_twice_is_refused_with_both_lines() {
    let text = door();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(7, lines[5]);
    let place = Place::with(lines.join("\n"));
    place.refused(
        &RUN,
        DATA,
        &["r.csv, line 8: needed one row per sample", "body `door`", "after line 6", "remove one"],
    );
}

#[test]
fn a_million_rows_without_a_sample_are_refused() {
    let mut text = "frame,body,feature,x,y,z\n".to_owned();
    for frame in 0..1_000_000 {
        writeln!(text, "{frame},wall,0,,,").expect("a text grows");
    }
    Place::with(text).refused(&RUN, DATA, &["r.csv: body `wall` has no sample in any frame", "check its columns"]);
}

#[test]
fn a_frame_number_of_ten_to_the_fifteen_costs_no_memory() {
    let one = "frame,body,feature,x,y,z\n1000000000000000,wall,0,1,2,3\n";
    let result = undecided(one, "disconnected", "1 frame shows both bodies, at least 6 are needed; record more");
    assert_eq!(result["recording"]["frames"], 1);
    let place = Place::with("frame,body,feature,x,y,z\n99999999999999999999,wall,0,1,2,3\n");
    place.refused(&RUN, DATA, &["r.csv, line 2: column `frame`: needed a whole number from 0"]);
}

#[test]
fn a_recording_that_is_not_utf_8_is_refused_with_the_line() {
    let mut bytes = door().into_bytes();
    let at = bytes.iter().position(|byte| *byte == b'w').expect("wall");
    bytes[at] = 0xfc;
    Place::with(bytes).refused(
        &RUN,
        DATA,
        &["r.csv, line 2: needed UTF-8 text, but byte 27", "save the file as UTF-8"],
    );
}

#[test]
fn coordinates_beyond_measure_are_refused_with_body_feature_and_frame() {
    let huge = |frame, body, feature| Some(shown(turning(frame, body, feature).map(|x| x * 1e70)));
    let place = Place::with(table(&["wall", "door"], 12, 4, huge));
    place.refused(&RUN, DATA, &["r.csv: body `wall`, feature `0`, frame 0", "check the unit"]);
}

#[test]
fn coordinates_of_any_other_size_give_a_result_without_nan() {
    for scale in [1e59, 1e30, 1e-150, 1e-300] {
        let scaled = |frame, body, feature| Some(shown(turning(frame, body, feature).map(|x| x * scale)));
        let place = Place::with(table(&["wall", "door"], 12, 4, scaled));
        let result = json(&place.done(&RUN_JSON));
        let confidence = result["pairs"][0]["confidence"].as_f64().expect("a number");
        assert!((0.0..=1.0).contains(&confidence), "{scale}: {confidence}");
        let table = place.done(&RUN);
        assert!(!table.contains("NaN") && table.lines().all(|line| line.chars().count() < 200), "{table}");
    }
}

#[test]
fn bodies_that_are_all_at_the_origin_never_move_and_have_no_orientation() {
    let zero = table(&["wall", "door"], 12, 4, |_, _, _| Some(shown([0.0; 3])));
    let result = undecided(&zero, "rigid", "neither body moves");
    assert!(notes(&result).contains("wall: its orientation is not observed"));
}

#[test]
fn control_characters_in_names_disturb_neither_table_nor_json_nor_messages() {
    let names = ["two words", "\"a\nb\"", "es\u{1b}[31mcape", "Kühlschrank 冷蔵庫", "\u{202e}back"];
    let strange = table(&names, 12, 4, |frame, body, feature| Some(shown(turning(frame, body, feature))));
    let place = Place::with(strange);
    let table = place.done(&RUN);
    assert!(table.contains("a\\nb") && table.contains("es\\u{1b}[31mcape") && table.contains("冷蔵庫"), "{table}");
    let unsafe_characters: Vec<char> = table.chars().filter(|c| c.is_control() && *c != '\n').collect();
    assert!(unsafe_characters.is_empty() && !table.contains('\u{202e}'), "{table}");
    let pairs = names.len() * (names.len() - 1) / 2;
    assert_eq!(table.lines().skip(3).take_while(|line| !line.is_empty()).count(), pairs, "{table}");
    let result = json(&place.done(&RUN_JSON));
    assert_eq!(result["recording"]["bodies"][1], "a\nb");
    assert_eq!(result["recording"]["bodies"][2], "es\u{1b}[31mcape");

    let place = Place::with("frame,body,feature,x,y,z\n0,\"es\u{1b}[31mcape\",0,,,\n");
    let outcome = place.run(&RUN);
    assert_eq!(outcome.code, Some(DATA));
    assert!(outcome.stderr.contains("body `es\\u{1b}[31mcape` has no sample"), "{}", outcome.stderr);
}

#[test]
fn fifty_bodies_give_a_row_per_pair_and_every_note_once() {
    let names: Vec<String> = (0..50).map(|body| format!("body {body}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let many = table(&names, 4, 1, |frame, body, feature| Some(shown(turning(frame, body, feature))));
    let table = Place::with(many).done(&RUN);
    assert_eq!(table.lines().filter(|line| line.contains("disconnected ?")).count(), 50 * 49 / 2);
    assert_eq!(table.matches("its orientation is not observed").count(), 50);
    assert_eq!(table.matches("the orientation of neither body is observed").count(), 1);
    assert!(table.contains("and 1221 other pairs"), "{table}");
}

#[test]
fn the_table_shows_no_negative_zero() {
    let table = Place::with(door()).done(&RUN);
    assert!(table.contains("0.0 .. 63.0 deg") && !table.contains("-0.0"), "{table}");
}
