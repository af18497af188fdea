//! Text cut into rows of cells, which may be quoted.

use std::borrow::Cow;

use memchr::{memchr, memchr3};

/// Cuts a text from some place on.
///
/// A row ends with a line feed or a carriage return, and rows without any cell are passed over. A cell that begins with a
/// quote goes on to the next quote, over separators and line ends; two quotes in it are one. What follows the closing quote
/// belongs to the cell, and a quote inside of a cell that begins without one stands for itself.
pub(crate) struct Cutter<'a> {
    text: &'a str,
    separator: u8,
    /// Where the next row begins, or blank lines before it, in bytes.
    pub position: usize,
    /// Whether the text ended inside of quotes.
    pub open: bool,
}

impl<'a> Cutter<'a> {
    pub(crate) fn new(text: &'a str, separator: u8, position: usize) -> Self {
        Self { text, separator, position, open: false }
    }

    /// Cuts the next row into `cells`, and tells where it begins; `None` at the end of the text.
    pub(crate) fn row(&mut self, cells: &mut Vec<Cow<'a, str>>) -> Option<usize> {
        cells.clear();
        let bytes = self.text.as_bytes();
        let blank = bytes.get(self.position..)?.iter().position(|byte| !matches!(byte, b'\n' | b'\r'))?;
        let begin = self.position + blank;
        self.position = begin;
        loop {
            cells.push(if bytes.get(self.position) == Some(&b'"') { self.quoted() } else { self.plain().into() });
            let end = bytes.get(self.position);
            self.position += usize::from(end.is_some());
            if end != Some(&self.separator) {
                return Some(begin);
            }
        }
    }

    /// What comes before the next separator or line end.
    fn plain(&mut self) -> &'a str {
        let rest = &self.text[self.position..];
        let length = memchr3(self.separator, b'\n', b'\r', rest.as_bytes()).unwrap_or(rest.len());
        self.position += length;
        &rest[..length]
    }

    fn quoted(&mut self) -> Cow<'a, str> {
        let mut cell = Cow::Borrowed("");
        loop {
            // Behind a quote.
            self.position += 1;
            let rest = &self.text[self.position..];
            let Some(length) = memchr(b'"', rest.as_bytes()) else {
                self.open = true;
                self.position = self.text.len();
                return cell + rest;
            };
            cell += &rest[..length];
            self.position += length + 1;
            if self.text.as_bytes().get(self.position) != Some(&b'"') {
                return cell + self.plain();
            }
            cell += "\"";
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rows(text: &str) -> Vec<Vec<String>> {
        let (mut cutter, mut cells, mut rows) = (Cutter::new(text, b',', 0), Vec::new(), Vec::new());
        while cutter.row(&mut cells).is_some() {
            rows.push(cells.iter().map(ToString::to_string).collect());
        }
        rows
    }

    #[test]
    fn plain_cells_are_parts_of_the_text() {
        let (mut cutter, mut cells) = (Cutter::new("\r\na,\"b\",\r\nc", b',', 0), Vec::new());
        assert_eq!(cutter.row(&mut cells), Some(2));
        assert_eq!(cells, ["a", "b", ""]);
        assert!(cells.iter().all(|cell| matches!(cell, Cow::Borrowed(_))));
        assert_eq!((cutter.row(&mut cells), cells.len(), cutter.row(&mut cells)), (Some(10), 1, None));
    }

    #[test]
    fn quotes_hold_separators_line_ends_and_quotes() {
        assert_eq!(rows("\"a,\n\"\"b\"\"\"c,d\"e\"\n"), [["a,\n\"b\"c", "d\"e\""]]);
        let mut cutter = Cutter::new("a,\"b\nc,d\n", b',', 0);
        let mut cells = Vec::new();
        assert_eq!((cutter.row(&mut cells), cutter.open), (Some(0), true));
        assert_eq!(cells, ["a", "b\nc,d\n"]);
    }

    proptest! {
        #[test]
        fn rows_and_cells_are_those_of_the_library_that_writes_them(text in "[a\",\n\r]{0,40}") {
            let mut reader =
                csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
            let theirs: Vec<Vec<String>> = reader
                .records()
                .map(|row| row.expect("text").iter().map(ToOwned::to_owned).collect())
                .collect();
            prop_assert_eq!(rows(&text), theirs);
        }
    }
}
