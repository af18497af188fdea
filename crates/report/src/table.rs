//! The result as a table for the terminal.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use jointscope_detection::{Detection, PairDetection};

/// The detection as a table with one row per pair, followed by the notes.
///
/// *Convention.* Lengths in metres, angles in degrees. A `?` behind a joint means that the data do not decide.
pub fn to_table(detection: &Detection) -> String {
    let count = |n: usize, word: &str| format!("{n} {word}{}", if n == 1 { "" } else { "s" });
    let mut text = format!(
        "{}, {}",
        count(detection.bodies.len(), "body").replace("bodys", "bodies"),
        count(detection.frames, "frame")
    );
    if let Some(duration) = detection.duration {
        text += &format!(", {duration:.2} s");
    }
    text += "\n\n";
    let Some(first) = detection.pairs.first() else { return text + "no pair to judge\n" };

    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    let joints = first.verdict.confidences.iter().map(|(joint, _)| joint.clone());
    let head = ["reference", "moving", "joint"].map(String::from).into_iter();
    table.set_header(head.chain(joints).chain(["axis direction", "axis point [m]", "positions"].map(String::from)));
    for pair in &detection.pairs {
        table.add_row(row(pair));
    }
    for column in 3..3 + first.verdict.confidences.len() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for line in table.lines() {
        text += line.trim_end();
        text.push('\n');
    }
    let noted = detection.pairs.iter().filter(|pair| !pair.notes.is_empty());
    for (index, pair) in noted.enumerate() {
        text += if index == 0 { "\nnotes\n" } else { "" };
        for note in &pair.notes {
            text += &format!(" {} - {}: {note}\n", pair.reference, pair.moving);
        }
    }
    text
}

fn row(pair: &PairDetection) -> Vec<String> {
    let joint = format!("{}{}", pair.verdict.joint, if pair.determined { "" } else { " ?" });
    let mut row = vec![pair.reference.clone(), pair.moving.clone(), joint];
    row.extend(pair.verdict.confidences.iter().map(|(_, confidence)| format!("{confidence:.3}")));
    let numbers = |v: [f64; 3]| v.map(|x| format!("{:>6}", format!("{:.3}", x + 0.0))).join(" ");
    let direction = pair.axis.and_then(|axis| axis.direction);
    row.push(direction.map_or_else(|| "-".into(), |d| numbers(d.into_inner().into())));
    row.push(pair.axis.map_or_else(|| "-".into(), |axis| numbers(axis.point.coords.into())));
    row.push(ranges(pair).unwrap_or_else(|| "-".into()));
    row
}

/// From least to greatest position, in degrees where the joint turns.
fn ranges(pair: &PairDetection) -> Option<String> {
    let turns = pair.axis?.pitch.is_some();
    let range = |[least, most]: [f64; 2]| {
        if turns {
            format!("{:.1} .. {:.1} deg", least.to_degrees(), most.to_degrees())
        } else {
            format!("{least:.3} .. {most:.3} m")
        }
    };
    Some(pair.positions.as_ref()?.ranges()?.into_iter().map(range).collect::<Vec<_>>().join(", "))
}
