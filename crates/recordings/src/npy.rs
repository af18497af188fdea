//! One array of numpy, as its `.npy` file writes it.
//!
//! The header is read here and not by a library, because it is not trusted: lengths and shapes are checked before they
//! are believed, nothing recurses, and pickled objects are refused.

use std::borrow::Cow;
use std::io::Read;
use std::ops::Range;

use crate::text::quoted;

/// No header of a plain array is near this many bytes; numpy itself reads 10 000.
const LONGEST_HEADER: u32 = 1 << 16;

/// What the header of an array says.
#[derive(Debug, PartialEq)]
pub(crate) struct Header {
    big_endian: bool,
    /// numpy's letter for the type: `f` float, `i` and `u` integer, `b` bool, `U` text, `S` bytes.
    kind: char,
    /// Bytes per element.
    size: usize,
    fortran_order: bool,
    pub shape: Vec<usize>,
}

impl Header {
    /// Reads the header, up to where the elements begin.
    pub(crate) fn read(file: &mut impl Read) -> Result<Self, String> {
        let mut start = [0; 8];
        file.read_exact(&mut start).map_err(|error| format!("no array begins here ({error})"))?;
        let length = match (&start[..6], start[6]) {
            (b"\x93NUMPY", 1) => u32::from(u16::from_le_bytes(take(file)?)),
            (b"\x93NUMPY", 2 | 3) => u32::from_le_bytes(take(file)?),
            _ => return Err("needed numpy's array format, version 1, 2 or 3; write it with numpy.savez".into()),
        };
        if length > LONGEST_HEADER {
            return Err(format!("the header claims {length} bytes, more than the {LONGEST_HEADER} any array needs"));
        }
        let mut text = Vec::new();
        file.take(length.into()).read_to_end(&mut text).map_err(|error| format!("the header ends early ({error})"))?;
        let text = String::from_utf8(text).map_err(|_| "the header is not text".to_owned())?;
        Scanner(&text).header()
    }

    /// Number of bytes of all elements, if that can be counted.
    pub(crate) fn bytes(&self) -> Option<usize> {
        self.shape.iter().try_fold(self.size, |bytes, length| bytes.checked_mul(*length))
    }
}

/// An array and its elements, as bytes: those of the file, or what they unpack to.
#[derive(Debug)]
pub(crate) struct Array<'a> {
    header: Header,
    data: Cow<'a, [u8]>,
}

/// The elements of an array as values of one type, counted with the last index running fastest.
pub(crate) struct Elements<'a, T> {
    array: Array<'a>,
    read: ReadElements<T>,
}

/// Appends some elements of an array.
type ReadElements<T> = fn(&Array<'_>, Range<usize>, &mut Vec<T>);

impl<T> Elements<'_, T> {
    /// Appends some of the elements, which must exist.
    pub(crate) fn append(&self, elements: Range<usize>, to: &mut Vec<T>) {
        (self.read)(&self.array, elements, to);
    }

    /// All of them.
    pub(crate) fn all(&self) -> Vec<T> {
        let mut all = Vec::new();
        self.append(0..self.array.count(), &mut all);
        all
    }
}

impl<'a> Array<'a> {
    /// Joins a header and its elements; `None` if their sizes differ.
    pub(crate) fn new(header: Header, data: Cow<'a, [u8]>) -> Option<Self> {
        (header.bytes() == Some(data.len())).then_some(Self { header, data })
    }

    pub(crate) fn shape(&self) -> &[usize] {
        &self.header.shape
    }

    fn count(&self) -> usize {
        self.data.len() / self.header.size
    }

