//! A chart with axes, as SVG.

use std::fmt::Write;

use super::{
    lettering::Lettering,
    style::{FAINT, FONT, INK, RULE, escaped, pixel},
};

/// Pixels.
pub(crate) const WIDTH: f64 = 340.0;
pub(crate) const HEIGHT: f64 = 250.0;
pub(super) const LEFT: f64 = 52.0;
pub(super) const RIGHT: f64 = 14.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 40.0;

/// What is drawn, in the order in which it is added; coordinates are those of the chart's axes.
///
/// Every mark has a colour of its own and a class, so that a page may colour it anew.
pub(crate) struct Chart {
    title: String,
    across: Scale,
    up: Scale,
    marks: String,
    /// Whether time goes from left to right, so that a page may show the moment.
    timed: bool,
}

/// An axis of a chart: its range, what it shows, and pixels.
#[derive(Clone)]
struct Scale {
    range: [f64; 2],
    label: String,
    pixels: [f64; 2],
}

impl Scale {
    fn at(&self, x: f64) -> f64 {
        let [least, most] = self.range;
        let [from, to] = self.pixels;
        from + (x - least) / (most - least) * (to - from)
    }

    fn ticks(&self) -> Vec<f64> {
        let [least, most] = self.range;
        let room = (self.pixels[1] - self.pixels[0]).abs() / 52.0;
        let rough = (most - least) / room.max(2.0);
        let power = 10_f64.powf(rough.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * power >= rough).unwrap_or(10.0);
        let (first, last) = ((least / step).ceil(), (most / step + 1e-9).floor());
        let count = (last - first).clamp(0.0, 20.0);
        let mut ticks = Vec::new();
        let mut number = 0.0;
        while number <= count {
            ticks.push((first + number) * step);
            number += 1.0;
        }
        ticks
    }
}

