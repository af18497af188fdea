//! The parameters of a file, by group and name.
//!
//! After four bytes come groups (negative number) and parameters (the number of their group): length of the name,
//! number, name, distance to the next one, and for parameters the kind (-1 text, 1 byte, 2 integer, 4 float), the number
//! of dimensions, the dimensions, the data.

use std::collections::BTreeMap;

use super::numbers::Numbers;
use super::{BLOCK, CUT};

/// Where the data of a parameter are.
pub(super) struct Parameter {
    pub dimensions: Vec<usize>,
    pub data: usize,
}

/// The parameters, by group and name in upper case.
pub(super) struct Parameters(BTreeMap<(String, String), Parameter>);

impl Parameters {
    pub(super) fn read(numbers: &Numbers<'_>, start: usize) -> Result<Self, String> {
        let mut groups = BTreeMap::new();
        let mut found: Vec<(u8, String, Parameter)> = Vec::new();
        let [_, _, blocks, _] = numbers.at(start)?;
        // Some writers leave the number of blocks at 0, or the last distance in another processor's order, which leads
        // out of the section.
        let end = if blocks == 0 { numbers.bytes.len() } else { start + BLOCK * usize::from(blocks) };
        let mut at = start + 4;
        while at < end {
            let [length, number] = numbers.at(at)?;
            // The length is negative where the parameter is locked.
            let length = usize::from(length.cast_signed().unsigned_abs());
            if length == 0 {
                break;
            }
            let name = latin(numbers.bytes.get(at + 2..at + 2 + length).ok_or(CUT)?).trim().to_uppercase();
            let distance_at = at + 2 + length;
            if number.cast_signed() < 0 {
                groups.insert(number.cast_signed().unsigned_abs(), name);
            } else {
                let [_kind, count] = numbers.at(distance_at + 2)?;
                let data = distance_at + 4 + usize::from(count);
                let dimensions = numbers.bytes.get(distance_at + 4..data).ok_or(CUT)?;
                let dimensions = dimensions.iter().map(|n| (*n).into()).collect();
                found.push((number, name, Parameter { dimensions, data }));
            }
            let distance = usize::from(numbers.unsigned(distance_at)?);
            if distance == 0 {
                break;
            }
            at = distance_at + distance;
        }
        if !groups.values().any(|name| name == "POINT") {
            return Err("the group of parameters POINT is missing; the file is damaged, export it again".into());
        }
        let named = found.into_iter().filter_map(|(group, name, parameter)| {
            let group = groups.get(&group)?;
            Some(((group.clone(), name), parameter))
        });
        // The first of a name counts.
        Ok(Self(named.rev().collect()))
    }

    pub(super) fn get(&self, group: &str, name: &str) -> Option<&Parameter> {
        self.0.get(&(group.to_owned(), name.to_owned()))
    }
}

/// A parameter that is one text.
pub(super) fn text(numbers: &Numbers<'_>, parameter: &Parameter) -> Result<String, String> {
    let length = parameter.dimensions.iter().try_fold(1, |length: usize, n| length.checked_mul(*n)).ok_or(CUT)?;
    let end = parameter.data.checked_add(length).ok_or(CUT)?;
    Ok(latin(numbers.bytes.get(parameter.data..end).ok_or(CUT)?))
}

/// The rows of a parameter that is a table of text, without the blanks that fill them.
pub(super) fn texts(numbers: &Numbers<'_>, parameter: &Parameter) -> Result<Vec<String>, String> {
    let (width, rows) = match parameter.dimensions[..] {
        [width, rows] => (width, rows),
        [width] => (width, 1),
        _ => return Err("needed a table of text, found something else; export the file again".into()),
    };
    let row = |row: usize| {
        let start = parameter.data + row * width;
        Ok(latin(numbers.bytes.get(start..start + width).ok_or(CUT)?).trim_matches(['\0', ' ', '\t']).to_owned())
    };
    (0..rows).map(row).collect()
}

/// Text is UTF-8 where it can be, Latin 1 otherwise.
fn latin(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().copied().map(char::from).collect(), ToOwned::to_owned)
}
