//! S6: the search for a scale, beside one detection.

use jointscope_detection::Detection;
use jointscope_motion::Recording;
use jointscope_scenes::workloads::hinge;

use crate::alternation::{Contestant, FEW_ROUNDS, alternate};
use crate::document::Document;
use crate::floor::beyond_caches;
use crate::row::{Row, Wanted};
use crate::thesis::{detect, detector_of, thesis, threads};

/// What a single camera makes of the second body, and by how much the factor found may be off: of the closed form, and
/// of the thesis's scores, which are level over some steps of the grid.
const SEEN: f64 = 1.0 / 0.94;
const EXACTLY: f64 = 1e-3;
const BY_THE_GRID: f64 = 0.1;

/// W4: W2, its second body seen at another scale.
fn recording() -> Recording {
    let seen = hinge(437, 40, 1002).expect("a workload").recording;
    let bodies = seen.bodies().iter().zip([1.0, SEEN]).map(|(body, factor)| body.scaled(factor)).collect();
    Recording::new(seen.frame_numbers().to_vec(), None, bodies).expect("the same bodies")
}

fn fault(found: &Detection, tolerance: f64) -> Option<String> {
    let factor = found.pairs[0].scale.as_ref().and_then(|scale| scale.factor);
    let off = factor.map_or(f64::INFINITY, |factor| (factor * SEEN - 1.0).abs());
    (off > tolerance).then(|| format!("the scale found is {factor:?}"))
}

pub(crate) fn measure(document: &mut Document) {
    let (recording, pool, floor) = (recording(), threads(1), beyond_caches());
    let thesis = thesis(true);
    let with = |text: &str, search: &str| detector_of(&format!("{text}\n[scale]\nsearch = \"{search}\"\n"));
    let compared: [(&str, &str, f64, f64, &str); 3] = [
        (
            &thesis,
            "grid",
            60.0,
            BY_THE_GRID,
            "every scale has its own trajectories, on which the models look several times",
        ),
        (
            &thesis,
            "moments",
            10.0,
            BY_THE_GRID,
            "whether the scale shows at all is told by fits of likelihood beside it, which take much of it",
        ),
        (
            "",
            "closed-form",
            10.0,
            EXACTLY,
            "every model is fitted at some fifteen scales, and a spherical one of a hinge slowly",
        ),
    ];
    for (text, search, most, tolerance, bound) in compared {
        let (once, searching) = (with(text, "none"), with(text, search));
        let fault = fault(&detect(&searching, &pool, &recording), tolerance);
        let contestants = vec![
            Contestant::going_on("once", &pool, 5, || drop(detect(&once, &pool, &recording))),
            Contestant::going_on("searching", &pool, 1, || drop(detect(&searching, &pool, &recording))),
        ];
        let times = alternate(document, &format!("W4, {search}"), FEW_ROUNDS, &floor, contestants);
        let what = match search {
            "grid" => "W4: thesis's scores at all 101 scales of the grid, by one detection",
            "moments" => "W4: best scale by moments, thesis's scores there, by one detection",
            _ => "W4: scale in closed form by likelihood, by one detection by likelihood",
        };
        if let Some(measured) = times.ratio("searching", "once") {
            document.row(Row {
                goal: "S6",
                what: what.into(),
                wanted: Wanted::AtMost(most),
                unit: "×",
                measured,
                fault,
                bound,
            });
        }
    }
}
