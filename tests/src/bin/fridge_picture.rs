//! Prints `docs/fridge.svg`: the fridge's recording from above, and the hinge that the thesis's method finds.

use std::fmt::Write;

use jointscope_detection::PairDetection;
use jointscope_motion::{Observation, Recording};
use jointscope_recordings::{ReadOptions, read};
use jointscope_tests::{THESIS, detector};
use nalgebra::Point3;

/// Pixels per metre, and the place of the picture's corner: x to the right, z (away from the camera) upwards.
const SCALE: f64 = 400.0;
const LEFT: f64 = -0.75;
const FAR: f64 = 2.26;
const COLOURS: [&str; 3] = ["#9a9a9a", "#c2410c", "#1d4ed8"];

fn main() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/fridge/recording.csv");
    let recording = read(path.as_ref(), &ReadOptions::default()).expect("the fridge's recording");
    let detection = detector(THESIS).detect(recording.clone(), None).expect("three bodies");
    println!("{}", picture(&recording, &detection.pairs));
}

fn at(point: &Point3<f64>) -> (f64, f64) {
    ((point.x - LEFT) * SCALE, (FAR - point.z) * SCALE)
}

fn picture(recording: &Recording, pairs: &[PairDetection]) -> String {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 460\" font-family=\"sans-serif\" font-size=\"15\">\n\
         <rect width=\"640\" height=\"460\" fill=\"white\"/>\n",
    );
    for (body, colour) in recording.bodies().iter().zip(COLOURS) {
        let Observation::Points { tracks, .. } = body.observation() else { continue };
        for feature in 0..tracks.features() {
            let seen: Vec<_> = (0..tracks.frames()).filter_map(|frame| tracks.get(frame, feature).map(at)).collect();
            let line = seen.iter().fold(String::new(), |line, (x, y)| line + &format!("{x:.1},{y:.1} "));
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.55\"/>",
                line.trim_end()
            );
            if let Some((x, y)) = seen.last() {
                let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>");
            }
        }
    }
    for pair in pairs {
        let Some(axis) = pair.axis else { continue };
        let (x, y) = at(&axis.point);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"9\" fill=\"none\" stroke=\"black\" stroke-width=\"2.5\"/>"
        );
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\"/>");
        let lines = [
            format!("{} - {}", pair.reference, pair.moving),
            format!("{}, {:.2}", pair.verdict.joint, pair.verdict.confidence),
        ];
        for (row, line) in lines.iter().enumerate() {
            let (x, y) = (x - 18.0, y - 4.0 + 18.0 * row as f64);
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{line}</text>");
        }
    }
    for (row, (body, colour)) in recording.bodies().iter().zip(COLOURS).enumerate() {
        let y = 26 + 22 * row;
        let _ = writeln!(
            svg,
            "<circle cx=\"18\" cy=\"{}\" r=\"5\" fill=\"{colour}\"/><text x=\"32\" y=\"{y}\">{}</text>",
            y - 5,
            body.name()
        );
    }
    svg + "<text x=\"622\" y=\"442\" text-anchor=\"end\" fill=\"#555\">from above; the camera is below</text>\n</svg>"
}
