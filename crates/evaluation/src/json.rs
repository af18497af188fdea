//! The result as JSON, for programs.

use crate::Evaluation;

/// The evaluation as JSON, with every mistake.
///
/// Scores are keyed by measure: shares in percent, angles in degrees, distances and times in milli-units, as
/// [`crate::Measure`] says.
pub fn to_json(evaluation: &Evaluation) -> String {
    let json = serde_json::to_string_pretty(evaluation);
    // Maps have names as keys and numbers are finite, so nothing can fail.
    json.map_or_else(|error| format!("{{\"error\": \"{error}\"}}\n"), |json| json + "\n")
}
