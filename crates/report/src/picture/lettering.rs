//! Texts that keep within their room: an SVG neither breaks lines nor tells how wide letters are.

use crate::printable;

/// How wide letters are, in heights of the font: as wide as those of the widest usual one, `DejaVu` Sans.
const NARROW: f64 = 0.42;
const USUAL: f64 = 0.63;
const BROAD: f64 = 0.80;
const FULL: f64 = 1.05;
/// How much wider bold letters are.
const BOLD: f64 = 1.11;

/// A size in pixels, and a weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lettering {
    pub(super) size: f64,
    pub(super) bold: bool,
}

impl Lettering {
    pub(super) const fn of(size: f64) -> Self {
        Self { size, bold: false }
    }

    pub(super) const fn bold(size: f64) -> Self {
        Self { size, bold: true }
    }

    /// About how wide a text is, pixels.
    pub(super) fn width(self, text: &str) -> f64 {
        let letter = |c: char| match c {
            'f' | 'i' | 'j' | 'l' | 'r' | 't' | 'I' | ' ' | '.' | ',' | ':' | ';' | '-' | '\'' | '|' | '(' | ')' => {
                NARROW
            }
            'm' | 'w' | 'M' | 'W' | '@' | '%' | '…' => FULL,
            c if c.is_uppercase() => BROAD,
            c if c < '\u{1100}' => USUAL,
            _ => FULL,
        };
        let weight = if self.bold { BOLD } else { 1.0 };
        self.size * weight * text.chars().map(letter).sum::<f64>()
    }

    /// The text, without letters in its middle where it is wider than so many pixels.
    pub(super) fn fitted(self, text: &str, room: f64) -> String {
        let text = printable(text);
        let letters = text.chars().count();
        // More letters than these fit nowhere.
        let mut shorter = (2..=letters.min(300)).rev().map(|most| shortened(&text, most));
        shorter.find(|text| self.width(text) <= room).unwrap_or_else(|| shortened(&text, 2))
    }

    /// The text in lines no wider than so many pixels, but for longer words.
    pub(super) fn lines(self, text: &str, room: f64) -> Vec<String> {
        let mut lines = vec![String::new()];
        for word in text.split(' ') {
            let line = lines.len() - 1;
            let longer = if lines[line].is_empty() { word.to_owned() } else { format!("{} {word}", lines[line]) };
            if lines[line].is_empty() || self.width(&longer) <= room {
                lines[line] = longer;
            } else {
                lines.push(word.to_owned());
            }
        }
        lines
    }
}

/// The text cut to so many characters: its beginning and its end, which tell most names apart.
fn shortened(text: &str, most: usize) -> String {
    let letters = text.chars().count();
    if letters <= most {
        return text.to_owned();
    }
    let kept = most.saturating_sub(1);
    let start = text.chars().take(kept.div_ceil(2));
    start.chain(['…']).chain(text.chars().skip(letters - kept / 2)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_ends_and_sentences_all_their_words() {
        assert_eq!(shortened("a long name", 6), "a l…me");
        let small = Lettering::of(10.0);
        assert_eq!(small.fitted("door", 100.0), "door");
        let fitted = small.fitted("segment:thigh_of_the_left_leg", 80.0);
        assert!(fitted.starts_with("seg") && fitted.ends_with("leg") && small.width(&fitted) <= 80.0, "{fitted}");
        let sentence = "bottom-drawer slides by 322 mm on top-drawer ?";
        let lines = Lettering::bold(14.0).lines(sentence, 332.0);
        assert_eq!(lines.join(" "), sentence);
        assert!(lines.len() == 2 && lines.iter().all(|line| Lettering::bold(14.0).width(line) <= 332.0), "{lines:?}");
    }
}
