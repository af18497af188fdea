//! What the text formats have in common.

use std::path::Path;

use crate::RecordingError;

/// The text of a file, without byte order mark.
pub(crate) fn decode<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str, RecordingError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let sound = &bytes[..error.valid_up_to()];
        let line = 1 + sound.split(|byte| *byte == b'\n').skip(1).count() as u64;
        let problem = format!("needed UTF-8 text, but byte {} of the file is not; save the file as UTF-8", sound.len());
        RecordingError::at_line(path, line, problem)
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The number in a cell; NaN if the cell is empty or says NaN.
pub(crate) fn number(cell: &str) -> Result<f64, String> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    match cell.parse::<f64>() {
        Ok(value) if value.is_infinite() => {
            Err(format!("needed a finite number, found {}; leave missing samples empty or NaN", quoted(cell)))
        }
        Ok(value) => Ok(value),
        Err(_) if cell.contains(',') => {
            Err(format!("needed a number, found {}; write decimals with a point", quoted(cell)))
        }
        Err(_) => Err(format!("needed a number, found {}; leave missing samples empty or NaN", quoted(cell))),
    }
}

/// A cell without the blanks around it; most have none, which its first and last byte tell.
pub(crate) fn trimmed(cell: &str) -> &str {
    match cell.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => cell,
        _ => cell.trim(),
    }
}

/// A text from a file as messages show it: short, and without characters that would disturb a terminal.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let shown: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().nth(LONGEST).is_some() { format!("`{shown}…`") } else { format!("`{shown}`") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_is_not_utf_8_is_refused_with_line_and_byte() {
        let error = decode(b"frame\n0,\xff\n", Path::new("a.csv")).expect_err("latin 1").to_string();
        assert_eq!(error, "a.csv, line 2: needed UTF-8 text, but byte 8 of the file is not; save the file as UTF-8");
        assert_eq!(decode("\u{feff}x".as_bytes(), Path::new("a.csv")).expect("a mark and text"), "x");
    }

    #[test]
    fn numbers_are_finite_or_missing() {
        assert!(number("-1.5e-3").expect("a number").to_bits() == (-1.5e-3f64).to_bits());
        for missing in ["", "nan", "NaN", "NAN"] {
            assert!(number(missing).expect("missing").is_nan());
        }
        for infinite in ["inf", "-Infinity", "1e999"] {
            assert!(number(infinite).expect_err("infinite").starts_with("needed a finite number"));
        }
        assert!(number("0,5").expect_err("comma").ends_with("write decimals with a point"));
        assert!(number("left").expect_err("text").starts_with("needed a number, found `left`"));
    }

    #[test]
    fn long_and_unprintable_text_is_shown_short_and_plain() {
        assert_eq!(quoted("a\u{1b}[31m"), "`a\\u{1b}[31m`");
        assert_eq!(quoted(&"x".repeat(1000)).chars().count(), 43);
    }
}
