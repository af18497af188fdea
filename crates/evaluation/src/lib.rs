//! How well joints are found: a benchmark over simulated conditions.
//!
//! A [`Row`] is a question, such as "does the type come out right under much noise?". It has [`Cell`]s, one per
//! condition, each a set of scenes that are simulated and detected for many seeds; and goals, bounds on what is
//! measured. [`evaluate`] answers rows for several [`Column`]s, detectors to be compared on the same recordings.
//!
//! ```
//! use jointscope_detection::Configuration;
//! use jointscope_evaluation::{Column, Plan, evaluate, row, to_text};
//! use jointscope_models::Catalog;
//!
//! let configuration = Configuration::parse("", &Catalog::linked()?)?;
//! let columns = [Column::new("default", configuration)];
//! let rows = [row("A2").expect("there is such a row")];
//! let plan = Plan { seeds: 2, first_seed: 1, threads: 1, times: false };
//! let evaluation = evaluate(&plan, &columns, &rows, &|_, _| ())?;
//! assert!(to_text(&evaluation).contains("revolute axis"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what it knows |
//! |---|---|
//! | `row`, `rows` | the conditions, and the table of them |
//! | `goal`, `measure` | what is measured, and what it should be |
//! | `joint_class`, `axis_error` | when a type is right, and how far off an axis is |
//! | `measurement` | one recording, simulated and judged |
//! | `evaluation` | all of them, in parallel, summed up |
//! | `text`, `markdown`, `json`, `picture` | what is printed |

mod axis_error;
mod column;
mod error;
mod evaluation;
mod goal;
mod joint_class;
mod json;
mod markdown;
mod measure;
mod measurement;
mod picture;
mod row;
mod rows;
mod text;

pub use axis_error::AxisError;
pub use column::Column;
pub use error::EvaluationError;
pub use evaluation::{CellResult, Confusion, Evaluation, GoalResult, Mistake, Plan, RowResult, Scores, evaluate};
pub use goal::{Bound, Goal, Standing};
pub use joint_class::{TYPES, class};
pub use json::to_json;
pub use markdown::to_markdown;
pub use measure::Measure;
pub use picture::{picture, to_svg};
pub use row::{Cell, Condition, Procedure, Row};
pub use rows::{row, rows};
pub use text::{list, to_text};
