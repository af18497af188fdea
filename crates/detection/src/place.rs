//! Where in a configuration's text a rule is wrong.

use std::ops::Range;

use jointscope_models::settings::SettingsError;
use jointscope_scoring::RuleError;
use toml::de::DeTable;

use crate::configuration::beginning;

/// An error of a rule, with its place in the text of the configuration that the rule is from.
pub fn in_text(text: &str, error: RuleError) -> SettingsError {
    let place = find(text, &error).unwrap_or(beginning(text));
    SettingsError::at(place, error.message).help(error.help)
}

fn find(text: &str, error: &RuleError) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let scoring = root.as_ref().get("scoring")?;
    let whole = scoring.span();
    let Some(value) = scoring.as_ref().as_table()?.get(error.key) else { return Some(whole) };
    let Some(entry) = &error.entry else { return Some(value.span()) };
    let Some(written) = value.as_ref().as_table().and_then(|table| table.get(entry.as_str())) else {
        return Some(value.span());
    };
    let Some(within) = &error.within else { return Some(written.span()) };
    let span = written.span();
    let raw = text.get(span.clone())?;
    let [start, end] = [within.start, within.end].map(|at| span.start + offset(raw, at));
    // What is missing at the end of a text is shown at the letter behind it.
    let letter = text[start..].chars().next().map_or(0, char::len_utf8);
    Some(start..end.max((start + letter).min(span.end)))
}

/// Where in a string as TOML writes it the byte `at` of its value stands.
fn offset(raw: &str, at: usize) -> usize {
    let quote = if ["\"\"\"", "'''"].iter().any(|quote| raw.starts_with(quote)) { 3 } else { 1 };
    let mut place = quote;
    if quote == 3 {
        // A line break right behind the quotes does not count.
        place += ["\r\n", "\n"].iter().find(|end| raw[place..].starts_with(**end)).map_or(0, |end| end.len());
    }
    if raw.starts_with('\'') {
        return (place + at).min(raw.len());
    }
    let mut value = 0;
    while value < at {
        let rest = &raw[place..];
        let Some(letter) = rest.chars().next() else { break };
        if letter != '\\' {
            (value, place) = (value + letter.len_utf8(), place + letter.len_utf8());
            continue;
        }
        let digits = match rest[1..].chars().next() {
            Some('u') => 4,
            Some('U') => 8,
            Some('x') => 2,
            // The break of a line, and the blanks that follow.
            Some(blank) if blank.is_whitespace() => {
                place += rest.len() - rest[1..].trim_start().len();
                continue;
            }
            _ => 0,
        };
        let code = rest.get(2..2 + digits).and_then(|code| u32::from_str_radix(code, 16).ok());
        value += code.filter(|_| digits > 0).and_then(char::from_u32).map_or(1, char::len_utf8);
        place += 2 + digits;
    }
    place.min(raw.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_in_every_kind_of_string() {
        for raw in [
            "\"a + bad\"",
            "'a + bad'",
            "\"\"\"\na + bad\"\"\"",
            "'''a + bad'''",
            "\"\\u0061 + bad\"",
            "\"a\\t+ bad\"",
            "\"\"\"a \\\n      + bad\"\"\"",
            "\"\\U00000061 \\x2b bad\"",
        ] {
            assert_eq!(&raw[offset(raw, 4)..offset(raw, 7)], "bad", "{raw}");
        }
        assert_eq!(&"\"\\u00fc bad\""[offset("\"\\u00fc bad\"", 3)..][..3], "bad");
    }
}
