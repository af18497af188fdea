//! The result as text, with tables that Markdown understands too.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets};

use crate::{Evaluation, GoalResult, Measure, Row, RowResult, Scores, Standing};

/// Confusions that are named; of more, the rest are counted.
const NAMED: usize = 4;

/// The rows that there are, with their goals.
pub fn list(rows: &[Row], seeds: u32) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["row", "recordings", "what it is about"]);
    for row in rows {
        table.add_row([row.name.to_owned(), row.recordings(seeds).to_string(), row.title.to_owned()]);
    }
    trimmed(&table)
}

/// The evaluation as text for the terminal.
pub fn to_text(evaluation: &Evaluation) -> String {
    let mut text = format!("{}\n", seeds(evaluation));
    for row in &evaluation.rows {
        let _ = write!(text, "\n{}  {}\n\n{}", row.name, row.title, tables(evaluation, row));
    }
    text + "\nStanding, of every row its worst goal\n\n" + &standings(evaluation)
}

/// Which seeds were used.
pub(crate) fn seeds(evaluation: &Evaluation) -> String {
    let last = evaluation.first_seed.wrapping_add(u64::from(evaluation.seeds) - 1);
    format!("seeds {} to {last}", evaluation.first_seed)
}

/// The table of a row's cells, and the table of its goals.
pub(crate) fn tables(evaluation: &Evaluation, row: &RowResult) -> String {
    let goals = if row.goals.is_empty() { String::new() } else { format!("\n{}", goals(evaluation, row)) };
    cells(evaluation, row) + &goals
}

fn cells(evaluation: &Evaluation, row: &RowResult) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let timed = row.cells.iter().flat_map(|cell| &cell.columns).any(|scores| scores.milliseconds.is_some());
    let measures = row.measures.iter().map(|measure| measure.title());
    let time = timed.then_some("ms");
    table.set_header(["condition", "column", "verdicts"].into_iter().chain(measures).chain(time).chain(["mistakes"]));
    for cell in &row.cells {
        for (index, scores) in cell.columns.iter().enumerate() {
            let name = if index == 0 { cell.name.clone() } else { String::new() };
            let head = [name, evaluation.columns[index].clone(), scores.verdicts.to_string()];
            let measures = row.measures.iter().map(|measure| value(scores, *measure));
            let time = timed.then(|| scores.milliseconds.map_or_else(dash, |time| format!("{time:.2}")));
            table.add_row(head.into_iter().chain(measures).chain(time).chain([mistakes(scores)]));
        }
    }
    let numbers = 1 + row.measures.len() + usize::from(timed);
    right(&mut table, 2..2 + numbers);
    trimmed(&table)
}

fn dash() -> String {
    "-".into()
}

fn value(scores: &Scores, measure: Measure) -> String {
    let Some(score) = scores.scores.get(&measure) else { return dash() };
    let value = decimal(score.value, measure.decimals());
    if score.missing == 0 { value } else { format!("{value} ({} missing)", score.missing) }
}

/// A number with so many decimals; one with many digits before them needs none.
fn decimal(value: f64, decimals: usize) -> String {
    if value.abs() >= 1e6 { format!("{value:.1e}") } else { format!("{value:.decimals$}") }
}

fn mistakes(scores: &Scores) -> String {
    let named = scores.confusions.iter().take(NAMED);
    let named = named.map(|confusion| format!("{}->{} {}", confusion.expected, confusion.found, confusion.count));
    let rest: usize = scores.confusions.iter().skip(NAMED).map(|confusion| confusion.count).sum();
    let rest = (rest > 0).then(|| format!("others {rest}"));
    named.chain(rest).collect::<Vec<_>>().join(", ")
}

fn goals(evaluation: &Evaluation, row: &RowResult) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let head = ["goal", "where", "must", "aim"].map(String::from);
    table.set_header(head.into_iter().chain(evaluation.columns.iter().cloned()));
    for GoalResult { goal, cells, columns } in &row.goals {
        let everywhere = cells.len() == row.cells.len();
        let place = if everywhere { "everywhere".to_owned() } else { cells.join("; ") };
        let head = [goal.measure.title().to_owned(), place, goal.must.to_string(), goal.aim.to_string()];
        let stands = |stands: &Option<(f64, Standing)>| {
            stands.map_or_else(dash, |(value, standing)| {
                format!("{} {standing}", decimal(value, goal.measure.decimals()))
            })
        };
        table.add_row(head.into_iter().chain(columns.iter().map(stands)));
    }
    let columns = 4 + evaluation.columns.len();
    right(&mut table, 4..columns);
    trimmed(&table)
}

/// How every column stands in every row that has goals.
pub(crate) fn standings(evaluation: &Evaluation) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let head = ["row", "about"].map(String::from);
    table.set_header(head.into_iter().chain(evaluation.columns.iter().cloned()));
    for row in evaluation.rows.iter().filter(|row| !row.goals.is_empty()) {
        let standings = (0..evaluation.columns.len()).map(|column| row.standing(column));
        let standings = standings.map(|standing| standing.map_or_else(dash, |standing| standing.to_string()));
        table.add_row([row.name.to_owned(), row.title.to_owned()].into_iter().chain(standings));
    }
    trimmed(&table)
}

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// A table's lines without the blanks that fill its last column.
fn trimmed(table: &Table) -> String {
    table.lines().fold(String::new(), |text, line| text + line.trim_end() + "\n")
}
