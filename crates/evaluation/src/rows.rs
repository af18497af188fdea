//! The table of rows. Their names and goals are those of the project.

use jointscope_scenes::{EXPERIMENTS, SceneOptions};

use crate::{
    Bound::{AtLeast, AtMost, Between},
    Cell, Condition, Measure, Procedure, Row, TYPES,
    row::{Repetitions, Selection},
};

/// Rows whose verdicts the calibration is about.
const CALIBRATED: [fn() -> Row; 13] = [
    nominal,
    nominal_axis,
    short_sweep_axis,
    little_noise,
    much_noise,
    information_limit,
    bad_tracking,
    uneven_noise,
    few_data,
    very_few_data,
    rigid_pairs,
    unusual_places,
    imperfect_joints,
];

/// A row by its name, in capital or small letters.
pub fn row(name: &str) -> Option<Row> {
    rows().into_iter().find(|row| row.name.eq_ignore_ascii_case(name))
}

/// All rows.
pub fn rows() -> Vec<Row> {
    let before = CALIBRATED[..12].iter().map(|row| row());
    let further = [
        scale(),
        depth_gain(),
        axis_uncertainty(),
        calibration(),
        experiments(),
        exchange(),
        imperfect_joints(),
        peers(),
        noise(),
        search_for_scales(),
    ];
    before.chain(further).collect()
}

fn given() -> SceneOptions {
    SceneOptions::default()
}

fn noise_of(millimetres: f64) -> SceneOptions {
    SceneOptions { noise: Some(millimetres / 1000.0), ..given() }
}

pub(crate) fn noise_and_sweep(millimetres: f64, degrees: f64) -> SceneOptions {
    SceneOptions { sweep_deg: Some(degrees), ..noise_of(millimetres) }
}

impl Cell {
    /// All eight types.
    fn types(name: impl Into<String>, options: &SceneOptions) -> Self {
        Self::new(name, &TYPES, options).by(&[Measure::Types, Measure::Classes])
    }

    /// Goals of the rms error of revolute axes: what must be and what is aimed at, in degrees and millimetres.
    fn axis(self, must: [f64; 2], aim: [f64; 2]) -> Self {
        self.goal(Measure::Angle, AtMost(must[0]), AtMost(aim[0])).goal(
            Measure::Distance,
            AtMost(must[1]),
            AtMost(aim[1]),
        )
    }

    fn share(self, measure: Measure, must: f64, aim: f64) -> Self {
        self.goal(measure, AtLeast(must), AtLeast(aim))
    }
}

fn nominal() -> Row {
    let cell = Cell::types("nominal", &given()).share(Measure::Types, 98.0, 99.5);
    Row::new("A1", "nominal scene, eight types", vec![cell])
}

fn nominal_axis() -> Row {
    let cell = Cell::new("nominal", &["revolute"], &given()).axis([1.35, 2.0], [1.15, 1.5]);
    Row::new("A2", "nominal scene, revolute axis", vec![cell])
}

fn short_sweep_axis() -> Row {
    let options = SceneOptions { sweep_deg: Some(20.0), ..given() };
    let cell = Cell::new("20 deg", &["revolute"], &options).axis([2.1, 3.6], [1.7, 2.8]);
    Row::new("A3", "short sweep, revolute axis", vec![cell])
}

fn little_noise() -> Row {
    const SWEEPS: [f64; 3] = [20.0, 45.0, 90.0];
    let cell = |sweep: f64| {
        Cell::types(format!("1 mm, {sweep} deg"), &noise_and_sweep(1.0, sweep))
            .share(Measure::Classes, 99.0, 100.0)
            .by(&[Measure::Angle, Measure::Distance])
    };
    // At 20 degrees alone A3's figures, divided by three, are what noise leaves.
    let hinges = SWEEPS.map(|sweep| Condition::new("revolute", noise_and_sweep(1.0, sweep)));
    let hinges = Cell::of("1 mm, hinges of all sweeps", hinges.into()).axis([0.65, 1.0], [0.55, 0.8]);
    Row::new("A4", "little noise: types and revolute axis", SWEEPS.map(cell).into_iter().chain([hinges]).collect())
}

