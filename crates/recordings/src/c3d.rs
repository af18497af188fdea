//! C3D: markers in the binary format of motion capture. Only the points are read, not the analogue channels.
//!
//! A file is made of blocks of 512 bytes, counted from 1. The first is the header: bytes 0 and 1 are the first block of
//! the parameters and the mark 80; words (16 bit, counted from 1) 2 to 5 are the number of points, the analogue samples
//! per frame, the first and the last frame. The third byte of the parameters is the number of their blocks, the fourth
//! names the processor that wrote the numbers: 84 Intel, 85 DEC, 86 SGI. Each frame of the data is `x y z residual` per
//! point, followed by the analogue samples; all are floats if `POINT:SCALE` is negative, otherwise integers that are
//! multiplied by it.
//!
//! * **Samples** are missing if their residual is negative, or if they lie exactly at the origin.
//! * **Names** are `POINT:LABELS`, `LABELS2` …; a point beyond them is called by its place.
//! * **Frames** of recordings too long for the header are those of `TRIAL:ACTUAL_START_FIELD` and `ACTUAL_END_FIELD`.
//! * **Unit** is `POINT:UNITS`; where that is missing or empty, millimetres are assumed and a note says so.
//! * **Times** follow from `POINT:RATE`, 0 at the first frame.

mod numbers;
mod parameters;

use std::path::Path;

use nalgebra::Point3;

use self::numbers::{Numbers, Processor};
use self::parameters::Parameters;
use crate::markers::distinct;
use crate::text::quoted;
use crate::{Format, Markers, RecordingError, Unit};

const BLOCK: usize = 512;
const MARK: u8 = 80;
const CUT: &str = "the file is cut off; copy or export it again";

/// Reads the points of a file; `path` is named in errors, and `unit` takes the place of the unit that the file states.
///
/// # Errors
/// [`RecordingError::File`] if the file is no C3D file, cut off, or contradicts itself.
pub fn parse(bytes: &[u8], path: &Path, unit: Option<Unit>) -> Result<Markers, RecordingError> {
    read(bytes, unit).map_err(|problem| RecordingError::in_file(path, problem))
}

fn read(bytes: &[u8], unit: Option<Unit>) -> Result<Markers, String> {
    if bytes.get(1) != Some(&MARK) {
        return Err("needed a C3D file, found no mark of one; check the format".into());
    }
    let start = block(bytes[0].into())?;
    let processor = Processor::of(*bytes.get(start + 3).ok_or(CUT)?)?;
    let numbers = Numbers { bytes, processor };
    let parameters = Parameters::read(&numbers, start)?;
    let layout = Layout::of(&numbers, &parameters)?;
    let mut notes = Vec::new();
    let stated = parameters.get("POINT", "UNITS").map(|units| parameters::text(&numbers, units)).transpose()?;
    let (unit, unit_stated) = match (unit, stated.as_deref().map(str::trim).unwrap_or_default()) {
        (Some(unit), _) => (unit, false),
        (None, "") => {
            notes.push("the file states no unit of length; millimetres are assumed".into());
            (Unit::Millimetre, false)
        }
        (None, name) => (Unit::of_name(name)?, true),
    };
    let rate = parameters.get("POINT", "RATE").map(|rate| numbers.float(rate.data)).transpose()?;
    let rate = rate.filter(|rate| *rate > 0. && rate.is_finite());
    let Layout { points, frames, .. } = layout;
    let positions = layout.positions(&numbers, unit)?;
    let names = names(&numbers, &parameters, points)?;
    let frame_numbers: Vec<u64> = (layout.first..).take(frames).collect();
    let times = rate.map(|rate| (0..frames).map(|frame| frame as f64 / rate).collect());
    let markers = distinct(names, &mut notes);
    Ok(Markers {
        format: Format::C3d,
        unit,
        unit_stated,
        rate,
        frame_numbers,
        times,
        markers,
        positions,
        poses: Vec::new(),
        notes,
    })
}

/// Where a block begins.
fn block(number: usize) -> Result<usize, String> {
    Ok(number.checked_sub(1).ok_or("needed a block from 1 on, found 0; the file is damaged, export it again")? * BLOCK)
}

/// How the samples are laid out.
struct Layout {
    points: usize,
    /// Analogue samples per frame.
    analogue: usize,
    /// Number of the first frame.
    first: u64,
    frames: usize,
    /// Factor of integers; negative for floats.
    scale: f64,
    /// Where the samples begin.
    data: usize,
}

