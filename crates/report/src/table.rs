//! The result as a table for the terminal.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use jointscope_detection::{Detection, PairDetection};
use jointscope_models::Positions;

use crate::{printable, tree};

/// Pairs that are named above their common notes; of more, the number is given.
const NAMED_PAIRS: usize = 4;

/// The detection as a table with one row per pair, followed by the mechanism and the notes.
///
/// *Convention.* Lengths in metres, angles in degrees. A `?` behind a joint means that it is not determined. A note
/// that several pairs have in common is given once, under the names of the pairs.
pub fn to_table(detection: &Detection) -> String {
    let bodies = count(detection.bodies.len(), "body", "bodies");
    let frames = count(detection.frames, "frame", "frames");
    let duration = detection.duration.map_or_else(String::new, |duration| format!(", {} s", number(duration, 2)));
    let mut text = format!("{bodies}, {frames}{duration}\n\n");
    let Some(first) = detection.pairs.first() else { return text + "no pair to judge\n" };

    let joints: Vec<String> = first.verdict.confidences.iter().map(|(joint, _)| printable(joint)).collect();
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    let head = ["reference", "moving", "joint"].map(String::from).into_iter();
    let tail = ["axis direction", "axis point [m]", "positions"].map(String::from);
    table.set_header(head.chain(joints.iter().cloned()).chain(tail));
    let cells: [fn(&PairDetection) -> Vec<String>; 3] = [direction, point, ranges];
    let [directions, points, positions] =
        cells.map(|words| aligned(&detection.pairs.iter().map(words).collect::<Vec<_>>()));
    for (index, pair) in detection.pairs.iter().enumerate() {
        let joint = format!("{}{}", printable(&pair.verdict.joint), if pair.determined { "" } else { " ?" });
        let names = [printable(&pair.reference), printable(&pair.moving), joint];
        let confidences = pair.verdict.confidences.iter().map(|(_, confidence)| format!("{confidence:.3}"));
        let places = [&directions, &points, &positions].map(|column| column[index].clone());
        table.add_row(names.into_iter().chain(confidences).chain(places));
    }
    for column in 3..3 + joints.len() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for line in table.lines() {
        text += line.trim_end();
        text.push('\n');
    }
    if detection.pairs.iter().any(|pair| !pair.determined) {
        text += "\n? not determined: the notes say why\n";
    }
    text + &tree::to_lines(detection) + &notes(&detection.pairs)
}

fn count(n: usize, one: &str, several: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { several })
}

/// A number with so many decimals: never a negative zero, and short even if it is huge.
fn number(x: f64, decimals: usize) -> String {
    /// From here on decimals mean nothing, and digits only fill the line.
    const HUGE: f64 = 1e7;
    if x.abs() >= HUGE {
        return format!("{x:.3e}");
    }
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|digit| matches!(digit, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

/// Lines up the words of a column's cells: numbers to the right, others to the left. A cell without words is a dash.
fn aligned(cells: &[Vec<String>]) -> Vec<String> {
    let length = cells.iter().map(Vec::len).max().unwrap_or(0);
    let width = |word: usize| cells.iter().filter_map(|cell| cell.get(word)).map(String::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..length).map(width).collect();
    let line_up = |words: &Vec<String>| {
        if words.is_empty() {
            return "-".to_owned();
        }
        let padded = words.iter().zip(&widths).map(|(word, width)| {
            if word.ends_with(|last: char| last.is_ascii_digit()) {
                format!("{word:>width$}")
            } else {
                format!("{word:<width$}")
            }
        });
        padded.collect::<Vec<_>>().join(" ").trim_end().to_owned()
    };
    cells.iter().map(line_up).collect()
}

fn coordinates(xyz: [f64; 3]) -> Vec<String> {
    // Room for a sign, so that columns seldom shift.
    xyz.map(|x| format!("{:>6}", number(x, 3))).into()
}

fn direction(pair: &PairDetection) -> Vec<String> {
    let direction = pair.axis.and_then(|axis| axis.direction);
    direction.map_or_else(Vec::new, |direction| coordinates(direction.into_inner().into()))
}

fn point(pair: &PairDetection) -> Vec<String> {
    pair.axis.map_or_else(Vec::new, |axis| coordinates(axis.point.coords.into()))
}

/// From least to greatest position, in degrees where the joint turns: all positions about a point or with a pitch, the
/// first of several about an axis.
fn ranges(pair: &PairDetection) -> Vec<String> {
    let (Some(axis), Some(ranges)) = (pair.axis, pair.positions.as_ref().and_then(Positions::ranges)) else {
        return Vec::new();
    };
    let freedoms = ranges.len();
    let range = |(index, [least, most]): (usize, [f64; 2])| {
        let turns = axis.pitch.is_some() || axis.direction.is_none() || (index == 0 && freedoms > 1);
        let (unit, [least, most]) = if turns {
            ("deg", [least, most].map(|angle| number(angle.to_degrees(), 1)))
        } else {
            ("m", [least, most].map(|length| number(length, 3)))
        };
        let comma = if index + 1 < freedoms { "," } else { "" };
        [least, "..".into(), most, format!("{unit}{comma}")]
    };
    ranges.into_iter().enumerate().flat_map(range).collect()
}

/// The notes of all pairs, each once, with the pairs that it is about.
fn notes(pairs: &[PairDetection]) -> String {
    let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
    let mut group_of_note = std::collections::HashMap::new();
    for (index, pair) in pairs.iter().enumerate() {
        for note in &pair.notes {
            let group = *group_of_note.entry(note.as_str()).or_insert_with(|| {
                groups.push((note, Vec::new()));
                groups.len() - 1
            });
            if groups[group].1.last() != Some(&index) {
                groups[group].1.push(index);
            }
        }
    }
    let mut text = String::new();
    let mut above: &[usize] = &[];
    for (note, of) in &groups {
        if of != above {
            text.push('\n');
            text += &heading(pairs, of);
            text.push('\n');
            above = of;
        }
        text += "  ";
        text += &printable(note);
        text.push('\n');
    }
    text
}

/// Names the pairs that notes are about, if they are few enough.
fn heading(pairs: &[PairDetection], of: &[usize]) -> String {
    let name = |&index: &usize| printable(&format!("{} - {}", pairs[index].reference, pairs[index].moving));
    let named = of.iter().take(NAMED_PAIRS).map(name).collect::<Vec<_>>().join(", ");
    match of.len().saturating_sub(NAMED_PAIRS) {
        0 => named,
        others => format!("{named} and {}", count(others, "other pair", "other pairs")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_no_sign_and_huge_numbers_stay_short() {
        assert_eq!([-0.0, -0.0004, 0.0004, -0.0006].map(|x| number(x, 3)), ["0.000", "0.000", "0.000", "-0.001"]);
        assert_eq!(number(-1.25e40, 3), "-1.250e40");
        assert_eq!(number(-9_999_999.0, 1), "-9999999.0");
    }

    #[test]
    fn numbers_line_up_under_each_other_whatever_their_length() {
        let cell = |words: &str| words.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let column = aligned(&[cell("0.0 .. 63.0 deg"), vec![], cell("-120.5 .. 0.0 deg"), cell("1.000 .. 2.000 m")]);
        assert_eq!(column, ["   0.0 ..  63.0 deg", "-", "-120.5 ..   0.0 deg", " 1.000 .. 2.000 m"]);
    }
}
