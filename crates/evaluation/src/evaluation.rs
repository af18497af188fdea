//! All measurements, in parallel, summed up.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use serde::Serialize;

use crate::{
    Cell, Column, Condition, EvaluationError, Goal, Measure, Row, Standing, class,
    measure::Score,
    measurement::{Measurement, measure},
};

/// How often and how conditions are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Seeds of every condition; some take fewer.
    pub seeds: u32,
    /// The first seed; the others follow it.
    pub first_seed: u64,
    /// Threads, each at a recording of its own; 0 means one per core.
    pub threads: usize,
    /// Whether times are given, which differ from run to run.
    pub times: bool,
}

/// What was measured. Apart from times it depends on nothing but the rows, the columns and the seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evaluation {
    /// Seeds of every condition.
    pub seeds: u32,
    /// The first of them.
    pub first_seed: u64,
    /// Names of the columns, in the order of all lists of scores.
    pub columns: Vec<String>,
    /// The rows, in the order asked for.
    pub rows: Vec<RowResult>,
}

/// What was measured for a row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowResult {
    /// Its name.
    pub name: &'static str,
    /// What it is about.
    pub title: &'static str,
    /// Everything measured in any of its cells.
    pub measures: Vec<Measure>,
    /// Its cells.
    pub cells: Vec<CellResult>,
    /// Its goals.
    pub goals: Vec<GoalResult>,
}

/// What was measured in a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellResult {
    /// Its name.
    pub name: String,
    /// What each column achieved.
    pub columns: Vec<Scores>,
}

/// What a column achieved in a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scores {
    /// Verdicts that count.
    pub verdicts: usize,
    /// Every measure of the cell that could be taken.
    pub scores: BTreeMap<Measure, Score>,
    /// Which joints were taken for which, the most frequent first. Of a column that knows four joints only what is in
    /// the wrong class is listed.
    pub confusions: Vec<Confusion>,
    /// The wrong verdicts one by one.
    pub mistakes: Vec<Mistake>,
    /// Mean time of a detection, milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub milliseconds: Option<f64>,
}

/// A joint that was taken for another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Confusion {
    /// The true joint.
    pub expected: String,
    /// The joint found.
    pub found: String,
    /// How often.
    pub count: usize,
}

/// A wrong verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mistake {
    /// Name of the scene.
    pub scene: &'static str,
    /// Its seed.
    pub seed: u64,
    /// The true joint.
    pub expected: String,
    /// The joint found.
    pub found: String,
    /// The confidence stated for it.
    pub confidence: f64,
    /// Whether it was called determined.
    pub determined: bool,
}

/// How a goal is met.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GoalResult {
    /// The goal.
    #[serde(flatten)]
    pub goal: Goal,
    /// Names of its cells; the worst of them counts.
    pub cells: Vec<String>,
    /// The worst value of each column, and how it stands; `None` for columns that do not give the measure at all.
    pub columns: Vec<Option<(f64, Standing)>>,
}

impl RowResult {
    /// How a column stands in all goals of the row together; `None` if it has none or they cannot be measured.
    pub fn standing(&self, column: usize) -> Option<Standing> {
        self.goals.iter().filter_map(|goal| goal.columns[column]).map(|(_, standing)| standing).min()
    }
}

/// Evaluates rows for columns, telling `watch` after each recording how many are done, and of how many.
///
/// Recordings that several rows look at are made once. Rows that look at what others made look at all rows they are
/// about if none of those is asked for.
///
/// # Errors
/// [`EvaluationError`] if a scene cannot be simulated or analysed.
pub fn evaluate(
    plan: &Plan,
    columns: &[Column],
    rows: &[Row],
    watch: &(dyn Fn(usize, usize) + Sync),
) -> Result<Evaluation, EvaluationError> {
    let rows = with_pools(rows);
    let mut wanted: Vec<(&Condition, u32)> = Vec::new();
    for condition in rows.iter().flat_map(|row| &row.cells).flat_map(|cell| &cell.conditions) {
        let seeds = condition.repetitions.of(plan.seeds);
        match wanted.iter_mut().find(|(known, _)| known.same_recordings(condition)) {
            Some((_, most)) => *most = seeds.max(*most),
            None => wanted.push((condition, seeds)),
        }
    }
    let made = measure_all(plan, columns, &wanted, watch)?;
    let of_condition = |condition: &Condition| {
        let index = wanted.iter().position(|(known, _)| known.same_recordings(condition));
        let seeds = condition.repetitions.of(plan.seeds) as usize;
        index.into_iter().flat_map(|index| &made[index]).take(seeds).collect()
    };
    Ok(Evaluation {
        seeds: plan.seeds,
        first_seed: plan.first_seed,
        columns: columns.iter().map(|column| column.name.clone()).collect(),
        rows: rows.iter().map(|row| sum_up(row, columns, plan.times, &of_condition)).collect(),
    })
}

