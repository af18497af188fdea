//! No text makes the reading of a configuration panic, and every error points into the text.

use jointscope_detection::Configuration;
use jointscope_models::Catalog;
use proptest::{prelude::*, sample::Index, test_runner::RngSeed};

const THESIS: &str = include_str!("../../../configs/thesis.toml");

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(1979), ..ProptestConfig::default() }
}

/// Reads a text; what is wrong must have words and a place that slices the text.
fn read(text: &str) -> Result<bool, TestCaseError> {
    match Configuration::parse(text, &Catalog::linked().expect("unique names")) {
        Ok(configuration) => {
            prop_assert!(!configuration.models.is_empty());
            Ok(true)
        }
        Err(error) => {
            prop_assert!(!error.message.is_empty());
            prop_assert!(error.help.as_deref() != Some(""));
            let place = text.get(error.span.clone());
            prop_assert!(place.is_some(), "{:?} does not slice a text of {} bytes", error.span, text.len());
            Ok(false)
        }
    }
}

/// What is written into a text: pieces of TOML, of configurations, and of trouble.
fn piece() -> impl Strategy<Value = String> {
    let pieces = [
        "\n",
        "[",
        "]",
        "[[",
        "]]",
        "=",
        "\"",
        "'",
        "'''",
        "\"\"\"",
        "#",
        ".",
        ",",
        "{",
        "}",
        "\\u{",
        "\\",
        "\u{feff}",
        "\u{feff}[models.hinge]\nkind = 'thesis-rigid'",
        "\r",
        "\0",
        "ü",
        "日本",
        "🚪",
        "e\u{301}",
        "nan",
        "-inf",
        "1e999",
        "9223372036854775808",
        "0x",
        "1979-05-27",
        "true",
        "[recording]\n",
        "[motion]\n",
        "[models]\n",
        "[models.rigid]\n",
        "[scoring]\n",
        "[models.\"ü\"]\n",
        "\nkind = ",
        "\nkind = 3\n",
        "\norder = []\n",
        "\npairs = [[\"a\"]]\n",
        "\npath = 'ü'\nscene = 'ü'\n",
        "\nnoise = {}\n",
        "\nseed = -1\n",
        "registration = ",
        "'thesis-rigid'",
        "\nrule = \"ü\"\n",
        "= = =",
        "\nsections = 1e6\n",
        "\nfrom = { to = [1, { x = 'é' }] }\n",
        "\nötherwise = 'x'\n",
        "\n\"ötherwise\" = 'x'\n",
    ];
    prop_oneof![
        6 => prop::sample::select(pieces.to_vec()).prop_map(String::from),
        1 => ".{0,4}",
        1 => Just(format!("x = {}", "[".repeat(2000))),
    ]
}

/// One change of a text.
#[derive(Debug, Clone)]
enum Change {
    Insert(Index, String),
    Remove(Index, usize),
    Replace(Index, usize, String),
    RepeatLine(Index),
    RemoveLine(Index),
    SwapLines(Index, Index),
    Cut(Index),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        (any::<Index>(), piece()).prop_map(|(at, piece)| Change::Insert(at, piece)),
        (any::<Index>(), 1..12_usize).prop_map(|(at, count)| Change::Remove(at, count)),
        (any::<Index>(), 1..6_usize, piece()).prop_map(|(at, count, piece)| Change::Replace(at, count, piece)),
        any::<Index>().prop_map(Change::RepeatLine),
        any::<Index>().prop_map(Change::RemoveLine),
        (any::<Index>(), any::<Index>()).prop_map(|(a, b)| Change::SwapLines(a, b)),
        any::<Index>().prop_map(Change::Cut),
    ]
}

impl Change {
    fn apply(&self, text: &str) -> String {
        let characters: Vec<char> = text.chars().collect();
        let mut lines: Vec<&str> = text.lines().collect();
        if lines.is_empty() {
            lines.push("");
        }
        let at = |index: &Index| index.index(characters.len() + 1);
        let with = |from: usize, count: usize, new: &str| {
            let before = characters.iter().take(from);
            let after = characters.iter().skip(from + count);
            before.copied().chain(new.chars()).chain(after.copied()).collect()
        };
        match self {
            Self::Insert(index, piece) => with(at(index), 0, piece),
            Self::Remove(index, count) => with(at(index), *count, ""),
            Self::Replace(index, count, piece) => with(at(index), *count, piece),
            Self::RepeatLine(index) => {
                let line = index.index(lines.len());
                lines.insert(line, lines[line]);
                lines.join("\n")
            }
            Self::RemoveLine(index) => {
                lines.remove(index.index(lines.len()));
                lines.join("\n")
            }
            Self::SwapLines(a, b) => {
                let count = lines.len();
                lines.swap(a.index(count), b.index(count));
                lines.join("\n")
            }
            Self::Cut(index) => with(at(index), characters.len(), ""),
        }
    }
}

proptest! {
    #![proptest_config(config(1000))]

    #[test]
    fn arbitrary_text_is_read_or_refused_with_a_place(text in ".{0,80}|[\\[\\]{}='\"#.,\\\\a-z0-9\n\r \u{feff}é]{0,60}") {
        read(&text)?;
    }

    #[test]
    fn pieces_of_configurations_are_read_or_refused_with_a_place(pieces in prop::collection::vec(piece(), 0..12)) {
        read(&pieces.concat())?;
    }

    #[test]
    fn changed_configurations_are_read_or_refused_with_a_place(changes in prop::collection::vec(change(), 1..6)) {
        let mut text = THESIS.to_owned();
        for change in &changes {
            text = change.apply(&text);
            read(&text)?;
        }
    }
}

#[test]
fn texts_that_point_beside_letters_of_several_bytes_are_refused_with_a_place() {
    for text in [
        "\u{feff}",
        "# é\n[models.é]",
        "\"é\" = 1",
        "é = 1",
        "[models.\"é\"]\nkind = 'é'",
        "[models.rigid]\nkind = 'thesis-rigid'\n# é",
        "[scoring]\nrule = 'cascade'\norder = ['é']",
        "[recording]\npath = 'é'\nscene = 'é'",
        "[motion]\nregistration = 'é",
        "\u{feff}é",
        "\u{feff}[motion]\nregistration = 'shap'",
    ] {
        let refused = read(text).unwrap_or_else(|error| panic!("{text:?}: {error}"));
        assert!(!refused || text == "\u{feff}", "{text:?} was read");
    }
}

#[test]
fn errors_behind_a_byte_order_mark_point_where_they_should() {
    let text = "\u{feff}[motion]\nregistration = 'shap'";
    let error = Configuration::parse(text, &Catalog::linked().expect("unique names")).expect_err("refused");
    assert_eq!(text.get(error.span), Some("'shap'"));
}

#[test]
fn most_changes_of_one_letter_are_refused() {
    let read = |text: &str| read(text).unwrap_or_else(|error| panic!("{error}"));
    assert!(read(THESIS), "the thesis's own profile");
    let (mut read_count, mut count) = (0, 0);
    let mut comment = false;
    for (at, letter) in THESIS.char_indices() {
        comment = letter != '\n' && (comment || letter == '#');
        if letter.is_ascii_alphabetic() && !comment {
            count += 1;
            read_count += u32::from(read(&format!("{}ü{}", &THESIS[..at], &THESIS[at + 1..])));
        }
    }
    // What may change freely is the name of what remains: `disconnected`.
    assert!(count > 300 && read_count == 12, "{read_count} of {count} were read");
}
