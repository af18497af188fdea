//! S7: a long recording.

use jointscope_scenes::workloads::hinge;

use crate::alternation::{Contestant, FEW_ROUNDS, Spread, alternate};
use crate::document::Document;
use crate::row::{Row, Wanted};
use crate::thesis::{detect, detector_of, numbers, thesis, threads};

/// The most memory that this process had since [`forget_peak`], and what it has now, bytes; only Linux tells.
fn memory(field: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(field))?;
    Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

fn forget_peak() -> Option<()> {
    std::fs::write("/proc/self/clear_refs", "5").ok()
}

/// W5: 100 000 frames; as many features as one body may have samples for.
pub(crate) fn measure(document: &mut Document) {
    let recording = hinge(100_000, 100, 1005).expect("a workload").recording;
    let (detector, pool) = (detector_of(&thesis(true)), threads(1));
    let peak = forget_peak().and_then(|()| {
        let before = memory("VmRSS:")?;
        drop(detect(&detector, &pool, &recording));
        Some(memory("VmHWM:")? - before)
    });
    let floor = numbers(&recording);
    let contestants = vec![Contestant::going_on("ours", &pool, 1, || drop(detect(&detector, &pool, &recording)))];
    let times = alternate(document, "W5", FEW_ROUNDS, &floor, contestants);
    let mut row = |what: &str, most, unit, measured, bound| {
        let (what, wanted) = (what.into(), Wanted::AtMost(most));
        document.row(Row { goal: "S7", what, wanted, unit, measured, fault: None, bound });
    };
    if let Some(measured) = times.ratio("ours", "floor") {
        row(
            "W5: thesis's scores of 100 000 frames of 100 features, by reading them once",
            3.0,
            "×",
            measured,
            "trajectories that nobody keeps are placed anew for every look at all of them, three times; registration visits both bodies",
        );
    }
    match peak {
        Some(bytes) => {
            let megabytes = bytes / 1e6;
            let measured = Spread { median: megabytes, low: megabytes, high: megabytes };
            row(
                "W5: memory above the recording",
                64.0,
                "MB",
                measured,
                "poses of both bodies, the rows of some frames at a time, and what may be the ends of trajectories",
            );
        }
        None => document.absent("the peak of memory (only Linux tells it)".into()),
    }
}