fn much_noise() -> Row {
    let [ten, twenty] = [10.0, 20.0].map(|noise| {
        move |sweep: f64| {
            Cell::types(format!("{noise} mm, {sweep} deg"), &noise_and_sweep(noise, sweep)).share(
                Measure::Classes,
                95.0,
                99.0,
            )
        }
    });
    let cells = [10.0, 20.0, 45.0, 90.0].map(ten).into_iter().chain([20.0, 45.0, 90.0].map(twenty));
    Row::new("A5", "much noise", cells.collect())
}

fn information_limit() -> Row {
    let cell = |(noise, sweep): (f64, f64)| {
        Cell::types(format!("{noise} mm, {sweep} deg"), &noise_and_sweep(noise, sweep)).share(
            Measure::Classes,
            50.0,
            75.0,
        )
    };
    Row::new("A6", "noise at the limit of information", [(20.0, 10.0), (10.0, 5.0)].map(cell).into())
}

fn bad_tracking() -> Row {
    let conditions = [
        ("30 % dropouts", SceneOptions { dropout: Some(0.3), ..given() }),
        ("60 % dropouts", SceneOptions { dropout: Some(0.6), ..given() }),
        ("20 % wild features", SceneOptions { outlier_features: Some(0.2), ..given() }),
        ("40 % wild features", SceneOptions { outlier_features: Some(0.4), ..given() }),
        ("5 % wild samples", SceneOptions { outlier_samples: Some(0.05), ..given() }),
        ("30 % wild samples", SceneOptions { outlier_samples: Some(0.3), ..given() }),
        (
            "30 % dropouts, 20 % wild features",
            SceneOptions { dropout: Some(0.3), outlier_features: Some(0.2), ..given() },
        ),
    ];
    let cell = |(name, options): (&str, SceneOptions)| Cell::types(name, &options).share(Measure::Types, 95.0, 99.0);
    Row::new("A7", "bad tracking", conditions.map(cell).into())
}

fn uneven_noise() -> Row {
    let depth = |ratio, millimetres| SceneOptions { depth_noise: Some(ratio), ..noise_of(millimetres) };
    let conditions = [
        ("depth noise x5, 1 mm across", depth(5.0, 1.0)),
        ("depth noise x5, 3 mm across", depth(5.0, 3.0)),
        ("depth noise x10, 1 mm across", depth(10.0, 1.0)),
        ("drift 0.9, 3 mm", SceneOptions { drift: Some(0.9), ..noise_of(3.0) }),
    ];
    let cell = |(name, options): (&str, SceneOptions)| Cell::types(name, &options).share(Measure::Classes, 90.0, 97.0);
    Row::new("A8", "noise along the viewing ray, drifting noise", conditions.map(cell).into())
}

fn few_data() -> Row {
    let conditions = [
        ("4 features", SceneOptions { features: Some(4), ..given() }),
        ("10 frames", SceneOptions { frames: Some(10), ..given() }),
    ];
    let cell = |(name, options): (&str, SceneOptions)| Cell::types(name, &options).share(Measure::Types, 95.0, 99.0);
    Row::new("A9", "few features or frames", conditions.map(cell).into())
}

fn very_few_data() -> Row {
    let cell = |(sweep, must, aim): (f64, f64, f64)| {
        let options = SceneOptions { features: Some(6), frames: Some(20), ..noise_and_sweep(5.0, sweep) };
        Cell::types(format!("{sweep} deg"), &options).share(Measure::Classes, must, aim)
    };
    let cells = [(20.0, 93.0, 98.0), (10.0, 75.0, 90.0)].map(cell);
    Row::new("A10", "6 features, 20 frames, 5 mm", cells.into())
}

