//! The joints compared, in a picture.

use std::fmt::Write;

use jointscope_detection::{ModelFinding, PairDetection};

use super::{
    chart::{HEIGHT, WIDTH},
    lettering::Lettering,
    style::{AXIS, FAINT, INK, RULE, escaped, pixel},
};

/// Where the columns of numbers end; their headings need this much between them.
const EVIDENCE: f64 = RESIDUAL - 66.0;
const RESIDUAL: f64 = WIDTH - 6.0;
/// Where bars begin.
const BAR: f64 = 104.0;

/// Every joint with its confidence, and what its model found.
pub(super) fn models(pair: &PairDetection) -> String {
    let rows = &pair.verdict.confidences;
    let mut svg = format!(
        "<text class=\"ink\" x=\"14\" y=\"20\" font-size=\"13\" font-weight=\"600\" fill=\"{INK}\">Joints compared</text>\
         <g class=\"faint\" font-size=\"10.500\" fill=\"{FAINT}\" text-anchor=\"end\">\
         <text x=\"{0}\" y=\"20\">rms [mm]</text><text x=\"{1}\" y=\"20\">log evidence</text></g>",
        pixel(RESIDUAL),
        pixel(EVIDENCE)
    );
    let step = ((HEIGHT - 44.0) / rows.len().max(1) as f64).min(26.0);
    let found = |name: &str| pair.models.get(name).and_then(|finding: &ModelFinding| finding.as_ref().ok());
    let evidence = |name: &str| found(name)?.evidence.map(|evidence| -0.5 * evidence.noise_cost());
    let best = rows.iter().filter_map(|(name, _)| evidence(name)).fold(f64::NEG_INFINITY, f64::max);
    for (number, (name, confidence)) in rows.iter().enumerate() {
        let y = 40.0 + step * number as f64;
        let chosen = *name == pair.verdict.joint;
        let (bar, weight) = if chosen { (AXIS, "600") } else { (FAINT, "400") };
        let class = if chosen { "bar chosen" } else { "bar" };
        let evidence = evidence(name).map_or(String::new(), |evidence| {
            let behind = best - evidence;
            if behind < 0.05 { "best".into() } else { format!("−{}", compact(behind)) }
        });
        let residual = found(name).and_then(|fit| fit.residual_rms).map_or(String::new(), |rms| compact(1e3 * rms));
        let _ = write!(
            svg,
            "<text class=\"ink\" x=\"14\" y=\"{0}\" font-size=\"11.500\" font-weight=\"{weight}\" fill=\"{INK}\">{1}</text>\
             <rect class=\"rule-fill\" x=\"{BAR}\" y=\"{2}\" width=\"70\" height=\"9\" rx=\"4.500\" fill=\"{RULE}\"/>\
             <rect class=\"{class}\" x=\"{BAR}\" y=\"{2}\" width=\"{3}\" height=\"9\" rx=\"4.500\" fill=\"{bar}\"/>\
             <g class=\"faint\" font-size=\"10.500\" fill=\"{FAINT}\" text-anchor=\"end\"><text x=\"210\" y=\"{0}\">{4:.3}</text>\
             <text x=\"{5}\" y=\"{0}\">{evidence}</text><text x=\"{6}\" y=\"{0}\">{residual}</text></g>",
            pixel(y + 4.0),
            escaped(&Lettering { size: 11.5, bold: chosen }.fitted(name, BAR - 18.0)),
            pixel(y - 4.5),
            pixel((70.0 * confidence).max(0.0)),
            confidence,
            pixel(EVIDENCE),
            pixel(RESIDUAL)
        );
    }
    svg
}

/// Three digits, or fewer.
fn compact(x: f64) -> String {
    match x {
        x if x >= 1e5 => format!("{x:.0e}"),
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}
