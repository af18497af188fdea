//! What a file says about its data, checked before it is believed.
//!
//! The library reserves as much memory as a file promises to fill. So nothing is given to it but flat tables, and pages
//! that are as large as their values, or little larger than what they are packed in.

use parquet::basic::Compression;
use parquet::file::metadata::ColumnChunkMetaData;

use super::thrift::{Structure, Value};

/// A file begins and ends so.
const MARK: &[u8] = b"PAR1";

/// Bytes to which every page may be unpacked.
const ALWAYS_ALLOWED: usize = 1 << 24;

/// Bytes to which a byte of any page may be unpacked.
const ALLOWED_PER_BYTE: usize = 64;

/// No value of a dictionary is shorter, in bytes.
const SHORTEST_VALUE: usize = 2;

/// Sizes of pages and lengths of lists are checked; here is all that may be wrong with a page.
const DAMAGED: &str = "a page of values is damaged";

/// Checks what is said about the whole file: that its columns are not nested.
pub(super) fn check_file(bytes: &[u8]) -> Result<(), String> {
    let cut = || "the file is cut off or damaged; copy or write it anew".to_owned();
    if bytes.ends_with(b"PARE") {
        return Err("the file is encrypted; write it without encryption".into());
    }
    let inner = bytes.strip_prefix(MARK).and_then(|rest| rest.strip_suffix(MARK));
    let Some(inner) = inner else {
        return Err("needed a Parquet file, which begins and ends with `PAR1`; it is cut off, or another file".into());
    };
    let (rest, length) = inner.split_last_chunk::<4>().ok_or_else(cut)?;
    let start = usize::try_from(u32::from_le_bytes(*length)).ok().and_then(|length| rest.len().checked_sub(length));
    let file = start.and_then(|start| Structure::read(&mut &rest[start..])).ok_or_else(cut)?;
    let Some(Value::List(schema)) = file.get(2) else { return Err(cut()) };
    let sound = |element: &Value| matches!(element, Value::Structure(element) if element.all(of_schema));
    if schema.is_empty() || !schema.iter().all(sound) {
        return Err(cut());
    }
    let children = |element: &Value| match element {
        Value::Structure(element) => element.whole(5).unwrap_or(0),
        _ => 0,
    };
    let flat = usize::try_from(children(&schema[0])) == Ok(schema.len() - 1);
    if !flat || schema[1..].iter().any(|element| children(element) != 0) {
        return Err("needed plain columns, found nested ones (lists, maps or structures); leave them out".into());
    }
    Ok(())
}

