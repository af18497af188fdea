//! Detection while it is being recorded: what a frame costs.

use std::hint::black_box;

use jointscope_detection::{Configuration, LiveDetector};
use jointscope_models::Catalog;
use jointscope_motion::{Body, Observation, nalgebra::Point3};
use jointscope_scenes::workloads::kitchen;

use crate::alternation::{Contestant, ROUNDS, alternate};
use crate::document::Document;
use crate::floor::beyond_caches;
use crate::row::{Row, Wanted};
use crate::thesis::thesis;

const FRAMES: usize = 1000;
/// Milliseconds in which a frame of 10 bodies of 40 features is to be taken.
const MOST: f64 = 0.05;

pub(crate) fn measure(document: &mut Document) {
    let recording = kitchen(10, FRAMES, 40, 1003).expect("a workload").recording;
    let catalog = Catalog::linked().expect("unique names");
    let bodies: Vec<(String, Vec<String>)> =
        recording.bodies().iter().map(|body| (body.name().to_owned(), labels(body))).collect();
    let frames: Vec<Vec<Vec<Point3<f64>>>> =
        (0..FRAMES).map(|frame| recording.bodies().iter().map(|body| seen(body, frame)).collect()).collect();
    let take_all = |text: &str| {
        let configuration = Configuration::parse(text, &catalog).expect("valid");
        let mut live = LiveDetector::new(configuration, bodies.clone()).expect("unique names");
        for (number, frame) in frames.iter().enumerate() {
            live.push(number as f64, frame).expect("frames fit");
        }
        black_box(live.frames());
    };
    let (first, chained) = (thesis(true), thesis(false));
    let compared = [("registered to the first", first.as_str()), ("chained", &chained), ("to the mean shape", "")];
    let contestants = compared.iter().map(|(name, text)| Contestant::repeated(*name, 1, || take_all(text))).collect();
    let times = alternate(document, "live", ROUNDS, &beyond_caches(), contestants);
    for (name, _) in compared {
        if let Some(measured) = times.seconds(name) {
            document.row(Row {
                goal: "P8",
                what: format!("live: taking a frame of 10 bodies of 40 features, {name}"),
                wanted: Wanted::AtMost(MOST),
                unit: "ms",
                measured: measured.times(1e3 / FRAMES as f64),
                fault: None,
                bound: "every frame is registered alone, by the solve for any body",
            });
        }
    }
}

fn labels(body: &Body) -> Vec<String> {
    match body.observation() {
        Observation::Points { labels, .. } => labels.clone(),
        _ => Vec::new(),
    }
}

fn seen(body: &Body, frame: usize) -> Vec<Point3<f64>> {
    match body.observation() {
        Observation::Points { tracks, .. } => tracks.frame(frame).to_vec(),
        _ => Vec::new(),
    }
}
