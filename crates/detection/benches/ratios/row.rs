//! A row: a goal, and what was measured.

use crate::alternation::Spread;

/// What a number must be.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Wanted {
    AtMost(f64),
    AtLeast(f64),
    /// Nothing: the number is for information.
    Nothing,
}

/// A number of a goal.
pub(crate) struct Row {
    /// `S1` say.
    pub goal: &'static str,
    pub what: String,
    pub wanted: Wanted,
    /// `×`, `ms` or `s`.
    pub unit: &'static str,
    pub measured: Spread,
    /// Why the number does not count, if so.
    pub fault: Option<String>,
    /// What keeps it from being better.
    pub bound: &'static str,
}

impl Row {
    /// As a line of the table.
    pub(crate) fn line(&self) -> String {
        let Self { goal, what, unit, measured, .. } = self;
        let wanted = match self.wanted {
            Wanted::AtMost(most) => format!("≤ {most} {unit}"),
            Wanted::AtLeast(least) => format!("≥ {least} {unit}"),
            Wanted::Nothing => String::new(),
        };
        let [median, low, high] = [measured.median, measured.low, measured.high].map(short);
        format!("| {goal} | {what} | {wanted} | {median} {unit} ({low} to {high}) | {} |", self.verdict())
    }

    fn verdict(&self) -> String {
        if let Some(fault) = &self.fault {
            return format!("does not count: {fault}");
        }
        let missed = match self.wanted {
            Wanted::AtMost(most) => self.measured.median / most,
            Wanted::AtLeast(least) => least / self.measured.median,
            Wanted::Nothing => return self.bound.into(),
        };
        if missed <= 1.0 { "met".into() } else { format!("missed by {} ×: {}", short(missed), self.bound) }
    }
}

/// Three digits.
pub(crate) fn short(number: f64) -> String {
    let decimals = if number >= 99.95 {
        0
    } else if number >= 9.995 {
        1
    } else {
        2
    };
    format!("{number:.decimals$}")
}