impl Layout {
    fn of(numbers: &Numbers<'_>, parameters: &Parameters) -> Result<Self, String> {
        let [points, analogue, first, last] = [2, 4, 6, 8].map(|at| numbers.unsigned(at));
        let (points, analogue) = (usize::from(points?), usize::from(analogue?));
        if points == 0 {
            return Err("the file has no points; needed at least one marker".into());
        }
        // Longer recordings than a word can count state their ends in two words each.
        let field = |name: &str| {
            let field = parameters.get("TRIAL", name)?;
            let [low, high] = [0, 2].map(|at| numbers.unsigned(field.data + at).map(u64::from));
            Some(low.ok()? + (high.ok()? << 16))
        };
        let (header_first, header_last) = (u64::from(first?), u64::from(last?));
        let (first, last) = match (field("ACTUAL_START_FIELD"), field("ACTUAL_END_FIELD")) {
            (Some(first), Some(last)) if first > 0 && first <= last && header_last >= u64::from(u16::MAX) => {
                (first, last)
            }
            _ => (header_first, header_last),
        };
        if first > last {
            return Err(format!(
                "frame {first} is the first and {last} the last; the file is damaged, export it again"
            ));
        }
        let frames = usize::try_from(last - first + 1).map_err(|_| CUT)?;
        let scale = match parameters.get("POINT", "SCALE") {
            Some(scale) => numbers.float(scale.data)?,
            None => return Err("the parameter POINT:SCALE is missing; export the file again".into()),
        };
        if scale == 0. || !scale.is_finite() {
            return Err(format!("the parameter POINT:SCALE is {scale}; the file is damaged, export it again"));
        }
        let data = match parameters.get("POINT", "DATA_START") {
            Some(start) => numbers.unsigned(start.data)?,
            None => numbers.unsigned(16)?,
        };
        let layout = Self { points, analogue, first, frames, scale, data: block(data.into())? };
        let needed = layout.frame_bytes().checked_mul(frames).and_then(|bytes| bytes.checked_add(layout.data));
        if needed.is_none_or(|needed| needed > numbers.bytes.len()) {
            let found = numbers.bytes.len().saturating_sub(layout.data) / layout.frame_bytes();
            return Err(format!("needed {frames} frames of {points} points, found {found}; {CUT}"));
        }
        Ok(layout)
    }

    /// Bytes of a number.
    fn size(&self) -> usize {
        if self.scale < 0. { 4 } else { 2 }
    }

    fn frame_bytes(&self) -> usize {
        self.size() * (4 * self.points + self.analogue)
    }

    fn positions(&self, numbers: &Numbers<'_>, unit: Unit) -> Result<Vec<Point3<f64>>, String> {
        let mut positions = Vec::with_capacity(self.frames * self.points);
        for frame in 0..self.frames {
            for point in 0..self.points {
                let at = self.data + frame * self.frame_bytes() + 4 * point * self.size();
                let [x, y, z, residual] = [0, 1, 2, 3].map(|column| self.sample(numbers, at + column * self.size()));
                let (position, residual) = ([x?, y?, z?], residual?);
                let missing = residual < 0. || position == [0.; 3];
                let metres = position.map(|x| if missing { f64::NAN } else { unit.to_metres(x) });
                positions.push(Point3::from(metres));
            }
        }
        Ok(positions)
    }

    /// A coordinate or residual, in the unit of the file.
    fn sample(&self, numbers: &Numbers<'_>, at: usize) -> Result<f64, String> {
        if self.scale < 0. {
            return numbers.float(at);
        }
        Ok(f64::from(numbers.unsigned(at)?.cast_signed()) * self.scale)
    }
}

/// One name per point; empty where the file has none.
fn names(numbers: &Numbers<'_>, parameters: &Parameters, points: usize) -> Result<Vec<String>, String> {
    let mut names = Vec::new();
    for number in 1.. {
        let key = if number == 1 { "LABELS".to_owned() } else { format!("LABELS{number}") };
        let Some(labels) = parameters.get("POINT", &key) else { break };
        names.extend(parameters::texts(numbers, labels).map_err(|problem| format!("POINT:{key}: {problem}"))?);
        if names.len() >= points {
            break;
        }
    }
    names.resize(points, String::new());
    Ok(names)
}

#[cfg(test)]
mod tests;
