//! S4 and S5: detection by the thesis's scores, of one pair and of all pairs.

use jointscope_detection::{Configuration, Detection, Detector, PairDetection};
use jointscope_models::Catalog;
use jointscope_motion::{Body, Observation, Recording};
use jointscope_scenes::workloads::{hinge, kitchen};
use rayon::ThreadPool;

use crate::alternation::{Contestant, FEW_ROUNDS, ROUNDS, alternate};
use crate::document::Document;
use crate::floor::beyond_caches;
use crate::peer::{Peer, write_numbers};
use crate::row::{Row, Wanted};

const THESIS: &str = include_str!("../../../../configs/thesis.toml");
/// By how much scores may differ.
const SAME: f64 = 1e-9;
/// Pairs that numpy judges in a round of W3.
const PAIRS_OF_NUMPY: usize = 4;

/// The configuration of the thesis, as it is printed or with every frame registered to the first.
pub(crate) fn thesis(registered_to_first: bool) -> String {
    let printed = r#"registration = "chained""#;
    let text =
        if registered_to_first { THESIS.replace(printed, r#"registration = "first""#) } else { THESIS.to_owned() };
    assert_eq!(registered_to_first, !text.contains(printed), "configs/thesis.toml names its registration");
    text
}

/// A detector by a configuration.
pub(crate) fn detector_of(text: &str) -> Detector {
    let catalog = Catalog::linked().expect("unique names");
    Detector::new(Configuration::parse(text, &catalog).expect("valid"))
}

pub(crate) fn threads(count: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads")
}

pub(crate) fn detect(detector: &Detector, pool: &ThreadPool, recording: &Recording) -> Detection {
    let watched = || detector.detect_watched(std::borrow::Cow::Borrowed(recording), None, &|_, _| ());
    pool.install(watched).expect("bodies that can be told apart")
}

/// All coordinates, body by body.
pub(crate) fn numbers(recording: &Recording) -> Vec<f64> {
    let of_body = |body: &Body| match body.observation() {
        Observation::Points { tracks, .. } => (0..tracks.frames())
            .flat_map(|frame| tracks.frame(frame))
            .flat_map(|point| [point.x, point.y, point.z])
            .collect(),
        _ => Vec::new(),
    };
    recording.bodies().iter().flat_map(of_body).collect()
}

fn confidences(pair: &PairDetection) -> Vec<f64> {
    let of = |name| pair.models.get(name).and_then(|found| found.as_ref().ok()).map(|fit| fit.confidence.value());
    ["rigid", "prismatic", "revolute"].map(|name| of(name).unwrap_or(f64::NAN)).into()
}

/// numpy on a recording whose bodies have as many features each, and why its scores differ from ours if so.
fn numpy(recording: &Recording, pairs: usize, ours: &[f64]) -> Result<(Peer, Option<String>), String> {
    let folder = tempfile::tempdir().expect("a folder of temporary files");
    write_numbers(&folder.path().join("bodies.f64"), &numbers(recording));
    let features = match recording.bodies()[0].observation() {
        Observation::Points { tracks, .. } => tracks.features(),
        _ => 0,
    };
    let sizes = [recording.bodies().len(), recording.frames(), features].map(|size| size as f64);
    write_numbers(&folder.path().join("shape.f64"), &sizes);
    let mut peer = Peer::python("thesis.py", folder.path())?;
    let theirs = peer.run(&pairs.to_string()).map(|(_, scores)| scores).unwrap_or_default();
    let same = theirs.len() == ours.len() && theirs.iter().zip(ours).all(|(a, b)| (a - b).abs() < SAME);
    Ok((peer, (!same).then(|| format!("numpy finds {theirs:?}, ours is {ours:?}"))))
}

pub(crate) fn measure(document: &mut Document) {
    one_pair(document);
    all_pairs(document);
}

fn one_pair(document: &mut Document) {
    let recording = hinge(437, 40, 1002).expect("a workload").recording;
    let (detector, printed, pool) = (detector_of(&thesis(true)), detector_of(&thesis(false)), threads(1));
    let floor = beyond_caches();
    let ours = confidences(&detect(&detector, &pool, &recording).pairs[0]);
    let mut contestants = vec![
        // As the peer, which goes through its script once before it is timed.
        Contestant::going_on("ours", &pool, 5, || drop(detect(&detector, &pool, &recording))),
        Contestant::going_on("ours, chained", &pool, 5, || drop(detect(&printed, &pool, &recording))),
    ];
    let mut fault = None;
    match numpy(&recording, 1, &ours) {
        Ok((mut peer, differs)) => {
            fault = differs;
            let run = move || peer.run("1 1").map_or(f64::NAN, |(seconds, _)| seconds);
            contestants.push(Contestant::new("numpy", run));
        }
        Err(reason) => document.absent(reason),
    }
    let times = alternate(document, "W2", ROUNDS, &floor, contestants);
    let mut row = |what: &str, wanted, unit, measured, bound| {
        document.row(Row { goal: "S4", what: what.into(), wanted, unit, measured, fault: fault.clone(), bound });
    };
    if let Some(measured) = times.ratio("numpy", "ours") {
        row(
            "W2: detection by vectorised numpy, by ours; equal scores",
            Wanted::AtLeast(60.0),
            "×",
            measured,
            "registrations tell the noise besides, which numpy does not; roots, quotients and angles of every position",
        );
    }
    for name in ["ours", "ours, chained"] {
        if let Some(measured) = times.seconds(name) {
            row(&format!("W2: {name}"), Wanted::Nothing, "ms", measured.times(1e3), "");
        }
    }
}

fn all_pairs(document: &mut Document) {
    let recording = kitchen(50, 1000, 40, 1003).expect("a workload").recording;
    let detector = detector_of(&thesis(true));
    let [one, two] = [1, 2].map(threads);
    let pairs = recording.bodies().len() * (recording.bodies().len() - 1) / 2;
    let floor = numbers(&recording);
    let found = detect(&detector, &one, &recording);
    let differs = found != detect(&detector, &two, &recording);
    let mut fault = differs.then(|| "two threads find something else than one".to_owned());
    let last = [PAIRS_OF_NUMPY - 1, PAIRS_OF_NUMPY].map(|body| recording.bodies()[body].name());
    let last = found.pairs.iter().find(|pair| [pair.reference.as_str(), pair.moving.as_str()] == last);
    let ours = last.map(confidences).unwrap_or_default();
    let mut contestants = vec![
        Contestant::going_on("one thread", &one, 1, || drop(detect(&detector, &one, &recording))),
        Contestant::awaited("one thread, awaited", || drop(detect(&detector, &one, &recording))),
        Contestant::awaited("two threads", || drop(detect(&detector, &two, &recording))),
    ];
    match numpy(&recording, PAIRS_OF_NUMPY, &ours) {
        Ok((mut peer, differs)) => {
            fault = fault.or(differs);
            let run = move || peer.run(&PAIRS_OF_NUMPY.to_string()).map_or(f64::NAN, |(seconds, _)| seconds);
            contestants.push(Contestant::new("numpy", all_of(run, pairs)));
        }
        Err(reason) => document.absent(reason),
    }
    let times = alternate(document, "W3", FEW_ROUNDS, &floor, contestants);
    let mut row = |what: &str, wanted, unit, measured, bound| {
        document.row(Row { goal: "S5", what: what.into(), wanted, unit, measured, fault: fault.clone(), bound });
    };
    if let Some(measured) = times.ratio("numpy", "one thread") {
        let what = format!("W3: all pairs by numpy, measured on {PAIRS_OF_NUMPY}, by ours on 1 thread; equal scores");
        row(
            &what,
            Wanted::AtLeast(150.0),
            "×",
            measured,
            "trajectories larger than caches, over which each model goes on its own; exact extents; angles of every position",
        );
    }
    if let Some(measured) = times.ratio("one thread, awaited", "two threads") {
        row("W3: 1 thread by 2", Wanted::AtLeast(1.8), "×", measured, "others use the second core");
    }
    for name in ["one thread", "two threads"] {
        if let Some(measured) = times.seconds(name) {
            row(&format!("W3: {name}"), Wanted::Nothing, "s", measured, "");
        }
    }
}

/// What all pairs take, by the time of one.
fn all_of(mut one: impl FnMut() -> f64, pairs: usize) -> impl FnMut() -> f64 {
    move || one() * pairs as f64
}
