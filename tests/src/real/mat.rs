//! MATLAB's files of version 5, as far as matrices of numbers in compressed elements go, little-endian.
//!
//! After 128 bytes of header come elements: the kind of their content and its length (each 32 bit), then the content,
//! filled up to a multiple of 8 bytes. A content of at most 4 bytes may stand in the place of the length, with the length
//! in the upper half of the kind. A compressed element (15) holds another one packed by zlib; a matrix (14) holds
//! elements with its flags, dimensions, name and numbers, column by column.

use std::io::Read;

use flate2::read::ZlibDecoder;

const HEADER: usize = 128;
const INT8: u32 = 1;
const INT32: u32 = 5;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// More than the files here hold, so that no file can fill the memory.
const LARGEST: u64 = 1 << 24;

/// The rows of the matrix with this name.
pub(super) fn rows(bytes: &[u8], name: &str) -> Result<Vec<Vec<f64>>, String> {
    let mut rest = bytes.get(HEADER..).filter(|_| bytes[126..HEADER] == *b"IM").ok_or("needed a little-endian file")?;
    while !rest.is_empty() {
        let (kind, content, after) = element(rest, 1)?;
        rest = after;
        if kind != COMPRESSED {
            return Err(format!("needed compressed elements, found kind {kind}"));
        }
        let mut unpacked = Vec::new();
        ZlibDecoder::new(content).take(LARGEST).read_to_end(&mut unpacked).map_err(|error| error.to_string())?;
        let (MATRIX, content, _) = element(&unpacked, 8)? else { continue };
        if let Some(rows) = matrix(content, name)? {
            return Ok(rows);
        }
    }
    Err(format!("no matrix `{name}`"))
}

/// Kind and content of the first element, and what follows it.
fn element(bytes: &[u8], multiple: usize) -> Result<(u32, &[u8], &[u8]), String> {
    let cut = "the file is cut off";
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let (kind, length) = number(0).zip(number(4)).ok_or(cut)?;
    let (kind, start, length, end) = if kind >> 16 == 0 {
        let length = length as usize;
        (kind, 8, length, 8 + length.next_multiple_of(multiple))
    } else {
        (kind & 0xffff, 4, (kind >> 16) as usize, 8)
    };
    let content = bytes.get(start..start + length).ok_or(cut)?;
    Ok((kind, content, bytes.get(end..).unwrap_or_default()))
}

/// The rows of a matrix, if it has this name.
fn matrix(content: &[u8], name: &str) -> Result<Option<Vec<Vec<f64>>>, String> {
    let (_flags, _, rest) = element(content, 8)?;
    let (INT32, dimensions, rest) = element(rest, 8)? else { return Err("needed dimensions".into()) };
    let (INT8, found, rest) = element(rest, 8)? else { return Err("needed a name".into()) };
    if found != name.as_bytes() {
        return Ok(None);
    }
    let (DOUBLE, numbers, _) = element(rest, 8)? else { return Err("needed numbers of double precision".into()) };
    let numbers: Vec<f64> = numbers.as_chunks().0.iter().map(|number| f64::from_le_bytes(*number)).collect();
    let dimensions: Vec<usize> =
        dimensions.as_chunks().0.iter().map(|number| u32::from_le_bytes(*number) as usize).collect();
    match dimensions[..] {
        [rows, columns] if rows.checked_mul(columns) == Some(numbers.len()) => {
            let row = |row| (0..columns).map(|column| numbers[column * rows + row]).collect();
            Ok(Some((0..rows).map(row).collect()))
        }
        _ => Err(format!("needed a matrix of {} numbers, found dimensions {dimensions:?}", numbers.len())),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::ZlibEncoder};

    use super::*;

    fn long(kind: u32, content: &[u8]) -> Vec<u8> {
        let length = u32::try_from(content.len()).expect("short").to_le_bytes();
        let filling = vec![0; content.len().next_multiple_of(8) - content.len()];
        [&kind.to_le_bytes()[..], &length, content, &filling].concat()
    }

    fn file() -> Vec<u8> {
        let numbers: Vec<u8> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0f64].iter().flat_map(|x| x.to_le_bytes()).collect();
        let dimensions: Vec<u8> = [2u32, 3].iter().flat_map(|x| x.to_le_bytes()).collect();
        let name = [1, 0, 2, 0, b'R', b't', 0, 0];
        let content = [long(6, &[0; 8]), long(INT32, &dimensions), name.into(), long(DOUBLE, &numbers)].concat();
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&long(MATRIX, &content)).expect("packed");
        let packed = encoder.finish().expect("packed");
        let length = u32::try_from(packed.len()).expect("short").to_le_bytes();
        let mut header = [b' '; HEADER];
        header[126..].copy_from_slice(b"IM");
        [&header[..], &COMPRESSED.to_le_bytes(), &length, &packed].concat()
    }

    #[test]
    fn a_matrix_is_found_by_its_name_and_read_by_columns() {
        assert_eq!(rows(&file(), "Rt"), Ok(vec![vec![1., 3., 5.], vec![2., 4., 6.]]));
        assert_eq!(rows(&file(), "other"), Err("no matrix `other`".into()));
    }

    #[test]
    fn what_is_cut_off_is_refused() {
        let file = file();
        for length in 0..file.len() {
            assert!(rows(&file[..length], "Rt").is_err(), "{length}");
        }
    }
}