    /// Elements as numbers.
    pub(crate) fn into_floats(self) -> Result<Elements<'a, f64>, String> {
        let read: ReadElements<f64> = match (self.header.kind, self.header.size) {
            ('f', 8) => |array, elements, to| array.read(elements, to, f64::from_le_bytes),
            ('f', 4) => |array, elements, to| array.read(elements, to, |cell| f32::from_le_bytes(cell).into()),
            _ => return Err(self.other_type("float64 or float32")),
        };
        Ok(Elements { array: self, read })
    }

    /// Elements as integers.
    pub(crate) fn into_integers(self) -> Result<Elements<'a, i128>, String> {
        let read: ReadElements<i128> = match (self.header.kind, self.header.size) {
            ('i', 1) => |array, elements, to| array.read(elements, to, |cell| i8::from_le_bytes(cell).into()),
            ('i', 2) => |array, elements, to| array.read(elements, to, |cell| i16::from_le_bytes(cell).into()),
            ('i', 4) => |array, elements, to| array.read(elements, to, |cell| i32::from_le_bytes(cell).into()),
            ('i', 8) => |array, elements, to| array.read(elements, to, |cell| i64::from_le_bytes(cell).into()),
            ('u', 1) => |array, elements, to| array.read(elements, to, |cell| u8::from_le_bytes(cell).into()),
            ('u', 2) => |array, elements, to| array.read(elements, to, |cell| u16::from_le_bytes(cell).into()),
            ('u', 4) => |array, elements, to| array.read(elements, to, |cell| u32::from_le_bytes(cell).into()),
            ('u', 8) => |array, elements, to| array.read(elements, to, |cell| u64::from_le_bytes(cell).into()),
            _ => return Err(self.other_type("integers")),
        };
        Ok(Elements { array: self, read })
    }

    /// Elements as truth values.
    pub(crate) fn into_bools(self) -> Result<Elements<'a, bool>, String> {
        let read: ReadElements<bool> = match (self.header.kind, self.header.size) {
            ('b' | 'u' | 'i', 1) => |array, elements, to| array.read(elements, to, |cell| cell != [0; 1]),
            ('u' | 'i', 2) => |array, elements, to| array.read(elements, to, |cell| cell != [0; 2]),
            ('u' | 'i', 4) => |array, elements, to| array.read(elements, to, |cell| cell != [0; 4]),
            ('u' | 'i', 8) => |array, elements, to| array.read(elements, to, |cell| cell != [0; 8]),
            _ => return Err(self.other_type("bool or uint8")),
        };
        Ok(Elements { array: self, read })
    }

    /// Elements as text, the last index running fastest.
    pub(crate) fn texts(&self) -> Result<Vec<String>, String> {
        let unsound = || "needed text, found characters that do not exist".to_owned();
        let read = |cell: &[u8]| match self.header.kind {
            'U' => {
                let code_points = cell.as_chunks().0.iter().map(|point| u32::from_le_bytes(self.little_endian(*point)));
                let text: Option<String> = code_points.map(char::from_u32).collect();
                text.ok_or_else(unsound)
            }
            'S' => String::from_utf8(cell.to_vec()).map_err(|_| unsound()),
            _ => Err(self.other_type("text (dtype str or bytes)")),
        };
        let cell = |element| &self.data[self.place(element) * self.header.size..][..self.header.size];
        // Texts are padded to the length of the longest.
        (0..self.count())
            .map(|element| read(cell(element)).map(|text| text.trim_end_matches('\0').to_owned()))
            .collect()
    }

    /// Appends elements of N bytes, each made from its bytes, the lowest first.
    fn read<const N: usize, T>(&self, elements: Range<usize>, to: &mut Vec<T>, value: impl Fn([u8; N]) -> T) {
        let (cells, _) = self.data.as_chunks::<N>();
        if self.header.fortran_order || self.header.big_endian {
            to.extend(elements.map(|element| value(self.little_endian(cells[self.place(element)]))));
        } else {
            to.extend(cells[elements].iter().map(|cell| value(*cell)));
        }
    }

    /// Where an element is in the file.
    fn place(&self, element: usize) -> usize {
        if !self.header.fortran_order {
            return element;
        }
        let (mut stride, mut rest, mut place) = (self.count(), element, 0);
        for length in self.header.shape.iter().rev() {
            stride /= length;
            place += rest % length * stride;
            rest /= length;
        }
        place
    }

    fn little_endian<const N: usize>(&self, mut cell: [u8; N]) -> [u8; N] {
        if self.header.big_endian {
            cell.reverse();
        }
        cell
    }

    fn other_type(&self, needed: &str) -> String {
        let Header { kind, size, .. } = &self.header;
        format!(
            "needed {needed}, found dtype `{kind}{}`; convert it with astype",
            if *kind == 'U' { size / 4 } else { *size }
        )
    }
}

