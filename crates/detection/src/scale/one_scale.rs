//! A detection in the scale of one body.

use crate::PairDetection;

/// Tells a pair's joint in coordinates of the reference and of the moving body that are so many times as large.
pub(crate) fn rescale(pair: &mut PairDetection, [reference, moving]: [f64; 2]) {
    let fits = pair.models.values_mut().filter_map(|finding| finding.as_mut().ok());
    for fit in fits {
        *fit = fit.clone().scaled(reference, moving);
    }
    if let Some(Ok(fit)) = pair.models.get(&pair.verdict.joint) {
        pair.positions.clone_from(&fit.joint.positions);
        pair.axis_uncertainty = fit.axis_uncertainty;
    }
    pair.axis = pair.axis.map(|axis| axis.scaled(reference));
    pair.axis_in_moving = pair.axis_in_moving.map(|axis| axis.scaled(moving));
    pair.noise_reference.position = pair.noise_reference.position.map(|sigma| sigma * reference);
    pair.noise_moving.position = pair.noise_moving.position.map(|sigma| sigma * moving);
}