/// Checks the pages of a column, of which there must be one value or gap for each of `rows`.
pub(super) fn check_pages(file: &[u8], column: &ColumnChunkMetaData, rows: usize) -> Result<(), String> {
    let packed = match column.compression() {
        Compression::UNCOMPRESSED => false,
        Compression::SNAPPY | Compression::ZSTD(_) => true,
        other => {
            let other = other.to_string().to_lowercase();
            let other = other.split('(').next().unwrap_or_default();
            return Err(format!(
                "packed with {other}; known are snappy, zstd and none; write the file with one of them"
            ));
        }
    };
    let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
    let place = usize::try_from(start).ok().zip(usize::try_from(column.compressed_size()).ok());
    let end = place.and_then(|(start, length)| start.checked_add(length));
    let bytes = place.zip(end).and_then(|((start, _), end)| file.get(start..end));
    let mut bytes = bytes.ok_or("its place is outside the file, which is cut off or damaged; copy or write it anew")?;
    let (mut values, mut has_dictionary) = (0_usize, false);
    while !bytes.is_empty() {
        let page = Structure::read(&mut bytes).filter(|page| page.all(of_page)).ok_or(DAMAGED)?;
        let size = |number| page.whole(number).and_then(|size| usize::try_from(size).ok()).ok_or(DAMAGED);
        let (unpacked, length) = (size(2)?, size(3)?);
        bytes = bytes.get(length..).ok_or(DAMAGED)?;
        if packed && unpacked > ALWAYS_ALLOWED.max(ALLOWED_PER_BYTE.saturating_mul(length)) {
            return Err(format!(
                "needed pages that unpack to at most {ALLOWED_PER_BYTE} times their size, found one of {length} bytes \
                 that should become {unpacked}; write the file with smaller pages"
            ));
        }
        let unpacked = if packed { unpacked } else { length };
        let content = |number| match page.get(number) {
            Some(Value::Structure(content)) => Ok(content),
            _ => Err(DAMAGED),
        };
        let count = |content: &Structure| content.whole(1).and_then(|count| usize::try_from(count).ok()).ok_or(DAMAGED);
        match page.whole(1) {
            Some(2) => {
                let sound = !has_dictionary && values == 0 && count(content(7)?)? <= unpacked / SHORTEST_VALUE;
                has_dictionary = sound.then_some(true).ok_or(DAMAGED)?;
            }
            Some(0) => {
                let content = content(5)?;
                check_encoding(content.whole(2), has_dictionary)?;
                values = values.saturating_add(count(content)?);
            }
            Some(3) => {
                let content = content(8)?;
                check_encoding(content.whole(4), has_dictionary)?;
                let levels =
                    content.whole(5).zip(content.whole(6)).filter(|(first, second)| *first >= 0 && *second >= 0);
                let levels = levels.and_then(|(first, second)| usize::try_from(first.checked_add(second)?).ok());
                levels.filter(|levels| *levels <= unpacked.min(length)).ok_or(DAMAGED)?;
                values = values.saturating_add(count(content)?);
            }
            _ => return Err(DAMAGED.into()),
        }
    }
    if values != rows {
        return Err(format!("needed {rows} values or gaps, one per row, found {values}; write the file anew"));
    }
    Ok(())
}

fn check_encoding(encoding: Option<i32>, has_dictionary: bool) -> Result<(), String> {
    match encoding {
        Some(2 | 8) if has_dictionary => Ok(()),
        // Plain, runs, differences of numbers, bytes apart.
        Some(0 | 3 | 5 | 9) => Ok(()),
        // The library believes the number of lengths that these begin with.
        Some(6 | 7) => Err("its text is written as differences (DELTA_LENGTH_BYTE_ARRAY or DELTA_BYTE_ARRAY); \
                            write it plain or with a dictionary"
            .into()),
        _ => Err(DAMAGED.into()),
    }
}

/// Whether a field of a column's description is of the kind that its number needs: others are read differently by
/// different readers.
fn of_schema(number: i64, value: &Value) -> bool {
    match number {
        1..=3 | 5..=9 => matches!(value, Value::Whole(_)),
        4 => *value == Value::Text,
        10 => matches!(value, Value::Structure(_)),
        _ => true,
    }
}