fn take<const N: usize>(file: &mut impl Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).map_err(|error| format!("the header ends early ({error})"))?;
    Ok(bytes)
}

/// What is left to read of a header such as `{'descr': '<f8', 'fortran_order': False, 'shape': (4, 2, 3), }`.
struct Scanner<'a>(&'a str);

impl<'a> Scanner<'a> {
    fn header(mut self) -> Result<Header, String> {
        let (mut dtype, mut fortran_order, mut shape) = (None, None, None);
        self.expect("{")?;
        while !self.eat("}") {
            let key = self.quoted()?;
            self.expect(":")?;
            match key {
                "descr" => dtype = Some(self.dtype()?),
                "fortran_order" => fortran_order = Some(self.boolean()?),
                "shape" => shape = Some(self.shape()?),
                _ => return Err(format!("the header has an unknown key {}", quoted(key))),
            }
            if !self.eat(",") {
                self.expect("}")?;
                break;
            }
        }
        let incomplete = "the header needs descr, fortran_order and shape";
        let (big_endian, kind, size) = dtype.ok_or(incomplete)?;
        let (fortran_order, shape) = (fortran_order.ok_or(incomplete)?, shape.ok_or(incomplete)?);
        Ok(Header { big_endian, kind, size, fortran_order, shape })
    }

