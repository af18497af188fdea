//! C3D: marker positions as motion capture systems write them. Only the points are read, not the analogue channels.
//!
//! A file is made of blocks of 512 bytes, counted from 1. The first is the header: bytes 0 and 1 are the first block of
//! the parameters and the mark 80; words (16 bit, counted from 1) 2 to 5 are the number of points, the analogue samples
//! per frame, the first and the last frame. The third byte of the parameters is the number of their blocks, the fourth
//! names the processor that wrote the numbers: 84 Intel, 85 DEC, 86 SGI. Then come groups (negative number) and
//! parameters (the number of their group): length of the name, number, name, distance to the next one, and for
//! parameters the kind (-1 text, 1 byte, 2 integer, 4 float), dimensions and data.
//!
//! Each frame of the data is `x y z residual` per point, followed by the analogue samples; all are floats if
//! `POINT:SCALE` is negative, otherwise integers to be multiplied by it. A sample is missing if its residual is
//! negative, or if it lies exactly at the origin.

use std::collections::BTreeMap;

use jointscope_recordings::Unit;
use nalgebra::Point3;

use super::markers::Markers;

const BLOCK: usize = 512;
const MARK: u8 = 80;

pub(super) fn parse(bytes: &[u8]) -> Result<Markers, String> {
    if bytes.get(1) != Some(&MARK) {
        return Err("needed a C3D file, found no mark of one".into());
    }
    let parameters_start = block(bytes[0].into())?;
    let processor = Processor::of(*bytes.get(parameters_start + 3).ok_or(CUT)?)?;
    let numbers = Numbers { bytes, processor };
    let parameters = parameters(&numbers, parameters_start)?;
    let parameter = |name: &str| parameters.get(name).ok_or_else(|| format!("no parameter POINT:{name}"));

    let [points, analogue, first, last] = [2, 4, 6, 8].map(|at| numbers.unsigned(at));
    let (points, analogue, first, last) = (usize::from(points?), usize::from(analogue?), first?, last?);
    if first > last {
        return Err(format!("frame {first} is the first and {last} the last"));
    }
    let scale = numbers.float(parameter("SCALE")?.data)?;
    let rate = numbers.float(parameter("RATE")?.data)?;
    let unit: Unit = parameter("UNITS")?.text(bytes)?.trim().parse().map_err(|error| format!("{error}"))?;
    let data = block(numbers.unsigned(parameter("DATA_START")?.data)?.into())?;
    let size = if scale < 0.0 { 4 } else { 2 };

    let mut positions = Vec::new();
    for frame in 0..=usize::from(last - first) {
        for point in 0..points {
            let at = data + size * (frame * (4 * points + analogue) + 4 * point);
            let [x, y, z, residual] = [0, 1, 2, 3].map(|column| numbers.sample(at + size * column, scale));
            let (position, residual) = ([x?, y?, z?], residual?);
            let missing = residual < 0.0 || position == [0.0; 3];
            positions.push(if missing {
                Point3::from([f64::NAN; 3])
            } else {
                position.map(|x| unit.to_metres(x)).into()
            });
        }
    }
    let mut labels = parameter("LABELS")?.texts(bytes)?;
    labels.truncate(points);
    let frames: Vec<u64> = (first..=last).map(u64::from).collect();
    let times = (0..frames.len()).map(|i| i as f64 / rate).collect();
    Ok(Markers { frames, times, labels, positions })
}

const CUT: &str = "the file is cut off";

/// Where a block begins.
fn block(number: usize) -> Result<usize, String> {
    Ok(number.checked_sub(1).ok_or("there is no block 0")? * BLOCK)
}

/// Whose numbers a file holds.
#[derive(Clone, Copy)]
enum Processor {
    Intel,
    Dec,
    Sgi,
}

impl Processor {
    fn of(byte: u8) -> Result<Self, String> {
        match byte {
            84 => Ok(Self::Intel),
            85 => Ok(Self::Dec),
            86 => Ok(Self::Sgi),
            other => Err(format!("needed processor 84, 85 or 86, found {other}")),
        }
    }
}

/// The numbers of a file.
struct Numbers<'a> {
    bytes: &'a [u8],
    processor: Processor,
}

