//! Where things stand in a configuration.

use std::ops::Range;

use jointscope_models::toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// Where a table says `word` under a key: the word itself, the whole value if the word is not in it, or nothing
/// if there is no such key.
pub(crate) fn of_word(text: &str, table: &str, key: &str, word: &str) -> Range<usize> {
    let find = || {
        let root = DeTable::parse(text).ok()?;
        let value = root.as_ref().get(table)?.as_ref().as_table()?.get(key)?;
        Some(in_value(value, word).unwrap_or_else(|| value.span()))
    };
    find().unwrap_or(0..0)
}

fn in_value(value: &Spanned<DeValue<'_>>, word: &str) -> Option<Range<usize>> {
    match value.as_ref() {
        DeValue::String(found) => (found == word).then(|| value.span()),
        DeValue::Array(values) => values.iter().find_map(|value| in_value(value, word)),
        DeValue::Table(table) => table.values().find_map(|value| in_value(value, word)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_in_lists_of_lists() {
        let text = "[recording]\nworld = 'w'\npairs = [['a', 'b'], ['a', 'c']]";
        assert_eq!(&text[of_word(text, "recording", "pairs", "c")], "'c'");
        assert_eq!(&text[of_word(text, "recording", "world", "other")], "'w'");
        assert_eq!(of_word(text, "recording", "scene", "w"), 0..0);
    }
}
