//! The result as JSON, for programs.

use serde::Serialize;

use crate::Evaluation;

/// The evaluation as JSON text with every wrong verdict, ending with a newline.
///
/// *Convention.* Scores are keyed by measure and have its unit, see [`crate::Measure`]: shares in percent, angles in
/// degrees, distances in millimetres. A measure that could not be taken has no key. The lists called `columns` are in
/// the order of the columns' names; a column without standing in a goal has null there.
///
/// # Panics
/// Never: all keys are strings, and every number has a text.
pub fn to_json(evaluation: &Evaluation) -> String {
    let result = Result { format: "jointscope-evaluation", version: 1, evaluation };
    let mut text = serde_json::to_string_pretty(&result).expect("keys are strings, and non-finite numbers become null");
    text.push('\n');
    text
}

#[derive(Serialize)]
struct Result<'e> {
    format: &'static str,
    version: u32,
    #[serde(flatten)]
    evaluation: &'e Evaluation,
}