fn rigid_pairs() -> Row {
    let mut cells = Vec::new();
    for still_base in [false, true] {
        for frames in [50, 200, 1000] {
            for noise in [0.0, 3.0, 20.0] {
                let options = SceneOptions { frames: Some(frames), still_base, ..noise_of(noise) };
                let motion = if still_base { "still" } else { "moving" };
                let cell = Cell::new(format!("{motion}, {frames} frames, {noise} mm"), &["rigid"], &options);
                let repetitions = if frames > 500 { Repetitions::Third } else { Repetitions::All };
                cells.push(cell.repeated(repetitions).share(Measure::Classes, 99.0, 99.9));
            }
        }
    }
    Row::new("A11", "rigid pairs", cells)
}

fn unusual_places() -> Row {
    /// Metres from the hinge to the handle.
    const HANDLE: f64 = 0.5;
    let handle = |sweep: f64| {
        let options =
            SceneOptions { axis_distance: Some(HANDLE), body_size: Some(0.15), ..noise_and_sweep(1.0, sweep) };
        let slide = SceneOptions { travel: Some(sweep.to_radians() * HANDLE), ..options.clone() };
        let conditions = vec![Condition::new("revolute", options), Condition::new("prismatic", slide)];
        Cell::of(format!("door's handle, {sweep} deg"), conditions).by(&[Measure::Types, Measure::Classes]).share(
            Measure::Types,
            99.0,
            100.0,
        )
    };
    let centred = SceneOptions { axis_distance: Some(0.0), ..noise_of(3.0) };
    let centred = Cell::new("centred on the axis, 3 mm", &["revolute", "cylindrical", "screw", "spherical"], &centred)
        .share(Measure::Types, 99.0, 100.0)
        .by(&[Measure::Classes]);
    let turntable = Cell::new("turntable, 1 mm", &["turntable"], &noise_of(1.0))
        .repeated(Repetitions::Sixteenfold)
        .share(Measure::Types, 99.0, 100.0)
        .by(&[Measure::Classes])
        .goal(Measure::Angle, AtMost(0.3), AtMost(0.2));
    let cells = [15.0, 30.0, 44.0].map(handle).into_iter().chain([centred, turntable]);
    Row::new("A12", "features far from the axis, or about it", cells.collect())
}

fn scale() -> Row {
    let seen = |millimetres| SceneOptions { scale: Some(1.0 / 0.94), ..noise_of(millimetres) };
    let shown = |(millimetres, must, aim): (f64, f64, f64)| {
        Cell::new(
            format!("shown, {millimetres} mm"),
            &["rigid", "prismatic", "revolute", "spherical"],
            &seen(millimetres),
        )
        .goal(Measure::ScaleError, AtMost(must), AtMost(aim))
        .share(Measure::ScaleShown, 100.0, 100.0)
        .by(&[Measure::Classes])
    };
    let hidden = |millimetres| {
        let options = SceneOptions { still_base: true, ..seen(millimetres) };
        Cell::new(
            format!("the base rests, {millimetres} mm"),
            &["rigid", "prismatic", "revolute", "spherical"],
            &options,
        )
        .share(Measure::ScaleNotShown, 100.0, 100.0)
        .by(&[Measure::Classes])
    };
    let apart = Cell::new("disconnected, 3 mm", &["disconnected"], &seen(3.0))
        .share(Measure::ScaleNotShown, 100.0, 100.0)
        .by(&[Measure::Classes]);
    let cells = [(1.0, 0.2, 0.1), (3.0, 0.5, 0.2)].map(shown).into_iter().chain([1.0, 3.0].map(hidden)).chain([apart]);
    Row::new("A13", "one camera: scale", cells.map(Cell::seen_by_one_camera).collect())
}