/// The rows, those that look at other rows' recordings cut down to what is made.
fn with_pools(rows: &[Row]) -> Vec<Row> {
    let own: Vec<&Condition> =
        rows.iter().filter(|row| !row.pooled).flat_map(|row| &row.cells).flat_map(|cell| &cell.conditions).collect();
    let mut rows = rows.to_vec();
    for cell in rows.iter_mut().filter(|row| row.pooled).flat_map(|row| &mut row.cells) {
        let mut pool: Vec<Condition> = Vec::new();
        for condition in &cell.conditions {
            if !pool.iter().any(|known| known.same_recordings(condition)) {
                pool.push(condition.clone());
            }
        }
        let is_made = |condition: &Condition| own.iter().any(|made| made.same_recordings(condition));
        if pool.iter().any(is_made) {
            pool.retain(is_made);
        }
        cell.conditions = pool;
    }
    rows
}

/// Measurements of one recording: for every column, for every pair.
type Judged = Vec<Vec<Measurement>>;

/// Every condition with every seed.
fn measure_all(
    plan: &Plan,
    columns: &[Column],
    wanted: &[(&Condition, u32)],
    watch: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Vec<Judged>>, EvaluationError> {
    let mut jobs: Vec<(usize, u32)> = wanted
        .iter()
        .enumerate()
        .flat_map(|(index, (_, seeds))| (0..*seeds).map(move |repetition| (index, repetition)))
        .collect();
    // The longest first, so that no thread is left alone with one at the end.
    jobs.sort_by_key(|&(index, _)| std::cmp::Reverse(wanted[index].0.options.frames.unwrap_or(0)));
    let (next, done, failed) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let results: Mutex<Vec<Option<Result<Judged, EvaluationError>>>> =
        Mutex::new(std::iter::repeat_with(|| None).take(jobs.len()).collect());
    let work = || {
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(index, repetition)) = jobs.get(job) else { break };
            if failed.load(Ordering::Relaxed) {
                break;
            }
            let seed = plan.first_seed.wrapping_add(u64::from(repetition));
            let judged = measure(wanted[index].0, seed, columns);
            failed.fetch_or(judged.is_err(), Ordering::Relaxed);
            results.lock().unwrap_or_else(PoisonError::into_inner)[job] = Some(judged);
            watch(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len());
        }
    };
    // A detection would share its threads with others and its time count theirs; so each has one thread for itself.
    let threads = match plan.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let alone = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pools = (0..threads.min(jobs.len())).map(|_| alone()).collect::<Result<Vec<_>, _>>()?;
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| pool.install(work));
        }
    });
    let mut made: Vec<Vec<Judged>> = wanted.iter().map(|_| Vec::new()).collect();
    let mut results: Vec<_> =
        jobs.into_iter().zip(results.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
    results.sort_by_key(|(job, _)| *job);
    for ((index, _), judged) in results {
        if let Some(judged) = judged {
            made[index].push(judged?);
        }
    }
    Ok(made)
}

fn sum_up<'m>(
    row: &Row,
    columns: &[Column],
    times: bool,
    of_condition: &impl Fn(&Condition) -> Vec<&'m Judged>,
) -> RowResult {
    // Per cell and column.
    let measured: Vec<Vec<Vec<&Measurement>>> =
        row.cells.iter().map(|cell| measured(cell, columns, of_condition)).collect();
    let scores = |(index, cell): (usize, &Cell)| CellResult {
        name: cell.name.clone(),
        columns: columns
            .iter()
            .enumerate()
            .map(|(column, judge)| score(cell, judge, &measured[index][column], &measured[0][column], times))
            .collect(),
    };
    let cells: Vec<CellResult> = row.cells.iter().enumerate().map(scores).collect();
    let goals = row.goals().into_iter().map(|(goal, names)| judge_goal(goal, &names, &cells, columns.len())).collect();
    RowResult { name: row.name, title: row.title, measures: row.measures(), cells, goals }
}