    fn eat(&mut self, token: &str) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        if self.eat(token) {
            Ok(())
        } else {
            Err(format!("the header needs `{token}` at {}", quoted(self.0.trim_start())))
        }
    }

    fn quoted(&mut self) -> Result<&'a str, String> {
        let quote = if self.eat("'") { '\'' } else { self.expect("\"").map(|()| '"')? };
        let (text, rest) = self.0.split_once(quote).ok_or("the header has a quote left open")?;
        self.0 = rest;
        Ok(text)
    }

    fn boolean(&mut self) -> Result<bool, String> {
        if self.eat("True") { Ok(true) } else { self.expect("False").map(|()| false) }
    }

    fn shape(&mut self) -> Result<Vec<usize>, String> {
        self.expect("(")?;
        let (lengths, rest) = self.0.split_once(')').ok_or("the header has a shape left open")?;
        self.0 = rest;
        let lengths = lengths.split(',').map(str::trim).filter(|length| !length.is_empty());
        lengths
            .map(|length| length.parse().map_err(|_| format!("the shape has the length {}", quoted(length))))
            .collect()
    }

    /// Whether big-endian, the letter of the type, and the size of an element in bytes.
    fn dtype(&mut self) -> Result<(bool, char, usize), String> {
        let refused = |dtype: &str| {
            format!(
                "needed an array of numbers or text, found dtype {}; objects and records are not read",
                quoted(dtype)
            )
        };
        if self.eat("[") {
            return Err(refused(&format!("[{}", self.0)));
        }
        let dtype = self.quoted()?;
        let (big_endian, rest) = match dtype.strip_prefix(['<', '|', '=']) {
            Some(rest) => (false, rest),
            None => (true, dtype.strip_prefix('>').ok_or_else(|| refused(dtype))?),
        };
        let kind = rest.chars().next().filter(|kind| "fiubUS".contains(*kind)).ok_or_else(|| refused(dtype))?;
        let count: usize = rest[1..].parse().map_err(|_| refused(dtype))?;
        let size = count.checked_mul(if kind == 'U' { 4 } else { 1 }).filter(|size| *size > 0);
        Ok((big_endian, kind, size.ok_or_else(|| refused(dtype))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let length = u16::try_from(header.len()).expect("a short header").to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
    }

    fn array(dtype: &str, fortran_order: &str, shape: &str, data: &[u8]) -> Array<'static> {
        let file =
            file(&format!("{{'descr': '{dtype}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}\n"), data);
        let mut rest = &file[..];
        let header = Header::read(&mut rest).expect("a sound header");
        Array::new(header, rest.to_vec().into()).expect("as many bytes as announced")
    }

    fn refused(header: &str) -> String {
        Header::read(&mut &file(header, &[])[..]).expect_err("refused")
    }

    #[test]
    fn both_byte_orders_and_both_precisions_are_read() {
        let value = 0.1_f32;
        let wide = f64::from(value);
        assert_eq!(
            array("<f4", "False", "(1,)", &value.to_le_bytes()).into_floats().map(|elements| elements.all()),
            Ok(vec![wide])
        );
        assert_eq!(
            array(">f4", "False", "(1,)", &value.to_be_bytes()).into_floats().map(|elements| elements.all()),
            Ok(vec![wide])
        );
        assert_eq!(
            array("<f8", "False", "(1,)", &wide.to_le_bytes()).into_floats().map(|elements| elements.all()),
            Ok(vec![wide])
        );
        assert_eq!(
            array(">f8", "False", "()", &wide.to_be_bytes()).into_floats().map(|elements| elements.all()),
            Ok(vec![wide])
        );
        assert_eq!(
            array(">i2", "False", "(2,)", &[255, 254, 0, 3]).into_integers().map(|elements| elements.all()),
            Ok(vec![-2, 3])
        );
        assert_eq!(
            array("|b1", "False", "(2,)", &[0, 1]).into_bools().map(|elements| elements.all()),
            Ok(vec![false, true])
        );
    }

    #[test]
    fn elements_in_fortran_order_come_in_c_order() {
        let columns_first = array("|u1", "True", "(2, 3)", &[0, 10, 1, 11, 2, 12]);
        assert_eq!(columns_first.into_integers().map(|elements| elements.all()), Ok(vec![0, 1, 2, 10, 11, 12]));
        let cube = array("|u1", "True", "(2, 2, 2)", &[0, 100, 10, 110, 1, 101, 11, 111]);
        assert_eq!(cube.into_integers().map(|elements| elements.all()), Ok(vec![0, 1, 10, 11, 100, 101, 110, 111]));
        assert_eq!(array("|u1", "True", "(0, 3)", &[]).into_integers().map(|elements| elements.all()), Ok(vec![]));
    }

    #[test]
    fn text_is_unicode_or_bytes() {
        let wide: Vec<u8> = "ü\0".chars().flat_map(|letter| u32::from(letter).to_be_bytes()).collect();
        assert_eq!(array(">U2", "False", "(1,)", &wide).texts(), Ok(vec!["ü".into()]));
        assert_eq!(array("|S2", "False", "(2,)", b"abc\0").texts(), Ok(vec!["ab".into(), "c".into()]));
        assert!(array("<U1", "False", "(1,)", &[0, 0, 0, 255]).texts().is_err());
        assert!(array("|S1", "False", "(1,)", &[255]).texts().is_err());
    }

    #[test]
    fn another_type_is_refused_by_name() {
        let error =
            array("<U2", "False", "(1,)", &[0; 8]).into_floats().map(|elements| elements.all()).expect_err("text");
        assert_eq!(error, "needed float64 or float32, found dtype `U2`; convert it with astype");
    }

    #[test]
    fn objects_records_and_bad_headers_are_refused() {
        let of = |dtype: &str| refused(&format!("{{'descr': {dtype}, 'fortran_order': False, 'shape': (1,)}}"));
        for dtype in ["'|O'", "'O'", "[('x', '<f8')]", "'<f'", "'<U0'", "'<é8'", "'<U99999999999999999999'", "''"] {
            assert!(of(dtype).starts_with("needed an array of numbers or text, found dtype"), "{}", of(dtype));
        }
        assert!(refused("{'descr': '<f8', 'fortran_order': False}").contains("needs descr, fortran_order and shape"));
        assert!(refused("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}").contains("the length `-1`"));
        assert!(refused("{'descr': '<f8").contains("quote left open"));
        assert!(refused(&"[".repeat(60_000)).starts_with("the header needs `{`"));
        assert!(Header::read(&mut &b"\x93NUMPY\x02\x00\xff\xff\xff\xff"[..]).expect_err("long").contains("4294967295"));
        assert!(Header::read(&mut &b"PK"[..]).is_err());
    }

    #[test]
    fn shapes_that_cannot_be_counted_or_filled_are_noticed() {
        let header = |shape: &str| {
            let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}");
            Header::read(&mut &file(&header, &[])[..]).expect("a sound header")
        };
        assert_eq!(header("(4294967296, 4294967296, 3)").bytes(), None);
        assert!(Array::new(header("(2,)"), vec![0; 15].into()).is_none());
    }
}
