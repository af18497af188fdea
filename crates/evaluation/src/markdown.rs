//! The result as a page.

use std::fmt::Write;

use crate::{
    Evaluation,
    text::{seeds, standings, tables},
};

/// The evaluation as the page `docs/accuracy.md`, with the commands that make it and the picture beside it,
/// `accuracy.svg`.
pub fn to_markdown(evaluation: &Evaluation, page_command: &str, picture_command: &str) -> String {
    let mut page = format!(
        "# Accuracy\n\n\
         Measured on simulated scenes, {}, by\n\n\
         ```sh\n{page_command} > accuracy.md\n{picture_command} > accuracy.svg\n```\n\n\
         ![Share of right joints against noise](accuracy.svg)\n\n\
         The nominal scene: two bodies that both move, 20 features each in cubes of 15 cm, those of \
         the base about the joint and those of the part 15 cm from its axis, 50 frames, a sweep of 45 degrees or 118 mm, noise of 3 mm per coordinate. Every condition says what differs.\n\n\
         * *types*: right among rigid, prismatic, revolute, screw, cylindrical, planar, spherical and disconnected.\n\
         * *classes*: right among rigid, prismatic, revolute and other; the mean over the classes, so that always \
         answering with one of them is right in 25 %. *classified*: the same over all verdicts alike.\n\
         * *angle*, *distance*: of the fitted revolute axis from the true one, root mean square, the distance at the \
         moving body, in the coordinates of the first frame; where bodies are seen as poses, in those of their tracker.\n\
         * *mistakes*: true joint, joint found, how often.\n\
         * *must* and *aim* are the goals, judged by the worst of their conditions; a dash is what cannot be measured.\n\n\
         ## Standing\n\n{}",
        seeds(evaluation),
        standings(evaluation)
    );
    for row in &evaluation.rows {
        let _ = write!(page, "\n## {}: {}\n\n{}", row.name, row.title, tables(evaluation, row));
    }
    page
}