/// The same for the head of a page, and for what is in it.
fn of_page(number: i64, value: &Value) -> bool {
    match (number, value) {
        (1..=4, Value::Whole(_)) => true,
        (5 | 7, Value::Structure(content)) => content.all(|number, value| match number {
            1 | 2 | 4 => matches!(value, Value::Whole(_)),
            3 => matches!(value, Value::Whole(_) | Value::Truth),
            _ => true,
        }),
        (8, Value::Structure(content)) => content.all(|number, value| match number {
            1..=6 => matches!(value, Value::Whole(_)),
            7 => *value == Value::Truth,
            _ => true,
        }),
        (6, _) => false,
        (number, _) => number > 8,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parquet::basic::Type as Physical;
    use parquet::schema::types::{ColumnDescriptor, ColumnPath, Type};

    use super::*;

    /// A number of 32 bits, in the field after the last.
    fn whole(number: i32) -> Vec<u8> {
        let mut folded = (number.cast_unsigned() << 1) ^ if number < 0 { u32::MAX } else { 0 };
        let mut bytes = vec![0x15];
        while folded > 127 {
            bytes.push(u8::try_from(folded & 127).expect("seven bits") | 128);
            folded >>= 7;
        }
        bytes.push(u8::try_from(folded).expect("seven bits"));
        bytes
    }

    fn page(kind: i32, [unpacked, length]: [i32; 2], step: u8, content: &[i32]) -> Vec<u8> {
        let content: Vec<u8> = content.iter().flat_map(|number| whole(*number)).collect();
        let mut page =
            [whole(kind), whole(unpacked), whole(length), vec![step << 4 | 0xc], content, vec![0, 0]].concat();
        page.extend(vec![0; usize::try_from(length).unwrap_or(0)]);
        page
    }

    fn dictionary(values: i32, sizes: [i32; 2]) -> Vec<u8> {
        page(2, sizes, 4, &[values, 0])
    }

    fn data(values: i32, encoding: i32, sizes: [i32; 2]) -> Vec<u8> {
        page(0, sizes, 2, &[values, encoding, 3, 3])
    }

    fn second_version(values: i32, levels: [i32; 2]) -> Vec<u8> {
        page(3, [80, 80], 5, &[values, 0, values, 0, levels[0], levels[1]])
    }

    fn checked(pages: &[Vec<u8>], packing: Compression) -> Result<(), String> {
        let column = Type::primitive_type_builder("x", Physical::DOUBLE).build().expect("a column");
        let descriptor = Arc::new(ColumnDescriptor::new(Arc::new(column), 1, 0, ColumnPath::from("x")));
        let bytes = pages.concat();
        let size = i64::try_from(bytes.len()).expect("small");
        let column = ColumnChunkMetaData::builder(descriptor).set_compression(packing).set_total_compressed_size(size);
        check_pages(&bytes, &column.build().expect("a column"), 10)
    }

    #[test]
    fn pages_hold_what_they_say() {
        for pages in [
            vec![data(10, 0, [80, 80])],
            vec![dictionary(3, [24, 24]), data(4, 8, [9, 9]), data(6, 0, [48, 48])],
            vec![second_version(10, [4, 4])],
        ] {
            assert_eq!(checked(&pages, Compression::UNCOMPRESSED), Ok(()));
        }
        assert_eq!(checked(&[data(10, 0, [1 << 24, 9])], Compression::SNAPPY), Ok(()));
    }

    #[test]
    fn pages_that_promise_more_are_refused() {
        let [plain, snappy] = [Compression::UNCOMPRESSED, Compression::SNAPPY];
        let cut = data(10, 0, [80, 80])[..30].to_vec();
        for (pages, packing, needed) in [
            (vec![data(9, 0, [80, 80])], plain, "needed 10 values or gaps, one per row, found 9"),
            (vec![data(i32::MAX, 0, [80, 80])], plain, "found 2147483647"),
            (vec![data(-1, 0, [80, 80])], plain, DAMAGED),
            (vec![data(10, 0, [i32::MAX, 80])], snappy, "needed pages that unpack to at most 64 times their size"),
            (vec![data(10, 0, [80, -1])], plain, DAMAGED),
            (vec![cut], plain, DAMAGED),
            (vec![data(10, 8, [80, 80])], plain, DAMAGED),
            (vec![data(10, 6, [80, 80])], plain, "written as differences"),
            (vec![dictionary(i32::MAX, [i32::MAX, 24]), data(10, 8, [9, 9])], plain, DAMAGED),
            (vec![dictionary(3, [24, 24]), dictionary(3, [24, 24]), data(10, 8, [9, 9])], plain, DAMAGED),
            (vec![second_version(10, [i32::MAX, i32::MAX])], plain, DAMAGED),
            (vec![second_version(10, [-1, 4])], plain, DAMAGED),
            (vec![data(10, 0, [80, 80])], Compression::LZ4, "packed with lz4; known are snappy, zstd and none"),
        ] {
            let found = checked(&pages, packing).expect_err("refused");
            assert!(found.contains(needed), "{found}");
        }
    }
}
