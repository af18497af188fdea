//! What twice as many frames, features and pairs cost.

use jointscope_detection::Detector;
use jointscope_motion::Recording;
use jointscope_scenes::workloads::{hinge, kitchen};

use crate::alternation::{Contestant, alternate};
use crate::document::{Document, Doubling};
use crate::floor::beyond_caches;
use crate::thesis::{detect, detector_of, thesis, threads};

/// Bodies that make twice as many pairs each time, nearly: 10, 21, 45.
const BODIES: [usize; 3] = [5, 7, 10];

/// Rounds, of which each does everything at all sizes.
const ROUNDS_OF_SIZES: usize = 5;

pub(crate) fn measure(document: &mut Document) {
    let thesis = detector_of(&thesis(false));
    let likelihood = detector_of("");
    for (name, detector, times) in [("thesis", &thesis, 20), ("likelihood", &likelihood, 2)] {
        let of_one = |frames, features| hinge(frames, features, 1002).expect("a workload").recording;
        let frames = [250, 500, 1000, 2000].map(|frames| (format!("{frames} frames"), of_one(frames, 20)));
        series(document, &format!("frames of 20 features, {name}"), (detector, times), &frames);
        let features = [10, 20, 40, 80].map(|features| (format!("{features} features"), of_one(500, features)));
        series(document, &format!("features of 500 frames, {name}"), (detector, times), &features);
        let of_all = |bodies| kitchen(bodies, 250, 20, 1003).expect("a workload").recording;
        let pairs = BODIES.map(|bodies| (format!("{} pairs", bodies * (bodies - 1) / 2), of_all(bodies)));
        series(document, &format!("pairs of 250 frames of 20 features, {name}"), (detector, times), &pairs);
    }
}

fn series(document: &mut Document, what: &str, (detector, times): (&Detector, usize), sizes: &[(String, Recording)]) {
    let pool = threads(1);
    let contestant = |(size, recording): &'_ (String, Recording)| {
        let (detector, in_pool, recording) = (detector, &pool, recording.clone());
        Contestant::going_on(size, &pool, times, move || drop(detect(detector, in_pool, &recording)))
    };
    let contestants = sizes.iter().map(contestant).collect();
    let times = alternate(document, what, ROUNDS_OF_SIZES, &beyond_caches(), contestants);
    for pair in sizes.windows(2) {
        let (from, to) = (&pair[0].0, &pair[1].0);
        if let Some((factor, time)) = times.ratio(to, from).zip(times.seconds(from)) {
            let time = time.median;
            document.doubling(Doubling { what: what.into(), from: from.clone(), to: to.clone(), time, factor });
        }
    }
}
