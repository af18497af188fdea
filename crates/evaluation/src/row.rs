//! Conditions to be simulated, and what they are for.

use jointscope_scenes::SceneOptions;

use crate::{Bound, Goal, Measure, measurement::Measurement};

/// A question with its conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its name, such as `A1`.
    pub name: &'static str,
    /// What it is about.
    pub title: &'static str,
    /// Its conditions.
    pub cells: Vec<Cell>,
    /// Whether it looks at the recordings of the other rows, as far as those are made.
    pub(crate) pooled: bool,
}

impl Row {
    pub(crate) fn new(name: &'static str, title: &'static str, cells: Vec<Cell>) -> Self {
        Self { name, title, cells, pooled: false }
    }

    /// Recordings made for `seeds` seeds.
    pub fn recordings(&self, seeds: u32) -> u64 {
        let cells: &[Cell] = if self.pooled { &[] } else { &self.cells };
        let conditions = cells.iter().flat_map(|cell| &cell.conditions);
        conditions.map(|condition| u64::from(condition.repetitions.of(seeds))).sum()
    }

    /// Everything that is measured in any of the cells, each once.
    pub fn measures(&self) -> Vec<Measure> {
        let mut measures = Vec::new();
        for &measure in self.cells.iter().flat_map(|cell| &cell.measures) {
            if !measures.contains(&measure) {
                measures.push(measure);
            }
        }
        measures
    }

    /// The goals, each with the names of its cells.
    pub fn goals(&self) -> Vec<(Goal, Vec<&str>)> {
        let mut goals: Vec<(Goal, Vec<&str>)> = Vec::new();
        for (cell, goal) in self.cells.iter().flat_map(|cell| cell.goals.iter().map(move |goal| (cell, goal))) {
            match goals.iter_mut().find(|(known, _)| known == goal) {
                Some((_, cells)) => cells.push(&cell.name),
                None => goals.push((*goal, vec![&cell.name])),
            }
        }
        goals
    }
}

/// Scenes that are scored together.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// What is special about it.
    pub name: String,
    /// What is simulated.
    pub conditions: Vec<Condition>,
    /// What is measured.
    pub measures: Vec<Measure>,
    /// What it should be.
    pub goals: Vec<Goal>,
    pub(crate) selection: Selection,
}

impl Cell {
    /// Several scenes with the same options.
    pub(crate) fn new(name: impl Into<String>, scenes: &[&'static str], options: &SceneOptions) -> Self {
        let condition = |&scene| Condition::new(scene, options.clone());
        Self::of(name, scenes.iter().map(condition).collect())
    }

    pub(crate) fn of(name: impl Into<String>, conditions: Vec<Condition>) -> Self {
        Self { name: name.into(), conditions, measures: vec![], goals: vec![], selection: Selection::All }
    }

    /// Adds something to be measured.
    pub(crate) fn by(mut self, measures: &[Measure]) -> Self {
        self.measures.extend(measures);
        self
    }

    /// Adds a goal, and what it is about to what is measured.
    pub(crate) fn goal(mut self, measure: Measure, must: Bound, aim: Bound) -> Self {
        if !self.measures.contains(&measure) {
            self.measures.push(measure);
        }
        self.goals.push(Goal { measure, must, aim });
        self
    }

    pub(crate) fn repeated(mut self, repetitions: Repetitions) -> Self {
        self.conditions.iter_mut().for_each(|condition| condition.repetitions = repetitions);
        self
    }

    pub(crate) fn seen_by_one_camera(mut self) -> Self {
        self.conditions.iter_mut().for_each(|condition| condition.one_camera = true);
        self
    }

    pub(crate) fn following(mut self, procedure: Procedure) -> Self {
        self.conditions.iter_mut().for_each(|condition| condition.procedure = procedure);
        self
    }
}

/// What is simulated, but for the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Name of the scene.
    pub scene: &'static str,
    /// Its options; their seed counts for nothing.
    pub options: SceneOptions,
    /// What is done with it.
    pub procedure: Procedure,
    /// Whether it is judged as what a single camera saw: with depth gains estimated and scales sought.
    pub one_camera: bool,
    pub(crate) repetitions: Repetitions,
}

impl Condition {
    pub(crate) fn new(scene: &'static str, options: SceneOptions) -> Self {
        Self { scene, options, procedure: Procedure::Pair, one_camera: false, repetitions: Repetitions::All }
    }

    /// Whether the recordings are the same, however many of them there are.
    pub(crate) fn same_recordings(&self, other: &Self) -> bool {
        let all = |condition: &'_ Self| (condition.scene, condition.procedure, condition.one_camera);
        all(self) == all(other) && self.options == other.options
    }
}

/// What is done with a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Procedure {
    /// Its bodies are judged in their order.
    Pair,
    /// The pairs that the thesis lists for its experiment are judged.
    Experiment,
    /// Its two bodies are judged in both orders, and the recording with exchanged bodies too.
    Exchange,
}

/// How often a condition is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Repetitions {
    /// With every seed.
    All,
    /// With so many seeds at most.
    AtMost(u32),
    /// With a third of the seeds, but ten if there are so many.
    Third,
    /// With sixteen times as many seeds: means that are compared with a limit to a hundredth need more verdicts.
    Sixteenfold,
}

impl Repetitions {
    pub(crate) fn of(self, seeds: u32) -> u32 {
        match self {
            Self::All => seeds,
            Self::AtMost(most) => seeds.min(most),
            Self::Third => (seeds / 3).max(10).min(seeds),
            Self::Sixteenfold => seeds.saturating_mul(16),
        }
    }
}

/// Which measurements of a cell count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Selection {
    All,
    /// Those with a confidence from the first to below the second.
    Stated(f64, f64),
    /// Those that are determined.
    Determined,
}

impl Selection {
    pub(crate) fn takes(self, measurement: &Measurement) -> bool {
        match self {
            Self::All => true,
            Self::Stated(from, below) => (from..below).contains(&measurement.confidence),
            Self::Determined => measurement.determined,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_recordings_are_made_less_often_but_never_more_often_than_asked() {
        let third = |seeds| Repetitions::Third.of(seeds);
        assert_eq!([third(60), third(30), third(12), third(2)], [20, 10, 10, 2]);
        assert_eq!([Repetitions::AtMost(10).of(30), Repetitions::AtMost(10).of(3), Repetitions::All.of(7)], [10, 3, 7]);
        assert_eq!(Repetitions::Sixteenfold.of(30), 480);
    }

    #[test]
    fn a_goal_of_several_cells_is_one_goal() {
        let cell = |name: &str, least| {
            let (must, aim) = (Bound::AtLeast(least), Bound::AtLeast(99.0));
            Cell::new(name, &["rigid"], &SceneOptions::default()).goal(Measure::Classes, must, aim)
        };
        let row = Row::new("X", "test", vec![cell("a", 95.0), cell("b", 50.0), cell("c", 95.0)]);
        let goals = row.goals();
        assert_eq!(goals.len(), 2);
        assert_eq!((goals[0].1.as_slice(), goals[1].1.as_slice()), (["a", "c"].as_slice(), ["b"].as_slice()));
        assert_eq!(row.measures(), [Measure::Classes]);
    }
}