/// Whether a free scale turns what is no joint, or a richer one, into a simple one.
fn search_for_scales() -> Row {
    let options = SceneOptions { scale: Some(1.0 / 0.94), ..noise_of(1.0) };
    let cell =
        |name: &str| Cell::new(name, &["planar", "cylindrical", "disconnected"], &options).by(&[Measure::FalseJoints]);
    let searched = cell("scale sought, 1 mm").goal(Measure::FalseJointsAdded, AtMost(1.0), AtMost(0.0));
    Row::new("S", "one camera: false joints", vec![cell("without a search, 1 mm"), searched.seen_by_one_camera()])
}

fn depth_gain() -> Row {
    let cells = [0.6, 0.9].into_iter().flat_map(|gain| [0.5, 1.0, 2.0].map(|noise| (gain, noise)));
    let cell = |(gain, noise): (f64, f64)| {
        let options = SceneOptions { depth_gain: Some(gain), ..noise_of(noise) };
        Cell::new(format!("gain {gain}, {noise} mm"), &["rigid", "prismatic", "revolute", "spherical"], &options)
            .goal(Measure::GainError, AtMost(1.5), AtMost(0.7))
            .share(Measure::Classes, 90.0, 100.0)
            .seen_by_one_camera()
    };
    Row::new("A14", "one camera: compressed depth", cells.map(cell).collect())
}

fn axis_uncertainty() -> Row {
    let conditions = [
        ("nominal", given()),
        ("20 deg", SceneOptions { sweep_deg: Some(20.0), ..given() }),
        ("1 mm, 20 deg", noise_and_sweep(1.0, 20.0)),
    ];
    let cell = |(name, options): (&str, SceneOptions)| {
        let (must, aim) = (Between(0.7, 1.6), Between(0.85, 1.2));
        Cell::new(name, &["revolute"], &options).goal(Measure::NormalisedAngle, must, aim).goal(
            Measure::NormalisedDistance,
            must,
            aim,
        )
    };
    Row::new("A15", "stated uncertainty of the revolute axis", conditions.map(cell).into())
}

fn calibration() -> Row {
    let conditions: Vec<Condition> =
        CALIBRATED.iter().flat_map(|row| row().cells).flat_map(|cell| cell.conditions).collect();
    let cell = |(name, selection): (&str, Selection)| {
        let cell = Cell::of(name, conditions.clone()).by(&[Measure::Types, Measure::Classified]);
        Cell { selection, ..cell }
    };
    let mut cells = [
        ("stated < 0.5", Selection::Stated(0.0, 0.5)),
        ("0.5 to 0.8", Selection::Stated(0.5, 0.8)),
        ("0.8 to 0.9", Selection::Stated(0.8, 0.9)),
        ("0.9 to 0.99", Selection::Stated(0.9, 0.99)),
        ("stated >= 0.99", Selection::Stated(0.99, f64::INFINITY)),
        ("determined", Selection::Determined),
        ("all", Selection::All),
    ]
    .map(cell);
    cells[4] = cells[4].clone().share(Measure::Types, 97.0, 99.5);
    Row {
        pooled: true,
        ..Row::new("A16", "calibration, over the rows A1 to A12 and A21 that are evaluated", cells.into())
    }
}

fn experiments() -> Row {
    let condition = |experiment: &jointscope_scenes::Experiment| {
        Condition::new(experiment.scene, SceneOptions { monocular: true, ..given() })
    };
    let cell = Cell::of("28 pairs", EXPERIMENTS.iter().map(condition).collect())
        .repeated(Repetitions::Third)
        .following(Procedure::Experiment)
        .goal(Measure::PairsRight, AtLeast(27.0), AtLeast(28.0));
    Row::new("A17", "the thesis's ten experiments, simulated, seen by one camera", vec![cell.seen_by_one_camera()])
}

fn exchange() -> Row {
    let conditions = [
        ("nominal", given()),
        ("30 % dropouts", SceneOptions { dropout: Some(0.3), ..given() }),
        ("10 mm", noise_of(10.0)),
    ];
    let cell = |(name, options): (&str, SceneOptions)| {
        Cell::new(name, &TYPES, &options).following(Procedure::Exchange).share(Measure::Symmetric, 100.0, 100.0)
    };
    Row::new("A18", "bodies in the other order", conditions.map(cell).into())
}

