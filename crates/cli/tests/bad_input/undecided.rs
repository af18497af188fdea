//! Recordings that decide nothing.

use crate::place::{Place, RUN, RUN_JSON, USAGE, door, json, notes, shown, table, turning, undecided};

#[test]
fn bodies_of_one_or_two_features_say_that_their_orientation_is_not_observed() {
    for features in [1, 2] {
        let thin =
            table(&["wall", "door"], 12, features, |frame, body, feature| Some(shown(turning(frame, body, feature))));
        let result = undecided(&thin, "disconnected", "the orientation of neither body is observed");
        let notes = notes(&result);
        for body in ["wall", "door"] {
            assert!(notes.contains(&format!("{body}: its orientation is not observed")), "{notes}");
        }
        assert!(notes.contains(&format!("found {features}")) && notes.contains("track three features"), "{notes}");
        assert_eq!(notes.lines().count(), 3, "{notes}");
    }
}

#[test]
fn one_collinear_body_is_seen_from_the_other() {
    let rod = table(&["rod", "wall"], 12, 4, |frame, body, feature| {
        let line = [0.1 * feature as f64, 0.05 * frame as f64, 0.0];
        Some(shown(if body == 0 { line } else { turning(0, body, feature) }))
    });
    let place = Place::with(rod);
    let result = json(&place.done(&RUN_JSON));
    assert_eq!(result["pairs"][0]["joint"], "prismatic");
    let notes = notes(&result);
    assert!(notes.contains("rod: its orientation is not observed") && notes.contains("collinear"), "{notes}");
    assert!(notes.contains("as seen from `wall`"), "{notes}");
}

#[test]
fn one_frame_two_and_three_are_too_few_to_decide() {
    for (frames, joint, note) in [
        (1, "disconnected", "1 frame shows both bodies, at least 6 are needed; record more"),
        (2, "disconnected", "2 frames show both bodies, at least 6 are needed; record more"),
        (3, "prismatic", "3 frames show both bodies, at least 6 are needed; record more"),
    ] {
        let short = table(&["wall", "door"], frames, 4, |frame, body, feature| {
            let [x, y, z] = turning(0, body, feature);
            Some(shown([x + 0.1 * (frame * body) as f64, y, z]))
        });
        let result = undecided(&short, joint, note);
        assert!(!notes(&result).contains("neither body moves"), "one frame shows no rest: {}", notes(&result));
    }
}

#[test]
fn bodies_that_are_never_seen_together_are_named() {
    let apart = table(&["wall", "door"], 12, 4, |frame, body, feature| {
        ((frame < 6) == (body == 0)).then(|| shown(turning(frame, body, feature)))
    });
    undecided(&apart, "disconnected", "`wall` and `door` are never seen in the same frame");
}

#[test]
fn two_bodies_at_rest_are_rigid_but_undetermined() {
    let still = table(&["wall", "door"], 12, 4, |_, body, feature| Some(shown(turning(0, body, feature))));
    undecided(&still, "rigid", "neither body moves: every joint at rest looks rigid; record them moving");
}

#[test]
fn a_body_at_rest_beside_one_that_moves_is_a_reference_like_any_other() {
    let result = json(&Place::with(door()).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some("revolute"), Some(true)));
    assert_eq!(notes(&result), "");
}

#[test]
fn bodies_with_the_same_coordinates_are_rigid() {
    let same = |frame: usize, _, feature| Some(shown(turning(frame, 1, feature)));
    let result = json(&Place::with(table(&["one", "two"], 12, 4, same)).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some("rigid"), Some(true)));
}

#[test]
fn one_body_alone_is_looked_at_from_the_world() {
    let alone = |name: &'static str| table(&[name], 12, 4, |frame, _, feature| Some(shown(turning(frame, 1, feature))));
    let result = json(&Place::with(alone("door")).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["reference"].as_str(), pair["joint"].as_str()), (Some("world"), Some("revolute")));
    let advice = ["`world`", "give the world another name by `world` under [recording]"];
    Place::with(alone("world")).refused(&RUN, USAGE, &advice);
}

/// The door with one sample half a metre off.
fn with_a_wild_sample() -> Place {
    let jump = |frame, body, feature| {
        let [x, y, z] = turning(frame, body, feature);
        [x, y, if (frame, body, feature) == (5, 1, 2) { z + 0.5 } else { z }]
    };
    Place::with(table(&["wall", "door"], 12, 4, |frame, body, feature| Some(shown(jump(frame, body, feature)))))
}

#[test]
fn a_wild_sample_is_left_out_and_decides_nothing() {
    let result = json(&with_a_wild_sample().done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some("revolute"), Some(true)));
    assert!(notes(&result).contains("door: 1 wild sample was left out"), "{}", notes(&result));
}

#[test]
fn a_wild_sample_that_is_not_left_out_is_named_and_leaves_its_pair_undetermined() {
    let place = with_a_wild_sample();
    place.write("c.toml", "[motion]\nrobust = false");
    let result = json(&place.done(&RUN_JSON));
    assert_eq!(result["pairs"][0]["determined"], false);
    assert!(notes(&result).contains("door: feature `2` in frame 5 is 0."), "{}", notes(&result));
}

#[test]
fn millimetres_taken_for_metres_raise_a_note_until_the_unit_is_given() {
    let far = |frame, body, feature| Some(shown(turning(frame, body, feature).map(|x| 1000.0 * x)));
    let place = Place::with(table(&["wall", "door"], 12, 4, far));
    assert!(notes(&json(&place.done(&RUN_JSON))).contains("give its `unit`"));
    place.write("c.toml", "recording.unit = 'mm'");
    assert!(!notes(&json(&place.done(&RUN_JSON))).contains("unit"));
}
