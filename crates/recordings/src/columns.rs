//! The header of a table: which column holds what.

use std::borrow::Cow;

use crate::text::{number, quoted, trimmed};

/// Every column a table may have.
const KNOWN: [&str; 11] = ["frame", "time", "body", "feature", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// How alike (Jaro-Winkler, 0 to 1) a column must be to a known one to be taken for a misspelling of it.
const ALIKE: f64 = 0.75;

/// Where the cells of a table are.
#[derive(Debug, PartialEq)]
pub(crate) struct Columns {
    /// Names of all columns, in the file's order.
    pub names: Vec<String>,
    pub frame: usize,
    pub time: Option<usize>,
    pub body: usize,
    pub content: Content,
}

/// What a table is about; any quaternion column makes it a table of poses.
#[derive(Debug, PartialEq)]
pub(crate) enum Content {
    Points { feature: usize, position: [usize; 3] },
    Poses { values: [usize; 7] },
}

impl Columns {
    /// Finds the columns by their names, in any order and case.
    pub(crate) fn of_header<'a>(header: impl IntoIterator<Item = &'a str>) -> Result<Self, String> {
        let names: Vec<String> = header.into_iter().map(|name| name.trim().to_lowercase()).collect();
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err("needed a header with the names of the columns, found numbers; \
                        begin with frame,time,body,feature,x,y,z or frame,time,body,x,y,z,qx,qy,qz,qw"
                .into());
        }
        for (index, name) in names.iter().enumerate() {
            if !KNOWN.contains(&name.as_str()) {
                return Err(unknown(name, index));
            }
            if let Some(first) = names[..index].iter().position(|other| other == name) {
                let (first, second) = (first + 1, index + 1);
                return Err(format!("columns {first} and {second} are both named `{name}`; keep one of them"));
            }
        }
        let find = |name: &str| names.iter().position(|other| other == name);
        let need = |name: &str| find(name).ok_or_else(|| missing(name, &names));
        let content = if let Some(rotation) = names.iter().find(|name| name.starts_with('q')) {
            if find("feature").is_some() {
                return Err(format!(
                    "column `{rotation}` makes this a table of poses, column `feature` one of points; \
                     leave one out, or write two files"
                ));
            }
            let [x, y, z] = [need("x")?, need("y")?, need("z")?];
            Content::Poses { values: [x, y, z, need("qx")?, need("qy")?, need("qz")?, need("qw")?] }
        } else {
            Content::Points { feature: need("feature")?, position: [need("x")?, need("y")?, need("z")?] }
        };
        let (frame, time, body) = (need("frame")?, find("time"), need("body")?);
        Ok(Self { names, frame, time, body, content })
    }

    /// The numbers in some cells of a row that has all columns; NaN where a cell is empty.
    pub(crate) fn numbers<const N: usize>(&self, row: &[Cow<'_, str>], cells: [usize; N]) -> Result<[f64; N], String> {
        let mut values = [f64::NAN; N];
        for (value, cell) in values.iter_mut().zip(cells) {
            *value = number(trimmed(&row[cell])).map_err(|problem| self.at(cell, &problem))?;
        }
        Ok(values)
    }

    /// A problem with the name of its column.
    pub(crate) fn at(&self, column: usize, problem: &str) -> String {
        format!("column `{}`: {problem}", self.names[column])
    }
}

/// The name of a body or feature in a cell.
pub(crate) fn name<'a>(cell: &'a str, what: &str) -> Result<&'a str, String> {
    match trimmed(cell) {
        "" => Err(format!("column `{what}`: needed a name, found an empty cell; name the {what} in every row")),
        name => Ok(name),
    }
}

fn unknown(name: &str, index: usize) -> String {
    if name.is_empty() {
        return format!("column {} has no name; known columns are {}", index + 1, KNOWN.join(", "));
    }
    let alike = |known: &&str| strsim::jaro_winkler(name, known);
    let nearest = KNOWN.iter().max_by(|a, b| alike(a).total_cmp(&alike(b))).filter(|known| alike(known) >= ALIKE);
    let advice = nearest.map_or_else(
        || "give it the name of what it holds, or remove it; docs/formats.md has the columns".to_owned(),
        |known| format!("did you mean `{known}`?"),
    );
    format!("column {} is unknown; known columns are {}; {advice}", quoted(name), KNOWN.join(", "))
}

fn missing(name: &str, found: &[String]) -> String {
    format!("column `{name}` is missing, found only {}; add it to the header and to every row", found.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Result<Columns, String> {
        Columns::of_header(names.iter().copied())
    }

    #[test]
    fn names_decide_the_order_and_the_content() {
        let points = of(&["Z", " y", "x ", "FEATURE", "body", "frame"]).expect("points");
        assert_eq!(points.content, Content::Points { feature: 3, position: [2, 1, 0] });
        assert_eq!((points.names.len(), points.frame, points.time, points.body), (6, 5, None, 4));
        let poses = of(&["frame", "time", "body", "x", "y", "z", "qw", "qx", "qy", "qz"]).expect("poses");
        assert_eq!(poses.content, Content::Poses { values: [3, 4, 5, 7, 8, 9, 6] });
        assert_eq!(poses.time, Some(1));
    }

    #[test]
    fn a_mistyped_column_is_refused_with_the_nearest_name() {
        let refused = of(&["frame", "tme", "body", "feature", "x", "y", "z"]).expect_err("a typing error");
        assert!(refused.starts_with("column `tme` is unknown; known columns are frame, time, body"), "{refused}");
        assert!(refused.ends_with("did you mean `time`?"), "{refused}");
        assert!(of(&["frame", "colour"]).expect_err("no such column").contains("or remove it"));
        assert!(of(&["frame", ""]).expect_err("no name").starts_with("column 2 has no name"));
    }

    #[test]
    fn missing_and_repeated_columns_and_numbers_are_refused() {
        let refused = of(&["frame", "body", "feature", "x", "y"]).expect_err("no z");
        assert!(refused.starts_with("column `z` is missing, found only frame, body, feature, x, y"), "{refused}");
        let refused = of(&["frame", "body", "x", "y", "z", "qx", "qy", "qz"]).expect_err("no qw");
        assert!(refused.starts_with("column `qw` is missing"), "{refused}");
        let refused = of(&["frame", "x", "x"]).expect_err("twice");
        assert!(refused.starts_with("columns 2 and 3 are both named `x`"), "{refused}");
        assert!(of(&["0", "0.5", "1"]).expect_err("no header").starts_with("needed a header"));
        assert!(of(&["frame", "feature", "qx"]).expect_err("mixed").contains("write two files"));
    }
}