fn imperfect_joints() -> Row {
    let long = SceneOptions { frames: Some(200), ..noise_of(0.3) };
    let share = |cell: Cell| cell.by(&[Measure::Types, Measure::Classes]).share(Measure::Types, 97.0, 100.0);
    let bend = |bend: f64| {
        let options = SceneOptions { bend: Some(bend), ..long.clone() };
        share(Cell::new(format!("bent by {} % of the travel", 100.0 * bend), &["prismatic", "revolute"], &options))
    };
    let play = |millimetres: f64| {
        // A random motion within a range has about half of it as the root mean square of its length in space.
        let options = SceneOptions { play: Some(2.0 * millimetres / 1000.0), ..long.clone() };
        let scenes = ["prismatic", "revolute", "spherical", "planar"];
        share(Cell::new(format!("wanders by {millimetres} mm rms"), &scenes, &options))
    };
    let skin = |millimetres: f64| {
        let options = SceneOptions { skin: Some(millimetres / 1000.0), ..long.clone() };
        let sweep = |degrees| SceneOptions { sweep_deg: Some(degrees), ..options.clone() };
        let conditions = vec![
            Condition::new("revolute", sweep(90.0)),
            Condition::new("spherical", sweep(60.0)),
            Condition::new("disconnected", options.clone()),
        ];
        share(Cell::of(format!("markers on skin, {millimetres} mm"), conditions))
    };
    let filtered = SceneOptions { filter: Some(2.0), noise: Some(0.003), ..long.clone() };
    let filtered = share(Cell::new("filtered over 2 frames, 3 mm", &TYPES, &filtered));
    let cells = [0.005, 0.01].map(bend).into_iter().chain([0.5, 1.0, 2.0].map(play)).chain([2.0, 5.0].map(skin));
    Row::new("A21", "imperfect joints, 0.3 mm, 200 frames", cells.chain([filtered]).collect())
}

/// The pose series on which other programs were measured.
fn peers() -> Row {
    let poses = SceneOptions {
        poses: true,
        rotation_noise: Some(0.01),
        frames: Some(200),
        axis_distance: Some(0.7),
        still_base: true,
        ..noise_of(5.0)
    };
    let cell = |name: &str, scene: &'static str, options: SceneOptions| {
        Cell::new(name, &[scene], &options)
            .repeated(Repetitions::AtMost(10))
            .share(Measure::Types, 100.0, 100.0)
            .by(&[Measure::Classes])
    };
    let turned = |degrees| SceneOptions { sweep_deg: Some(degrees), ..poses.clone() };
    let hinge =
        |name: &str, options| cell(name, "revolute", options).by(&[Measure::MedianAngle, Measure::MedianDistance]);
    let within = |cell: Cell, must: [f64; 2], aim: [f64; 2]| {
        cell.goal(Measure::MedianAngle, AtMost(must[0]), AtMost(aim[0])).goal(
            Measure::MedianDistance,
            AtMost(must[1]),
            AtMost(aim[1]),
        )
    };
    // In a fifth of the frames one of the two poses, or both, are wild.
    let wild = SceneOptions { outlier_samples: Some(1.0 - 0.8_f64.sqrt()), ..turned(90.0) };
    let wild = hinge("hinge 90 deg, 20 % wild frames", wild).goal(Measure::AngleGrowth, AtMost(1.3), AtMost(1.3)).goal(
        Measure::DistanceGrowth,
        AtMost(1.3),
        AtMost(1.3),
    );
    let slid = |travel| SceneOptions { travel: Some(travel), ..poses.clone() };
    // Ratios of medians need more of them.
    let (wild, first) =
        (wild.repeated(Repetitions::All), hinge("hinge 90 deg", turned(90.0)).repeated(Repetitions::All));
    let cells = vec![
        within(first, [0.24, 3.3], [0.2, 3.0]),
        within(hinge("hinge 30 deg", turned(30.0)), [1.1, 18.0], [1.1, 18.0]),
        within(hinge("hinge 10 deg", turned(10.0)), [3.2, 78.0], [3.2, 78.0]),
        wild,
        hinge("hinge 90 deg, moving base", SceneOptions { still_base: false, ..turned(90.0) }),
        cell("slide 40 cm", "prismatic", slid(0.4)),
        cell("slide 5 cm", "prismatic", slid(0.05)),
        cell("rigid, 5 mm", "rigid", poses.clone()),
        cell("rigid, 10 mm", "rigid", SceneOptions { noise: Some(0.01), ..poses.clone() }),
        cell("screw 90 deg, 10 cm", "screw", SceneOptions { travel: Some(0.1), ..turned(90.0) }),
        cell("free", "disconnected", poses.clone()),
    ];
    Row::new("P", "tracked poses: 5 mm and 0.01 rad on both bodies, axis 0.7 m away, 200 frames", cells)
}

