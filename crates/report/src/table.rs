//! The result as a table for the terminal.

use comfy_table::{Attribute, Cell, CellAlignment, Color, ContentArrangement, Table, presets};
use jointscope_detection::{Detection, JointKind, PairDetection};
use jointscope_models::Positions;

use crate::{printable, tree};

/// Pairs that are named above their common notes; of more, the number is given.
const NAMED_PAIRS: usize = 4;

/// How a table is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Style {
    /// Columns of the terminal, which the table keeps to by leaving out what is least needed; `None` for no limit.
    pub width: Option<usize>,
    /// Whether colours are shown.
    pub colour: bool,
}

/// The detection as a table with one row per pair, followed by the mechanism and the notes.
///
/// *Convention.* Lengths in metres, angles in degrees. A `?` behind a joint means that it is not determined. A note
/// that several pairs have in common is given once, under the names of the pairs.
pub fn to_table(detection: &Detection) -> String {
    to_styled_table(detection, Style::default())
}

/// As [`to_table`], in colours, and within the width of a terminal: a table that is too wide has the verdict's confidence
/// only, or else no axes, or else a line for every pair.
pub fn to_styled_table(detection: &Detection, style: Style) -> String {
    let bodies = count(detection.bodies.len(), "body", "bodies");
    let frames = count(detection.frames, "frame", "frames");
    let duration = detection.duration.map_or_else(String::new, |duration| format!(", {} s", number(duration, 2)));
    let mut text = format!("{bodies}, {frames}{duration}\n\n");
    if detection.pairs.is_empty() {
        return text + "no pair to judge\n";
    }
    let fits = |shown: &Shown| {
        let lines = table(detection, shown, Style { colour: false, ..style });
        style.width.is_none_or(|width| lines.iter().all(|line| line.chars().count() <= width))
    };
    let shown = [Shown { all: true, axes: true }, Shown { all: false, axes: true }, Shown { all: false, axes: false }];
    let lines = match shown.into_iter().find(fits) {
        Some(shown) => table(detection, &shown, style),
        None => lines(detection, style),
    };
    for line in lines {
        text += line.trim_end();
        text.push('\n');
    }
    if detection.pairs.iter().any(|pair| !pair.determined) {
        text += "\n? not determined: the notes say why\n";
    }
    text + &tree::to_lines(detection) + &notes(&detection.pairs)
}

/// What of a table is shown.
struct Shown {
    /// Whether the confidences of all joints are shown, or only the verdict's.
    all: bool,
    axes: bool,
}

fn table(detection: &Detection, shown: &Shown, style: Style) -> Vec<String> {
    let joints: Vec<String> = match detection.pairs.first() {
        Some(first) if shown.all => first.verdict.confidences.iter().map(|(joint, _)| printable(joint)).collect(),
        _ => vec!["confidence".into()],
    };
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    if style.colour {
        table.enforce_styling();
    }
    let tail: &[&str] = if shown.axes { &["axis direction", "axis point [m]", "positions"] } else { &["positions"] };
    let head = ["reference", "moving", "joint"].into_iter().map(String::from).chain(joints.iter().cloned());
    let head = head.chain(tail.iter().map(ToString::to_string)).map(|word| styled(word, style, &[Attribute::Bold]));
    table.set_header(head);
    let cells: &[fn(&PairDetection) -> Vec<String>] = if shown.axes { &[direction, point, ranges] } else { &[ranges] };
    let places: Vec<Vec<String>> =
        cells.iter().map(|words| aligned(&detection.pairs.iter().map(words).collect::<Vec<_>>())).collect();
    for (index, pair) in detection.pairs.iter().enumerate() {
        let names = [&pair.reference, &pair.moving].map(|name| Cell::new(printable(name)));
        let confidence = |joint: &str, confidence: f64| {
            let emphasis = if joint == pair.verdict.joint { Attribute::Bold } else { Attribute::Dim };
            styled(format!("{confidence:.3}"), style, &[emphasis])
        };
        let confidences: Vec<Cell> = if shown.all {
            pair.verdict.confidences.iter().map(|(joint, value)| confidence(joint, *value)).collect()
        } else {
            vec![confidence(&pair.verdict.joint, pair.verdict.confidence)]
        };
        let places = places.iter().map(|column| Cell::new(&column[index]));
        table.add_row(names.into_iter().chain([verdict(pair, style)]).chain(confidences).chain(places));
    }
    for column in 3..3 + joints.len() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.lines().collect()
}

fn verdict(pair: &PairDetection, style: Style) -> Cell {
    let joint = format!("{}{}", printable(&pair.verdict.joint), if pair.determined { "" } else { " ?" });
    let colour = match (pair.determined, pair.kind()) {
        (false, _) => Color::DarkYellow,
        (true, JointKind::Disconnected) => Color::Reset,
        (true, _) => Color::DarkGreen,
    };
    let cell = Cell::new(joint);
    if style.colour { cell.fg(colour) } else { cell }
}

fn styled(text: String, style: Style, attributes: &[Attribute]) -> Cell {
    let cell = Cell::new(text);
    if style.colour { cell.add_attributes(attributes.to_vec()) } else { cell }
}

/// A line for every pair.
fn lines(detection: &Detection, style: Style) -> Vec<String> {
    let line = |pair: &PairDetection| {
        let joint = format!("{}{}", printable(&pair.verdict.joint), if pair.determined { "" } else { " ?" });
        let joint = if style.colour { format!("\u{1b}[1m{joint}\u{1b}[0m") } else { joint };
        let positions = ranges(pair).join(" ");
        let comma = if positions.is_empty() { "" } else { ", " };
        format!(
            "{} - {}: {joint} {:.3}{comma}{positions}",
            printable(&pair.reference),
            printable(&pair.moving),
            pair.verdict.confidence
        )
    };
    detection.pairs.iter().map(line).collect()
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
    use jointscope_detection::{Configuration, Detector};
    use jointscope_models::Catalog;
    use jointscope_scenes::{SceneOptions, simulate};

    use super::*;

    #[test]
    fn a_table_keeps_to_the_width_and_says_the_verdict_in_any() {
        let recording = simulate("drawers", &SceneOptions::default()).expect("a scene").recording;
        let configuration = Configuration::parse("", &Catalog::linked().expect("unique names")).expect("valid");
        let detection = Detector::new(configuration).detect(recording, None).expect("bodies");
        let table = |width| to_styled_table(&detection, Style { width: Some(width), colour: false });
        assert_eq!(table(1000), to_table(&detection));
        for width in [200, 150, 100, 80] {
            let text = table(width);
            let rows: Vec<&str> = text.lines().skip(2).take_while(|line| !line.is_empty()).collect();
            assert!(rows.iter().all(|row| row.chars().count() <= width), "{width}: {text}");
            assert_eq!(
                rows.iter().filter(|row| row.contains("prismatic") && row.contains("drawer")).count(),
                3,
                "{text}"
            );
        }
        // Narrower than that, every pair is a line.
        assert!(table(60).contains("frame - top-drawer: prismatic 0.99"));
        let coloured = to_styled_table(&detection, Style { width: None, colour: true });
        assert!(coloured.contains("\u{1b}[") && !table(1000).contains('\u{1b}'));
    }

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
