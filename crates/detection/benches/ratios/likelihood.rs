//! S8 and S9: detection by likelihood, of one pair and of all pairs.

use std::borrow::Cow;

use jointscope_motion::{BodyMotion, MotionSettings};
use jointscope_scenes::{SceneOptions, simulate, workloads::kitchen};

use crate::alternation::{Contestant, FEW_ROUNDS, ROUNDS, alternate};
use crate::document::Document;
use crate::floor::beyond_caches;
use crate::row::{Row, Wanted};
use crate::thesis::{detect, detector_of, numbers, threads};

/// Pairs of W3, neighbours by name, that are judged with one thread and with two to compare what they find.
const PAIRS: usize = 49;

pub(crate) fn measure(document: &mut Document) {
    one_pair(document);
    all_pairs(document);
}

fn one_pair(document: &mut Document) {
    let (detector, pool, settings) = (detector_of(""), threads(1), MotionSettings::default());
    let scenes = ["rigid", "revolute", "planar", "disconnected"].map(|joint| {
        let options = SceneOptions { seed: 1008, ..SceneOptions::default() };
        (joint, simulate(joint, &options).expect("a scene").recording)
    });
    let floor = beyond_caches();
    let mut contestants = Vec::new();
    for (joint, recording) in &scenes {
        let (detector, pool) = (&detector, &pool);
        let all = format!("{joint} pair");
        contestants.push(Contestant::going_on(all, pool, 3, move || drop(detect(detector, pool, recording))));
    }
    let registrations = || scenes[1].1.bodies().iter().map(|body| BodyMotion::of(body, &settings));
    contestants.push(Contestant::repeated("both registrations alone", 5, move || {
        std::hint::black_box(registrations().map(|motion| motion.pose_covariances().len()).sum::<usize>());
    }));
    let names: Vec<String> = scenes.iter().map(|(joint, _)| format!("{joint} pair")).collect();
    let times = alternate(document, "likelihood, one pair", ROUNDS, &floor, contestants);
    for (name, (joint, recording)) in names.iter().zip(&scenes) {
        let Some(measured) = times.seconds(name) else { continue };
        let found = detect(&detector, &pool, recording).pairs.remove(0).verdict.joint;
        document.row(Row {
            goal: "S8",
            what: format!("by likelihood, all models with both registrations, 50 frames of 20 features: a {name}"),
            wanted: Wanted::AtMost(2.0),
            unit: "ms",
            measured: measured.times(1e3),
            fault: (found != *joint).then(|| format!("the verdict is {found}")),
            bound: "the number of iterations: every model fits from several starts, robustly, with and without play",
        });
    }
    if let Some(measured) = times.seconds("both registrations alone") {
        document.row(Row {
            goal: "S8",
            what: "both registrations alone".into(),
            wanted: Wanted::Nothing,
            unit: "ms",
            measured: measured.times(1e3),
            fault: None,
            bound: "",
        });
    }
}

fn all_pairs(document: &mut Document) {
    let recording = kitchen(50, 1000, 40, 1003).expect("a workload").recording;
    let detector = detector_of("");
    let names: Vec<&str> = recording.bodies().iter().map(jointscope_motion::Body::name).collect();
    let pairs: Vec<[String; 2]> =
        names.windows(2).take(PAIRS).map(|pair| [pair[0].to_owned(), pair[1].to_owned()]).collect();
    let all = names.len() * (names.len() - 1) / 2;
    let floor = numbers(&recording);
    let judge = |threads: &rayon::ThreadPool, pairs: Option<&[[String; 2]]>| {
        let watched = || detector.detect_watched(Cow::Borrowed(&recording), pairs, &|_, _| ());
        threads.install(watched).expect("known bodies")
    };
    let [one, two] = [1, 2].map(threads);
    let differs = judge(&one, Some(&pairs)) != judge(&two, Some(&pairs));
    let contestants = vec![Contestant::awaited("all pairs", || drop(judge(&two, None)))];
    let times = alternate(document, "likelihood, W3", FEW_ROUNDS, &floor, contestants);
    if let Some(measured) = times.seconds("all pairs") {
        document.row(Row {
            goal: "S9",
            what: format!("W3 by likelihood, 2 threads: all {all} pairs"),
            wanted: Wanted::AtMost(10.0),
            unit: "s",
            measured,
            fault: differs.then(|| "two threads find something else than one".to_owned()),
            bound: "the number of iterations, and registrations that look for wild samples",
        });
    }
}