/// What counts in a cell, for every column.
fn measured<'m>(
    cell: &Cell,
    columns: &[Column],
    of_condition: &impl Fn(&Condition) -> Vec<&'m Judged>,
) -> Vec<Vec<&'m Measurement>> {
    let judged: Vec<&Judged> = cell.conditions.iter().flat_map(of_condition).collect();
    let of_column = |column: usize| {
        let all = judged.iter().flat_map(|columns| &columns[column]);
        all.filter(|measurement| cell.selection.takes(measurement)).collect()
    };
    (0..columns.len()).map(of_column).collect()
}

fn score(cell: &Cell, column: &Column, all: &[&Measurement], first: &[&Measurement], times: bool) -> Scores {
    let scores = cell.measures.iter().filter_map(|&measure| {
        let score = measure.score(all, first, column.tells_types)?;
        score.value.is_finite().then_some((measure, score))
    });
    let measured = |measure| cell.measures.contains(&measure);
    let by_class_only = !measured(Measure::Types) && (measured(Measure::Classes) || measured(Measure::PairsRight));
    let by_types = column.tells_types && !by_class_only;
    let wrong = |m: &&&Measurement| {
        if by_types { m.found != m.expected } else { class(&m.found) != class(&m.expected) }
    };
    let wrong: Vec<&Measurement> = all.iter().filter(wrong).copied().collect();
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for m in &wrong {
        *counts.entry((&m.expected, &m.found)).or_default() += 1;
    }
    let mut confusions: Vec<Confusion> = counts
        .into_iter()
        .map(|((expected, found), count)| Confusion { expected: expected.into(), found: found.into(), count })
        .collect();
    confusions.sort_by_key(|confusion| std::cmp::Reverse(confusion.count));
    let mistake = |m: &Measurement| Mistake {
        scene: m.scene,
        seed: m.seed,
        expected: m.expected.clone(),
        found: m.found.clone(),
        confidence: m.confidence,
        determined: m.determined,
    };
    let seconds: f64 = all.iter().map(|m| m.seconds).sum();
    Scores {
        verdicts: all.len(),
        scores: scores.collect(),
        confusions,
        mistakes: wrong.into_iter().map(mistake).collect(),
        milliseconds: (times && !all.is_empty()).then(|| 1000.0 * seconds / all.len() as f64),
    }
}

fn judge_goal(goal: Goal, names: &[&str], cells: &[CellResult], columns: usize) -> GoalResult {
    let of_column = |column: usize| {
        let of_goal = cells.iter().filter(|cell| names.contains(&cell.name.as_str()));
        let scores: Vec<Option<Score>> =
            of_goal.map(|cell| cell.columns[column].scores.get(&goal.measure).copied()).collect();
        let whole = scores.iter().all(|score| score.is_some_and(|score| score.missing == 0));
        let values = scores.iter().flatten().map(|score| score.value);
        let worst = values.max_by(|a, b| goal.must.badness(*a).total_cmp(&goal.must.badness(*b)))?;
        Some((worst, if whole { goal.standing(worst) } else { Standing::Missed }))
    };
    let cells = names.iter().map(ToString::to_string).collect();
    GoalResult { goal, cells, columns: (0..columns).map(of_column).collect() }
}

#[cfg(test)]
pub(crate) mod tests {
    use jointscope_detection::Configuration;
    use jointscope_models::Catalog;
    use jointscope_scenes::SceneOptions;

    use super::*;
    use crate::{Bound, row};

    pub(crate) fn thesis(name: &str) -> Column {
        let catalog = Catalog::linked().expect("unique names");
        let text = include_str!("../../../configs/thesis.toml");
        Column::new(name, Configuration::parse(text, &catalog).expect("valid"))
    }