/// A range that holds all values, with a margin; never empty.
pub(crate) fn range(values: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
    let [least, most] =
        values.filter(|x| x.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
    if least > most {
        return [0.0, 1.0];
    }
    if least == most {
        // So little that it is seen as one value, and so much that it is a range.
        let half = (1e-6 * least.abs()).max(1e-6);
        return [least - half, most + half];
    }
    let size = most - least;
    [least - margin * size, most + margin * size]
}

impl Chart {
    pub(crate) fn new(title: &str, across: ([f64; 2], &str), up: ([f64; 2], &str)) -> Self {
        let scale = |(range, label): ([f64; 2], &str), pixels| Scale { range, label: label.into(), pixels };
        Self {
            title: title.into(),
            across: scale(across, [LEFT, WIDTH - RIGHT]),
            up: scale(up, [HEIGHT - BOTTOM, TOP]),
            marks: String::new(),
            timed: false,
        }
    }

    /// Lets a metre have the same length on both axes, by showing more of one of them.
    pub(crate) fn square(mut self) -> Self {
        let per = |scale: &Scale| (scale.range[1] - scale.range[0]) / (scale.pixels[1] - scale.pixels[0]).abs();
        let most = per(&self.across).max(per(&self.up));
        for scale in [&mut self.across, &mut self.up] {
            let middle = f64::midpoint(scale.range[0], scale.range[1]);
            let half = most * (scale.pixels[1] - scale.pixels[0]).abs() / 2.0;
            scale.range = [middle - half, middle + half];
        }
        self
    }

    pub(crate) fn timed(mut self) -> Self {
        self.timed = true;
        self
    }

    fn place(&self, [x, y]: [f64; 2]) -> String {
        format!("{},{}", pixel(self.across.at(x)), pixel(self.up.at(y)))
    }

    /// A horizontal band.
    pub(crate) fn band(&mut self, [low, high]: [f64; 2], class: &str, colour: &str) {
        let [bottom, top] = [low, high].map(|y| self.up.at(y).clamp(TOP, HEIGHT - BOTTOM));
        let _ = write!(
            self.marks,
            "<rect class=\"{class}\" x=\"{LEFT}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{colour}\" fill-opacity=\"0.13\"/>",
            pixel(top),
            pixel(WIDTH - LEFT - RIGHT),
            pixel(bottom - top)
        );
    }

    /// A horizontal line across the chart, with a word at its right end.
    pub(crate) fn level(&mut self, y: f64, word: &str, colour: &str) {
        let y = self.up.at(y);
        let _ = write!(
            self.marks,
            "<path class=\"level\" d=\"M{LEFT} {0}H{1}\" stroke=\"{colour}\" stroke-dasharray=\"4 3\" fill=\"none\"/>\
             <text class=\"faint\" x=\"{2}\" y=\"{3}\" text-anchor=\"end\" font-size=\"10.5\" fill=\"{FAINT}\">{4}</text>",
            pixel(y),
            pixel(WIDTH - RIGHT),
            pixel(WIDTH - RIGHT - 3.0),
            pixel(y - 3.5),
            escaped(word)
        );
    }

    /// A word above a place, which it does not leave the chart for.
    pub(crate) fn word(&mut self, [x, y]: [f64; 2], word: &str, colour: &str) {
        let half = 0.5 * Lettering::of(10.5).width(word);
        let x = self.across.at(x).clamp(LEFT + half, (WIDTH - RIGHT - half).max(LEFT + half));
        let class = if colour == FAINT { "faint" } else { "ink" };
        let _ = write!(
            self.marks,
            "<text class=\"{class}\" x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"10.5\" fill=\"{colour}\">{}</text>",
            pixel(x),
            pixel(self.up.at(y) - 4.0),
            escaped(word)
        );
    }

    /// A line through points; a gap where there is none.
    pub(crate) fn line(&mut self, points: impl IntoIterator<Item = Option<[f64; 2]>>, colour: &str, opacity: f64) {
        let mut path = String::new();
        let mut lifted = true;
        for point in points {
            if let Some(point) = point.filter(|p| p.iter().all(|x| x.is_finite())) {
                path += if lifted { "M" } else { "L" };
                path += &self.place(point);
            }
            lifted = point.is_none();
        }
        if !path.is_empty() {
            let _ = write!(
                self.marks,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"{opacity}\" stroke-width=\"1.4\" \
                 stroke-linejoin=\"round\" stroke-linecap=\"round\"/>"
            );
        }
    }

    pub(crate) fn dots(&mut self, points: impl IntoIterator<Item = [f64; 2]>, radius: f64, colour: &str, opacity: f64) {
        // One path of short strokes with round ends is a fifth as long as circles.
        let mut path = String::new();
        for point in points {
            if point.iter().all(|x| x.is_finite()) {
                path += "M";
                path += &self.place(point);
                path += "h0";
            }
        }
        if !path.is_empty() {
            let _ = write!(
                self.marks,
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-opacity=\"{opacity}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
                2.0 * radius
            );
        }
    }

    /// A ring about a point, between two radii, in units of the across axis; `ratio` times as high as wide.
    pub(crate) fn ring(&mut self, centre: [f64; 2], [inner, outer]: [f64; 2], ratio: f64, class: &str, colour: &str) {
        let per = (self.across.at(1.0) - self.across.at(0.0)).abs();
        let middle = f64::midpoint(inner, outer);
        let [x, y] = [self.across.at(centre[0]), self.up.at(centre[1])].map(pixel);
        let shape = if ratio < 1.0 {
            let (wide, high) = (pixel(per * middle), pixel(per * middle * ratio));
            format!("<ellipse class=\"{class}\" cx=\"{x}\" cy=\"{y}\" rx=\"{wide}\" ry=\"{high}\"")
        } else {
            format!("<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{}\"", pixel(per * middle))
        };
        let _ = write!(
            self.marks,
            "{shape} fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.16\" stroke-width=\"{}\"/>",
            pixel((per * (outer - inner)).max(1.0))
        );
    }

    /// The mark of an axis that points at the reader.
    pub(crate) fn pivot(&mut self, at: [f64; 2], colour: &str) {
        let [x, y] = [pixel(self.across.at(at[0])), pixel(self.up.at(at[1]))];
        let _ = write!(
            self.marks,
            "<g class=\"axis\"><circle cx=\"{x}\" cy=\"{y}\" r=\"6.500\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>\
             <circle cx=\"{x}\" cy=\"{y}\" r=\"1.800\" fill=\"{colour}\"/></g>"
        );
    }

    /// A line of an axis that is seen from its side, with an arrow at its end.
    pub(crate) fn arrow(&mut self, from: [f64; 2], to: [f64; 2], colour: &str) {
        let [x0, y0] = [self.across.at(from[0]), self.up.at(from[1])];
        let [x1, y1] = [self.across.at(to[0]), self.up.at(to[1])];
        let length = (x1 - x0).hypot(y1 - y0).max(1e-9);
        let [dx, dy] = [(x1 - x0) / length * 8.0, (y1 - y0) / length * 8.0];
        let _ = write!(
            self.marks,
            "<path class=\"axis\" d=\"M{} {}L{} {}M{} {}L{} {}L{} {}\" stroke=\"{colour}\" stroke-width=\"2\" fill=\"none\" \
             stroke-linecap=\"round\" stroke-linejoin=\"round\"/>",
            pixel(x0),
            pixel(y0),
            pixel(x1),
            pixel(y1),
            pixel(x1 - dx - dy / 2.0),
            pixel(y1 - dy + dx / 2.0),
            pixel(x1),
            pixel(y1),
            pixel(x1 - dx + dy / 2.0),
            pixel(y1 - dy - dx / 2.0)
        );
    }

    /// The chart, `WIDTH` by `HEIGHT` pixels with its corner at the origin.
    pub(crate) fn draw(self) -> String {
        let mut svg = String::new();
        let [left, right, bottom, top] = [LEFT, WIDTH - RIGHT, HEIGHT - BOTTOM, TOP].map(pixel);
        let _ = write!(
            svg,
            "<text class=\"ink\" x=\"{left}\" y=\"20\" font-size=\"13\" font-weight=\"600\" fill=\"{INK}\">{}</text>",
            escaped(&self.title)
        );
        let mut grid = String::new();
        let mut words = String::new();
        for tick in self.across.ticks() {
            let x = pixel(self.across.at(tick));
            let _ = write!(grid, "M{x} {bottom}V{top}");
            let y = pixel(HEIGHT - BOTTOM + 14.0);
            let _ =
                write!(words, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{}</text>", number(tick, &self.across));
        }
        for tick in self.up.ticks() {
            let y = self.up.at(tick);
            let _ = write!(grid, "M{left} {}H{right}", pixel(y));
            let x = pixel(LEFT - 6.0);
            let _ = write!(
                words,
                "<text x=\"{x}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                pixel(y + 3.5),
                number(tick, &self.up)
            );
        }
        let middle = pixel((LEFT + WIDTH - RIGHT) / 2.0);
        let _ = write!(
            svg,
            "<path class=\"rule\" d=\"{grid}\" stroke=\"{RULE}\" fill=\"none\"/>\
             <g class=\"faint\" font-size=\"10.5\" fill=\"{FAINT}\">{words}\
             <text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text x=\"{right}\" y=\"20\" text-anchor=\"end\">{}</text></g>",
            pixel(HEIGHT - 8.0),
            escaped(&self.across.label),
            escaped(&self.up.label)
        );
        let clip = self.marks;
        let _ = write!(
            svg,
            "<svg x=\"{left}\" y=\"{top}\" width=\"{0}\" height=\"{1}\" viewBox=\"{left} {top} {0} {1}\">{clip}</svg>",
            pixel(WIDTH - LEFT - RIGHT),
            pixel(HEIGHT - TOP - BOTTOM)
        );
        if self.timed {
            let [from, to] = self.across.range;
            let _ = write!(
                svg,
                "<path class=\"moment\" data-from=\"{from}\" data-to=\"{to}\" data-left=\"{left}\" data-right=\"{right}\" \
                 d=\"M{left} {top}V{bottom}\" stroke=\"none\" fill=\"none\"/>"
            );
        }
        svg
    }
}

fn number(tick: f64, scale: &Scale) -> String {
    let size = scale.range[1] - scale.range[0];
    let decimals = if size <= 0.0 { 0.0 } else { (1.0 - (size / 2.0).log10()).floor().clamp(0.0, 6.0) };
    let decimals = [0_usize, 1, 2, 3, 4, 5, 6].into_iter().find(|d| *d as f64 >= decimals).unwrap_or(6);
    let text = format!("{tick:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    match text.as_str() {
        "-0" => "0".into(),
        _ => text.replace('-', "−"),
    }
}

/// A drawing as a file of its own, on white.
pub(crate) fn document([width, height]: [f64; 2], content: &str) -> String {
    let [width, height] = [width, height].map(pixel);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"{FONT}\">\n<rect class=\"paper\" width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{content}\n</svg>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_within_the_range() {
        let scale = |range| Scale { range, label: String::new(), pixels: [0.0, 260.0] };
        let of = |least, most| {
            let scale = scale([least, most]);
            scale.ticks().into_iter().map(|tick| number(tick, &scale)).collect::<Vec<_>>()
        };
        assert_eq!(of(-0.02, 0.13), ["0", "0.05", "0.1"]);
        assert_eq!(of(-95.0, 10.0), ["−50", "0"]);
        assert_eq!(range([f64::NAN].into_iter(), 0.1), [0.0, 1.0]);
        let flat = range([3.0, 3.0].into_iter(), 0.1);
        assert!(flat[0] < 3.0 && flat[1] > 3.0);
    }
}