impl Numbers<'_> {
    fn at<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        self.bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().ok_or_else(|| CUT.into())
    }

    fn unsigned(&self, at: usize) -> Result<u16, String> {
        Ok(match self.processor {
            Processor::Intel | Processor::Dec => u16::from_le_bytes(self.at(at)?),
            Processor::Sgi => u16::from_be_bytes(self.at(at)?),
        })
    }

    fn float(&self, at: usize) -> Result<f64, String> {
        let bytes: [u8; 4] = self.at(at)?;
        Ok(f64::from(match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Sgi => f32::from_be_bytes(bytes),
            // The halves are swapped, and the exponent is counted from another number.
            Processor::Dec => f32::from_le_bytes([bytes[2], bytes[3], bytes[0], bytes[1]]) / 4.0,
        }))
    }

    /// A coordinate or residual, in the unit of the file.
    fn sample(&self, at: usize, scale: f64) -> Result<f64, String> {
        if scale < 0.0 {
            return self.float(at);
        }
        Ok(f64::from(self.unsigned(at)?.cast_signed()) * scale)
    }
}

/// Where the data of a parameter are.
struct Parameter {
    dimensions: Vec<usize>,
    data: usize,
}

impl Parameter {
    fn text<'a>(&self, bytes: &'a [u8]) -> Result<&'a str, String> {
        text(bytes, self.data, self.dimensions.iter().product())
    }

    /// The rows of a table of text, without the blanks that fill them.
    fn texts(&self, bytes: &[u8]) -> Result<Vec<String>, String> {
        let [width, rows] = self.dimensions[..] else { return Err("needed a table of text".into()) };
        (0..rows).map(|row| Ok(text(bytes, self.data + row * width, width)?.trim().to_owned())).collect()
    }
}

fn text(bytes: &[u8], at: usize, length: usize) -> Result<&str, String> {
    std::str::from_utf8(bytes.get(at..at + length).ok_or(CUT)?).map_err(|error| error.to_string())
}

/// The parameters of the group POINT, by name.
fn parameters(numbers: &Numbers<'_>, start: usize) -> Result<BTreeMap<String, Parameter>, String> {
    let mut points = None;
    let mut found: Vec<(u8, String, Parameter)> = Vec::new();
    let [_, _, blocks, _] = numbers.at(start)?;
    let end = start + BLOCK * usize::from(blocks);
    let mut at = start + 4;
    // Some writers leave the last distance in another processor's order, which leads out of the section.
    while at < end {
        let [length, number] = numbers.at(at)?;
        // The length is negative where the parameter is locked.
        let length = usize::from(length.cast_signed().unsigned_abs());
        if length == 0 {
            break;
        }
        let name = text(numbers.bytes, at + 2, length)?.to_uppercase();
        let distance_at = at + 2 + length;
        if number.cast_signed() < 0 {
            if name == "POINT" {
                points = Some(number.cast_signed().unsigned_abs());
            }
        } else {
            let [_kind, count] = numbers.at(distance_at + 2)?;
            let data = distance_at + 4 + usize::from(count);
            let dimensions = numbers.bytes.get(distance_at + 4..data).ok_or(CUT)?;
            found.push((
                number,
                name,
                Parameter { dimensions: dimensions.iter().map(|n| (*n).into()).collect(), data },
            ));
        }
        let distance = usize::from(numbers.unsigned(distance_at)?);
        if distance == 0 {
            break;
        }
        at = distance_at + distance;
    }
    let points = points.ok_or("no group POINT")?;
    Ok(found.into_iter().filter(|(group, ..)| *group == points).map(|(_, name, parameter)| (name, parameter)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_of_a_recording_gives_the_same_positions() {
        let Some(folder) = crate::real::folder() else { return };
        let read = |name: &str| {
            let path = folder.join("kineticstoolkit/c3d_test_suite").join(name);
            parse(&std::fs::read(path).expect("a file")).expect("a sound file")
        };
        let expected = read("pc_real.c3d");
        assert_eq!((expected.frames.len(), &*expected.labels[0], expected.labels.len()), (89, "RFT1", 36));
        for name in ["pc_int.c3d", "dec_real.c3d", "dec_int.c3d", "sgi_real.c3d", "sgi_int.c3d"] {
            let found = read(name);
            assert_eq!((&found.frames, &found.labels), (&expected.frames, &expected.labels), "{name}");
            for (a, b) in found.positions.iter().zip(&expected.positions) {
                let same = a.x.is_nan() && b.x.is_nan() || nalgebra::distance(a, b) < 1e-3;
                assert!(same, "{name}: {a} and {b}");
            }
        }
    }

    #[test]
    fn what_is_no_c3d_or_cut_off_is_refused() {
        assert!(parse(b"").is_err());
        assert!(parse(&[2, 80]).is_err());
        let mut header = vec![0; 2 * BLOCK];
        (header[0], header[1], header[BLOCK + 3]) = (2, MARK, 84);
        assert_eq!(parse(&header).err().as_deref(), Some("no group POINT"));
        header[BLOCK + 3] = 1;
        assert_eq!(parse(&header).err().as_deref(), Some("needed processor 84, 85 or 86, found 1"));
    }
}