fn noise() -> Row {
    let conditions = [
        ("nominal", given()),
        ("1 mm", noise_of(1.0)),
        ("20 mm", noise_of(20.0)),
        ("4 features", SceneOptions { features: Some(4), ..given() }),
        ("10 frames", SceneOptions { frames: Some(10), ..given() }),
        ("60 % dropouts", SceneOptions { dropout: Some(0.6), ..given() }),
        ("20 % wild features", SceneOptions { outlier_features: Some(0.2), ..given() }),
        ("5 % wild samples", SceneOptions { outlier_samples: Some(0.05), ..given() }),
        ("drift 0.9, 3 mm", SceneOptions { drift: Some(0.9), ..noise_of(3.0) }),
    ];
    let cell = |(name, options): (&str, SceneOptions)| {
        Cell::new(name, &TYPES, &options).by(&[Measure::Noise, Measure::WorstNoise, Measure::ChiSquared])
    };
    Row::new("B", "reported noise, and what the true model leaves unexplained", conditions.map(cell).into())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use jointscope_scenes::simulate;

    use super::*;

    #[test]
    fn every_row_of_the_goals_that_scenes_can_answer_is_there_once() {
        let rows = rows();
        let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
        let numbered = (1..=18).chain([21]).map(|number| format!("A{number}"));
        let expected: Vec<String> = numbered.chain(["P", "B", "S"].map(String::from)).collect();
        assert_eq!(names, expected);
        assert!(row("a12").is_some_and(|row| row.name == "A12") && row("A19").is_none());
    }

    #[test]
    fn cells_of_a_row_have_names_of_their_own_and_something_to_measure() {
        for row in rows() {
            let names: BTreeSet<&str> = row.cells.iter().map(|cell| cell.name.as_str()).collect();
            assert_eq!(names.len(), row.cells.len(), "{}", row.name);
            assert!(row.cells.iter().all(|cell| !cell.conditions.is_empty() && !cell.measures.is_empty()));
            assert!(row.name == "B" || !row.goals().is_empty(), "{} has a goal", row.name);
        }
    }

    #[test]
    fn every_condition_can_be_simulated() {
        for condition in rows().iter().flat_map(|row| &row.cells).flat_map(|cell| &cell.conditions) {
            let options = SceneOptions {
                frames: condition.options.frames.map(|frames| frames.min(50)),
                ..condition.options.clone()
            };
            let simulation = simulate(condition.scene, &options);
            assert!(simulation.is_ok(), "{}: {:?}", condition.scene, simulation.err());
        }
    }

    #[test]
    fn what_is_aimed_at_is_within_what_must_be() {
        for (goal, _) in rows().iter().flat_map(Row::goals) {
            let inside = match goal.aim {
                AtLeast(aim) | AtMost(aim) => goal.must.holds(aim),
                Between(least, most) => goal.must.holds(least) && goal.must.holds(most),
            };
            assert!(inside, "{goal:?}");
        }
    }
}
