//! The mechanism as lines of text.

use std::fmt::Write;

use jointscope_detection::Detection;

use crate::{
    printable,
    words::{coupled, follows},
};

/// Bodies from which a tree tells more than the table, and up to which it fits a terminal.
const BODIES: std::ops::RangeInclusive<usize> = 3..=40;
/// Pairs beside the tree that are explained one by one.
const EXPLAINED: usize = 12;

/// The tree of bodies with their joints, and what follows from it; empty where the table says it all.
pub(crate) fn to_lines(detection: &Detection) -> String {
    let joined = detection.structure.branches.iter().any(|branch| branch.pair.is_some());
    if !BODIES.contains(&detection.bodies.len()) || !joined {
        return String::new();
    }
    let structure = &detection.structure;
    let mut text = format!("\nmechanism\n {}\n", printable(&detection.bodies[structure.base]));
    below(detection, structure.base, " ", &mut text);
    let sentences: Vec<String> = structure.indirect.iter().filter_map(|pair| follows(detection, pair)).collect();
    let coupled = structure.couplings.iter().map(|coupling| coupled(detection, coupling));
    for sentence in sentences.iter().take(EXPLAINED).cloned().chain(coupled) {
        let _ = writeln!(text, "  {}", printable(&sentence));
    }
    if sentences.len() > EXPLAINED {
        let _ = writeln!(text, "  and {} other pairs likewise", sentences.len() - EXPLAINED);
    }
    text
}

fn below(detection: &Detection, parent: usize, indent: &str, text: &mut String) {
    let children: Vec<_> = detection.structure.branches.iter().filter(|branch| branch.parent == parent).collect();
    for (number, branch) in children.iter().enumerate() {
        let last = number + 1 == children.len();
        let name = printable(&detection.bodies[branch.child]);
        let joint = branch.pair.map_or_else(
            || "not connected".to_owned(),
            |pair| {
                let pair = &detection.pairs[pair];
                format!("{}{}", printable(&pair.verdict.joint), if pair.determined { "" } else { " ?" })
            },
        );
        let _ = writeln!(text, "{indent}{} {name}: {joint}", if last { "└─" } else { "├─" });
        below(detection, branch.child, &format!("{indent}{}  ", if last { " " } else { "│" }), text);
    }
}
