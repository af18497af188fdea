//! Colours and words of pictures.

use std::fmt::Write;

use jointscope_detection::{Detection, JointKind};

use crate::printable;

/// Of bodies, told apart by people who see few colours, on white and on black.
const PALETTE: [&str; 8] = ["#2f6fde", "#e0701a", "#1a9a76", "#c23b8f", "#8265d8", "#b58a00", "#1499bd", "#d1434b"];
/// Of the body from which everything is seen.
const GROUND: &str = "#8792a2";

pub(crate) const INK: &str = "#1b2430";
pub(crate) const FAINT: &str = "#6b7685";
pub(crate) const RULE: &str = "#dfe4ea";
pub(crate) const BAND: &str = "#2f6fde";
pub(crate) const AXIS: &str = "#d6246e";
pub(crate) const FONT: &str = "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif";

/// One colour for each body; the base is grey.
pub(crate) fn colours(detection: &Detection) -> Vec<&'static str> {
    let mut others = PALETTE.iter().cycle();
    let base = detection.structure.base;
    (0..detection.bodies.len())
        .map(|body| if body == base { GROUND } else { others.next().unwrap_or(&GROUND) })
        .collect()
}

/// Untrusted text as part of XML or HTML.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            // Neither is a character of XML.
            '\u{fffe}' | '\u{ffff}' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A coordinate of a picture, in pixels: one decimal, no negative zero.
pub(crate) fn pixel(x: f64) -> String {
    let x = (x * 10.0).round() / 10.0 + 0.0;
    format!("{x}")
}

/// A pictogram of a joint, 32 by 32 pixels: what stays in grey, what moves in colour.
pub(crate) fn icon(kind: JointKind) -> String {
    let still = |shape: &str| format!("<g class=\"icon-still\" fill=\"none\" stroke=\"{FAINT}\">{shape}</g>");
    let moves = |shape: &str| format!("<g class=\"icon-moves\" fill=\"none\" stroke=\"{BAND}\">{shape}</g>");
    let axis = |shape: &str| format!("<g class=\"icon-axis\" fill=\"none\" stroke=\"{AXIS}\">{shape}</g>");
    let arrow = |x: f64, y: f64, dx: f64, dy: f64| {
        let (sx, sy) = (-dy * 0.6, dx * 0.6);
        let mut path = String::new();
        let _ = write!(
            path,
            "<path d=\"M{} {}L{x} {y}L{} {}\"/>",
            pixel(x - dx + sx),
            pixel(y - dy + sy),
            pixel(x - dx - sx),
            pixel(y - dy - sy)
        );
        path
    };
    let shape = match kind {
        JointKind::Rigid => {
            still("<rect x=\"4\" y=\"9\" width=\"13\" height=\"14\" rx=\"2\"/>")
                + &moves("<rect x=\"15\" y=\"9\" width=\"13\" height=\"14\" rx=\"2\"/>")
                + &axis("<path d=\"M12 16h8\"/>")
        }
        JointKind::Prismatic => {
            still("<path d=\"M3 23h26M3 26h26\"/>")
                + &moves("<rect x=\"6\" y=\"12\" width=\"11\" height=\"9\" rx=\"2\"/>")
                + &axis(&("<path d=\"M19 16h9\"/>".to_owned() + &arrow(28.5, 16.0, 4.0, 0.0)))
        }
        JointKind::Revolute => {
            still("<path d=\"M8 27V8\"/>")
                + &moves("<path d=\"M8 24L25 13\"/>")
                + &axis(
                    &("<circle cx=\"8\" cy=\"24\" r=\"2.6\"/><path d=\"M13 8a17 17 0 0 1 9.500 5\"/>".to_owned()
                        + &arrow(12.0, 7.8, -4.0, 0.4)),
                )
        }
        JointKind::Elliptical { .. } => {
            still("<circle cx=\"16\" cy=\"16\" r=\"2.6\"/>")
                + &moves("<path d=\"M16 16L27 13\"/>")
                + &axis("<ellipse cx=\"16\" cy=\"16\" rx=\"13\" ry=\"7.500\"/>")
        }
        JointKind::Screw { .. } => {
            still("<path d=\"M16 3v26\"/>")
                + &moves("<path d=\"M9 9q7 5 14 0M9 15q7 5 14 0M9 21q7 5 14 0\"/>")
                + &axis(&arrow(16.0, 29.0, 0.0, 4.0))
        }
        JointKind::Cylindrical => {
            still("<path d=\"M3 16h26\"/>")
                + &moves("<rect x=\"9\" y=\"10\" width=\"12\" height=\"12\" rx=\"2\"/>")
                + &axis(
                    &("<path d=\"M11 6a5 4 0 0 1 9 0\"/>".to_owned()
                        + &arrow(20.0, 6.5, 1.0, 3.6)
                        + &arrow(29.0, 16.0, 4.0, 0.0)),
                )
        }
        JointKind::Planar => {
            still("<path d=\"M3 24L11 9H30L22 24Z\"/>")
                + &axis(
                    &("<path d=\"M16 17h8M16 17l-3 5\"/>".to_owned()
                        + &arrow(25.0, 17.0, 3.2, 0.0)
                        + &arrow(12.6, 22.6, -1.6, 2.6)),
                )
                + &moves("<circle cx=\"16\" cy=\"17\" r=\"2.6\"/>")
        }
        JointKind::Spherical => {
            still("<path d=\"M5 16a11 11 0 0 0 22 0\"/>")
                + &moves("<circle cx=\"16\" cy=\"16\" r=\"6.500\"/><path d=\"M16 9.500V2\"/>")
                + &axis("<circle cx=\"16\" cy=\"16\" r=\"1\"/>")
        }
        JointKind::Universal => {
            still("<path d=\"M4 6v20h6\"/>")
                + &moves("<path d=\"M28 26V6h-6\"/>")
                + &axis("<path d=\"M8 16h16M16 8v16\"/>")
        }
        JointKind::Disconnected => {
            still("<rect x=\"3\" y=\"12\" width=\"9\" height=\"11\" rx=\"2\"/>")
                + &moves("<rect x=\"20\" y=\"8\" width=\"9\" height=\"11\" rx=\"2\"/>")
                + &axis("<path d=\"M16 5v22\" stroke-dasharray=\"2 3\"/>")
        }
    };
    format!("<g stroke-width=\"2\" stroke-linecap=\"round\" stroke-linejoin=\"round\">{shape}</g>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_files_are_only_text() {
        assert_eq!(escaped("<script>\"&'\u{1}"), "&lt;script&gt;&quot;&amp;&#39;\\u{1}");
        assert_eq!([-0.01, 12.34].map(pixel), ["0", "12.3"]);
    }
}
