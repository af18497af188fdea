//! What a fit takes from noise that drifts.

use jointscope_motion::{PoseSeries, twist};
use nalgebra::{SMatrix, SVector};

use super::engine::{Normal, UNKNOWNS, solve_all};
use super::{Fitted, Mechanism};

type Rows = SMatrix<f64, 6, UNKNOWNS>;

/// What `χ²` of the right mechanism is on average where the errors of a frame are like those of the frame before.
///
/// White noise loses one number to everything that is fitted. Of errors `ρ^|t-s|` times as large as those of another
/// frame, unknowns that act on all frames alike take up many: `tr N⁻¹ M` of them, where `N = Σ Jᵀ J` is the normal
/// matrix and `M = Σ ρ^|t-s| J_tᵀ J_s`. The positions of merged frames take up as much as
/// [their mean](PoseSeries::slowness) has of the errors.
pub(super) fn expected(mechanism: &dyn Mechanism, series: &PoseSeries, fitted: &Fitted) -> f64 {
    let (seen, count) = (series.seen() as f64, series.poses().len() as f64);
    let correlation = (series.correlation_time() - 1.0) / (series.correlation_time() + 1.0);
    let run = seen / count;
    let apart = 1.0 - correlation;
    let of_run = correlation.powf(run);
    let own = series.slowness(run);
    let beside = correlation * (1.0 - of_run).powi(2) / (run * apart * apart * of_run);
    let (mut normal, mut others) = (Normal::zeros(), Normal::zeros());
    let mut before = Rows::zeros();
    for (index, frame) in series.frames().iter().enumerate() {
        if index > 0 {
            let gap = frame - series.frames()[index - 1];
            before *= correlation.powf(gap as f64);
        }
        let rows = left_of_rows(mechanism, series, fitted, index);
        normal += rows.transpose() * rows;
        others += rows.transpose() * before;
        before += rows;
    }
    let alike = normal * own + (others + others.transpose()) * beside;
    let taken = (solve_all(&normal) * alike).trace();
    6.0 * seen - mechanism.freedoms() as f64 * count * own - taken + series.merged_motion()
}

/// How a frame's whitened residual changes with the unknowns, less what its positions make up for.
fn left_of_rows(mechanism: &dyn Mechanism, series: &PoseSeries, fitted: &Fitted, index: usize) -> Rows {
    let (placement, q) = (&fitted.placement, &fitted.positions[index]);
    let white = series.whitening()[index];
    let carried = white * twist::adjoint(&(placement.home.inverse() * placement.joint));
    let along = carried * twist::adjoint(&mechanism.pose(q, &placement.constants).inverse());
    let mut rows = Rows::zeros();
    rows.fixed_view_mut::<6, 6>(0, 0).copy_from(&(along - carried));
    rows.fixed_view_mut::<6, 6>(0, 6).copy_from(&white);
    for (constant, twist) in mechanism.constant_twists(q, &placement.constants).iter().enumerate() {
        rows.set_column(12 + constant, &(along * twist));
    }
    let twists = mechanism.twists(q, &placement.constants);
    let mut basis: Vec<SVector<f64, 6>> = Vec::with_capacity(3);
    for twist in &twists[..mechanism.freedoms()] {
        let moves = along * twist;
        let rest = basis.iter().fold(moves, |rest, b| rest - b * b.dot(&rest));
        basis.extend(rest.try_normalize(1e-9 * moves.norm()));
    }
    for b in &basis {
        rows -= b * (b.transpose() * rows);
    }
    rows
}
