//! Text from files as a terminal can show it.

/// The text with every character that would disturb a terminal or a table written as its code, such as `\u{1b}`.
///
/// These are control characters, line and paragraph separators, and marks that turn the direction of writing. All
/// other characters, of whatever script, stay as they are.
pub fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        let disturbs = c.is_control()
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
        if disturbs {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_disturbs_is_written_as_its_code() {
        assert_eq!(printable("Kühlschrank 冷蔵庫 \"1\""), "Kühlschrank 冷蔵庫 \"1\"");
        assert_eq!(printable("a\u{1b}[31m\tb\r\nc"), "a\\u{1b}[31m\\tb\\r\\nc");
        assert_eq!(printable("a\u{202e}b"), "a\\u{202e}b");
    }
}
