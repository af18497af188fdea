//! The columns of a table, decoded a few rows at a time.

use std::panic::{AssertUnwindSafe, catch_unwind};

use parquet::basic::{ConvertedType, LogicalType, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::schema::types::ColumnDescriptor;

use crate::csv_table::frame_number;
use crate::text::{number, quoted};

/// Bytes of the longest name. In a file of columns a name costs its bytes once, and a reader its time in every row.
const LONGEST_NAME: usize = 1000;

/// What the cells of a column are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Signed,
    Unsigned,
    Real,
    Half,
    Text,
}

impl Kind {
    /// The kind of a column, if tables have use for it: times of day and decimals, for instance, are none.
    fn of(column: &ColumnDescriptor) -> Option<Self> {
        use ConvertedType as Converted;

        let converted = column.converted_type();
        Some(match (column.physical_type(), column.logical_type_ref()) {
            (Type::INT32 | Type::INT64, Some(LogicalType::Integer(integer))) if !integer.is_signed => Self::Unsigned,
            // Of the unknown type, all cells are missing.
            (Type::INT32 | Type::INT64, Some(LogicalType::Integer(_) | LogicalType::Unknown)) => Self::Signed,
            (Type::INT32 | Type::INT64, None) => match converted {
                Converted::UINT_8 | Converted::UINT_16 | Converted::UINT_32 | Converted::UINT_64 => Self::Unsigned,
                Converted::NONE | Converted::INT_8 | Converted::INT_16 | Converted::INT_32 | Converted::INT_64 => {
                    Self::Signed
                }
                _ => return None,
            },
            (Type::FLOAT | Type::DOUBLE, None) => Self::Real,
            (Type::FIXED_LEN_BYTE_ARRAY, Some(LogicalType::Float16)) if column.type_length() == 2 => Self::Half,
            (Type::BYTE_ARRAY, None | Some(LogicalType::String | LogicalType::Enum))
                if matches!(converted, Converted::NONE | Converted::UTF8 | Converted::ENUM) =>
            {
                Self::Text
            }
            _ => return None,
        })
    }

    /// The kind of a column of numbers.
    pub(super) fn of_numbers(column: &ColumnDescriptor) -> Result<Self, String> {
        Self::of(column).filter(|kind| *kind != Self::Text).ok_or_else(|| {
            format!("needed integers or floating-point numbers, found {}; convert the column", described(column))
        })
    }

    /// The kind of a column of names.
    pub(super) fn of_names(column: &ColumnDescriptor) -> Result<Self, String> {
        Self::of(column)
            .filter(|kind| !matches!(kind, Self::Real | Self::Half))
            .ok_or_else(|| format!("needed text or integers, found {}; convert the column", described(column)))
    }
}

fn described(column: &ColumnDescriptor) -> String {
    match (column.logical_type_ref(), column.converted_type()) {
        (Some(logical), _) => {
            let logical = format!("{logical:?}");
            format!("{} as {}", column.physical_type(), logical.split('(').next().unwrap_or_default())
        }
        (None, ConvertedType::NONE) => column.physical_type().to_string(),
        (None, converted) => format!("{} as {converted}", column.physical_type()),
    }
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Missing,
    /// Of any integer type.
    Whole(i128),
    Real(f64),
    Text(ByteArray),
}

impl Cell {
    /// The number of a frame.
    pub(super) fn frame(&self) -> Result<u64, String> {
        match self {
            Self::Missing => {
                Err("column `frame`: needed a whole number from 0, found an empty cell; number every row".into())
            }
            Self::Whole(number) => u64::try_from(*number).or_else(|_| frame_number(&number.to_string())),
            Self::Real(number) => frame_number(&number.to_string()),
            Self::Text(_) => frame_number("text"),
        }
    }

    /// A finite number, or NaN if it is missing.
    pub(super) fn number(&self) -> Result<f64, String> {
        match self {
            Self::Missing => Ok(f64::NAN),
            Self::Whole(whole) => Ok(*whole as f64),
            Self::Real(real) if real.is_infinite() => number(&real.to_string()),
            Self::Real(real) => Ok(*real),
            Self::Text(_) => number("text"),
        }
    }