    fn tiny(scenes: &[&'static str]) -> Row {
        let options = SceneOptions { frames: Some(20), features: Some(6), ..SceneOptions::default() };
        let cell = Cell::new("tiny", scenes, &options).by(&[Measure::Types, Measure::Classes]).goal(
            Measure::Angle,
            Bound::AtMost(1.0),
            Bound::AtMost(0.5),
        );
        Row::new("T", "test", vec![cell])
    }

    fn plan(threads: usize) -> Plan {
        Plan { seeds: 3, first_seed: 5, threads, times: false }
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let columns = [thesis("one"), thesis("other")];
        let rows = [tiny(&["revolute", "prismatic"]), row("A16").expect("a row")];
        let rows = [rows[0].clone(), Row { cells: vec![tiny(&["revolute"]).cells.remove(0)], ..rows[1].clone() }];
        let [one, three] = [1, 3].map(|threads| evaluate(&plan(threads), &columns, &rows, &|_, _| ()).expect("scenes"));
        assert_eq!(one, three);
        let cell = &one.rows[0].cells[0].columns;
        assert_eq!((cell.len(), cell[0].verdicts, &cell[0]), (2, 6, &cell[1]));
        let calibration = &one.rows[1].cells[0].columns[0];
        assert_eq!(calibration.verdicts, 3, "a pooled row looks at what the others made");
    }

    #[test]
    fn seeds_follow_the_first_and_every_step_is_told() {
        let steps = Mutex::new(Vec::new());
        let watch = |done, of| steps.lock().expect("no panic").push((done, of));
        let evaluation = evaluate(&plan(1), &[thesis("thesis")], &[tiny(&["screw"])], &watch).expect("scenes");
        assert_eq!(steps.into_inner().expect("no panic"), [(1, 3), (2, 3), (3, 3)]);
        let mistakes = &evaluation.rows[0].cells[0].columns[0].mistakes;
        assert!(mistakes.iter().all(|mistake| (5..8).contains(&mistake.seed)));
    }

    #[test]
    fn a_condition_that_cannot_be_simulated_is_an_error_with_its_seed() {
        let options = SceneOptions { noise: Some(-1.0), ..SceneOptions::default() };
        let bad = Row::new("T", "test", vec![Cell::new("bad", &["rigid"], &options)]);
        let error = evaluate(&plan(2), &[thesis("thesis")], &[bad], &|_, _| ()).expect_err("negative noise");
        assert!(error.to_string().starts_with("scene `rigid` with seed "), "{error}");
    }

    fn cells(values: &[Option<(f64, usize)>]) -> Vec<CellResult> {
        let cell = |(index, score): (usize, &Option<(f64, usize)>)| {
            let scores = score.map(|(value, missing)| (Measure::Types, Score { value, missing })).into_iter().collect();
            let column = Scores { verdicts: 1, scores, confusions: vec![], mistakes: vec![], milliseconds: None };
            CellResult { name: index.to_string(), columns: vec![column] }
        };
        values.iter().enumerate().map(cell).collect()
    }

    #[test]
    fn the_worst_cell_decides_and_what_is_missing_is_missed() {
        let goal = Goal { measure: Measure::Types, must: Bound::AtLeast(95.0), aim: Bound::AtLeast(99.0) };
        let judged = |values: &[Option<(f64, usize)>]| judge_goal(goal, &["0", "1"], &cells(values), 1).columns[0];
        assert_eq!(judged(&[Some((99.5, 0)), Some((96.0, 0)), Some((0.0, 0))]), Some((96.0, Standing::Must)));
        assert_eq!(judged(&[Some((99.5, 0)), Some((99.0, 0))]), Some((99.0, Standing::Aim)));
        assert_eq!(judged(&[Some((99.5, 0)), None]), Some((99.5, Standing::Missed)));
        assert_eq!(judged(&[Some((99.5, 1)), Some((100.0, 0))]), Some((99.5, Standing::Missed)));
        assert_eq!(judged(&[None, None]), None);
    }

    #[test]
    fn a_column_of_four_joints_has_no_types_and_no_mistakes_within_a_class() {
        let evaluation =
            evaluate(&plan(1), &[thesis("thesis")], &[tiny(&["disconnected", "screw"])], &|_, _| ()).expect("scenes");
        let scores = &evaluation.rows[0].cells[0].columns[0];
        assert!(!scores.scores.contains_key(&Measure::Types) && scores.scores.contains_key(&Measure::Classes));
        assert!(scores.confusions.iter().all(|confusion| class(&confusion.found) != "other"));
    }
}
