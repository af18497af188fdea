use super::*;
use crate::instructions::Instructions;

/// Angle, radians, and distance, as a share of the size and the offset, within which two solves agree.
const SAME: f64 = 1e-9;
const FRAMES: usize = 43;

/// Numbers from -0.5 to 0.5 that look random.
fn chance(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

struct Case {
    name: &'static str,
    features: usize,
    size: [f64; 3],
    noise: f64,
    offset: f64,
    half_turns: bool,
}

const PLAIN: Case = Case { name: "box", features: 21, size: [0.3; 3], noise: 1e-3, offset: 2.0, half_turns: false };

const CASES: [Case; 14] = [
    PLAIN,
    Case { name: "exact", noise: 0.0, ..PLAIN },
    Case { name: "three", features: 3, ..PLAIN },
    Case { name: "two", features: 2, ..PLAIN },
    Case { name: "one register", features: 8, ..PLAIN },
    Case { name: "many", features: 200, ..PLAIN },
    Case { name: "flat", size: [0.3, 0.2, 0.0], noise: 0.0, ..PLAIN },
    Case { name: "half turns", half_turns: true, noise: 0.0, ..PLAIN },
    Case { name: "thin", size: [0.3, 3e-3, 3e-3], noise: 1e-5, ..PLAIN },
    Case { name: "thinner", size: [0.3, 3e-5, 3e-5], noise: 0.0, offset: 0.1, ..PLAIN },
    Case { name: "line", size: [0.3, 0.0, 0.0], noise: 0.0, ..PLAIN },
    Case { name: "noise as large as the body", noise: 0.3, ..PLAIN },
    Case { name: "far", offset: 1e5, ..PLAIN },
    Case { name: "one place", size: [0.0; 3], noise: 0.0, ..PLAIN },
];

fn simulate(case: &Case, missing: bool) -> (Vec<Option<Point3<f64>>>, Tracks, Vec<f64>) {
    let mut seed = 7;
    let mut vector = || Vector3::from_fn(|_, _| chance(&mut seed));
    let general = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.8, 0.3));
    let shape: Vec<_> =
        (0..case.features).map(|_| Point3::from(general * vector().component_mul(&Vector3::from(case.size)))).collect();
    let mut positions = Vec::new();
    for _ in 0..FRAMES {
        let turn = vector() * 6.0;
        let turn = if case.half_turns { turn.normalize() * std::f64::consts::PI } else { turn };
        let pose = Pose::new(vector().normalize() * case.offset, turn);
        positions.extend(shape.iter().map(|p| pose * p + vector() * case.noise));
    }
    let mut seed = 11;
    let mut some = |share: f64| chance(&mut seed) + 0.5 < share;
    if missing {
        positions.iter_mut().filter(|_| some(0.2)).for_each(|p| p.y = f64::NAN);
    }
    let known = |(feature, place)| (!missing || feature % 7 != 3).then_some(place);
    let weights = (0..positions.len()).map(|sample| if sample % 5 == 0 { 0.0 } else { (sample % 9) as f64 / 8.0 });
    (
        shape.into_iter().enumerate().map(known).collect(),
        Tracks::new(case.features, positions).expect("whole frames"),
        weights.collect(),
    )
}

fn by_hand(shape: &[Option<Point3<f64>>], tracks: &Tracks, weights: Option<&[f64]>, frame: usize) -> Option<Pose> {
    let weight = |feature: usize| weights.map_or(1.0, |weights| weights[frame * shape.len() + feature]);
    let pairs = tracks.seen(frame).filter_map(|(f, target)| Some((shape[f].as_ref()?, target, weight(f))));
    register_weighted(pairs).ok()
}

#[test]
fn frames_in_lanes_have_the_poses_that_each_has_alone_whatever_the_instructions() {
    for case in &CASES {
        for missing in [false, true] {
            let (shape, tracks, weights) = simulate(case, missing);
            for weights in [None, Some(&weights[..])] {
                for arch in Instructions::here().into_iter().filter_map(Instructions::arch) {
                    let mut poses = vec![None; FRAMES];
                    arch.dispatch(Frames {
                        shape: &shape,
                        tracks: &tracks,
                        weights,
                        poses: &mut poses,
                        look: &mut Nobody,
                    });
                    for (frame, found) in poses.iter().enumerate() {
                        let expected = by_hand(&shape, &tracks, weights, frame);
                        let name = format!("{}, missing: {missing}, frame {frame}", case.name);
                        let (Some(found), Some(expected)) = (found, expected) else {
                            assert_eq!(found.is_some(), expected.is_some(), "{name}");
                            continue;
                        };
                        let off = expected.inverse() * found;
                        let distance = off.translation.vector.norm() / (1.0 + case.offset);
                        assert!(off.rotation.angle() < SAME && distance < SAME, "{name}: {off}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_box_is_solved_in_lanes_and_a_thin_body_alone() {
    let solved = |case: &Case| {
        let (shape, tracks, _) = simulate(case, false);
        let places = Places::of(&shape);
        let none = [0.0; BLOCK];
        let mut sums = Sums { products: [none; 12], source: [none; 3], count: none, found: [0; BLOCK] };
        let mut row = vec![0.0; places.expanded[0].len()];
        let products = add_frame(pulp::Scalar, &places, &tracks, 0, None, &mut row, &mut sums, 0);
        sums.products = products.map(|sum| [sum; BLOCK]);
        solve(pulp::Scalar, &places, &sums).pose(&sums, 0).is_some()
    };
    assert!(solved(&CASES[0]) && solved(&CASES[7]));
    assert!(!solved(&CASES[9]) && !solved(&CASES[10]) && !solved(&CASES[3]));
}