    /// The text of a name, in `buffer` if it is a number; empty if it is missing.
    pub(super) fn text<'a>(&'a self, buffer: &'a mut String) -> Result<&'a str, String> {
        match self {
            Self::Missing => Ok(""),
            Self::Text(text) if text.len() > LONGEST_NAME => {
                let found = text.len();
                Err(format!("needed a name of at most {LONGEST_NAME} bytes, found one of {found}; shorten it"))
            }
            Self::Text(text) => text.as_utf8().map_err(|_| {
                format!("needed UTF-8 text, found {}; save it as UTF-8", quoted(&String::from_utf8_lossy(text.data())))
            }),
            Self::Whole(number) => {
                *buffer = number.to_string();
                Ok(buffer)
            }
            Self::Real(number) => {
                *buffer = number.to_string();
                Ok(buffer)
            }
        }
    }
}

/// A column of a group of rows, read from its beginning.
pub(super) struct Column {
    reader: ColumnReader,
    kind: Kind,
}

impl Column {
    pub(super) fn new(reader: ColumnReader, kind: Kind) -> Self {
        Self { reader, kind }
    }

    /// The next cells, as many as are asked for.
    pub(super) fn next(&mut self, rows: usize) -> Result<Vec<Cell>, String> {
        let unsigned = self.kind == Kind::Unsigned;
        match &mut self.reader {
            ColumnReader::Int32ColumnReader(reader) => decoded(reader, rows, |value| {
                Cell::Whole(if unsigned { value.cast_unsigned().into() } else { value.into() })
            }),
            ColumnReader::Int64ColumnReader(reader) => decoded(reader, rows, |value| {
                Cell::Whole(if unsigned { value.cast_unsigned().into() } else { value.into() })
            }),
            ColumnReader::FloatColumnReader(reader) => decoded(reader, rows, |value| Cell::Real(value.into())),
            ColumnReader::DoubleColumnReader(reader) => decoded(reader, rows, Cell::Real),
            ColumnReader::FixedLenByteArrayColumnReader(reader) => decoded(reader, rows, |value| match *value.data() {
                [low, high] => Cell::Real(of_half(u16::from_le_bytes([low, high]))),
                _ => Cell::Missing,
            }),
            ColumnReader::ByteArrayColumnReader(reader) => decoded(reader, rows, Cell::Text),
            ColumnReader::BoolColumnReader(_) | ColumnReader::Int96ColumnReader(_) => Err("its type is unknown".into()),
        }
    }
}

fn decoded<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    cell: impl Fn(T::T) -> Cell,
) -> Result<Vec<Cell>, String> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let (records, ..) = caught(|| reader.read_records(rows, Some(&mut levels), None, &mut values))?;
    let mut values = values.into_iter().map(cell);
    // Columns without gaps have no levels.
    let cells: Vec<Cell> = if levels.is_empty() {
        values.collect()
    } else {
        levels
            .iter()
            .map(|level| if *level == 0 { Cell::Missing } else { values.next().unwrap_or(Cell::Missing) })
            .collect()
    };
    if records != rows || cells.len() != rows {
        return Err(format!("needed {rows} more values or gaps, found {records}; write the file anew"));
    }
    Ok(cells)
}

/// What the library gives; where it panics, the file is damaged in a way that it does not know of.
pub(super) fn caught<T>(call: impl FnOnce() -> parquet::errors::Result<T>) -> Result<T, String> {
    let damaged = |what: String| format!("{what}; the file seems to be damaged, write it anew");
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(result) => result.map_err(|error| damaged(error.to_string())),
        Err(_) => Err(damaged("cannot be decoded".into())),
    }
}

/// The number that 16 bits stand for (IEEE 754 `binary16`).
fn of_half(bits: u16) -> f64 {
    let fraction = f64::from(bits & 0x3ff);
    let size = match bits >> 10 & 0x1f {
        0 => fraction * f64::powi(2., -24),
        31 if fraction == 0. => f64::INFINITY,
        31 => f64::NAN,
        exponent => (1024. + fraction) * f64::powi(2., i32::from(exponent) - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bits_are_the_numbers_of_the_standard() {
        for (bits, number) in [
            (0x3c00, 1.),
            (0xc000, -2.),
            (0x7bff, 65504.),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x03ff, 6.097_555_160_522_461e-5),
            (0x3555, 0.333_251_953_125),
            (0x7c00, f64::INFINITY),
        ] {
            assert_eq!(of_half(bits), number);
        }
        assert!(of_half(0x7e00).is_nan());
    }
}
