//! How well each pose of a body is known.

use nalgebra::{Matrix3, Matrix6, Point3, Vector3};

use crate::noise::Spread;
use crate::poses::Shape;
use crate::{Pose, Tracks};

/// Standard deviation of a turn of which nothing is known, radians.
const UNKNOWN_TURN: f64 = 3.0;

/// Covariance of every pose of a registered body, as a twist `[ω; v]` about its centre, in axes of the recording.
///
/// *Definition.* The inverse of `Σ Jᵀ Λ J` over the samples that take part, `J = [-[x - c]×, I]`, `Λ` the information of
/// a point. A point's place in the shape is the mean of its `n` samples and has `1 + 2/m` of their variance, of `m`
/// features in a usual frame, divided by `n`; of that the share of frames that do not show it counts, since what all
/// frames share moves no pose. A turn that no sample tells is uncertain by 3 rad. Zero where there is no pose.
pub(crate) fn of_registered(
    tracks: &Tracks,
    poses: &[Option<Pose>],
    shape: &Shape,
    used: impl Fn(usize, usize) -> bool,
    spread: Spread,
    centre: &Point3<f64>,
) -> Vec<Matrix6<f64>> {
    let equal = spread.along == spread.across;
    let mut shown = vec![0.0; shape.len()];
    let mut posed = 0.0;
    for (frame, _) in poses.iter().enumerate().filter(|(_, pose)| pose.is_some()) {
        posed += 1.0;
        tracks.seen(frame).filter(|&(feature, _)| used(frame, feature)).for_each(|(feature, _)| shown[feature] += 1.0);
    }
    let usual = shown.iter().sum::<f64>() / f64::max(posed, 1.0);
    let of_shape = |feature: usize| {
        let hidden = 1.0 - shown[feature] / f64::max(posed, 1.0);
        hidden * (1.0 + 2.0 / f64::max(usual, 1.0)) / f64::max(shown[feature], 1.0)
    };
    let prior = Matrix6::from_diagonal(&nalgebra::Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)) / UNKNOWN_TURN.powi(2);
    let of_pose = |(frame, pose): (usize, &Option<Pose>)| -> Option<Matrix6<f64>> {
        let pose = pose.as_ref()?;
        let turn = pose.rotation.to_rotation_matrix();
        let seen = tracks.seen(frame).filter(|&(feature, _)| used(frame, feature));
        let placed = seen.filter_map(|(feature, position)| Some((feature, position, shape[feature]? - centre)));
        let (turning, mixed, moving) = if equal {
            // Moments in the body's coordinates tell the sums: [x]×ᵀ [x]× = |x|² - x xᵀ.
            let (mut count, mut sum, mut squares) = (0.0, Vector3::zeros(), Matrix3::zeros());
            for (feature, _, place) in placed {
                let weight = spread.across.powi(-2) / (1.0 + of_shape(feature));
                count += weight;
                sum += place * weight;
                squares += place * (place * weight).transpose();
            }
            let squares = turn * squares * turn.transpose();
            let turning = Matrix3::from_diagonal_element(squares.trace()) - squares;
            (turning, (turn * sum).cross_matrix(), Matrix3::from_diagonal_element(count))
        } else {
            let (mut turning, mut mixed, mut moving) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
            for (feature, position, place) in placed {
                let lever = (turn * place).cross_matrix();
                let information = spread.information(&position.coords.normalize()) / (1.0 + of_shape(feature));
                turning -= lever * information * lever;
                mixed += lever * information;
                moving += information;
            }
            (turning, mixed, moving)
        };
        let mut information = prior;
        let mut add = |row, column, block: &Matrix3<f64>| {
            let mut view = information.fixed_view_mut::<3, 3>(row, column);
            view += block;
        };
        add(0, 0, &turning);
        add(0, 3, &mixed);
        add(3, 0, &mixed.transpose());
        add(3, 3, &moving);
        Some(information.cholesky()?.inverse())
    };
    poses.iter().enumerate().map(|frame| of_pose(frame).unwrap_or_else(Matrix6::zeros)).collect()
}

/// Covariance of every pose given by a tracker, likewise; rotations that were replaced are uncertain by `replaced`
/// radians more.
pub(crate) fn of_tracked(position: f64, rotation: f64, replaced: &[bool], flipped: f64) -> Vec<Matrix6<f64>> {
    let of_pose = |replaced: &bool| {
        let turn = rotation.powi(2) + if *replaced { flipped.powi(2) } else { 0.0 };
        let shift = position.powi(2);
        Matrix6::from_diagonal(&nalgebra::Vector6::new(turn, turn, turn, shift, shift, shift))
    };
    replaced.iter().map(of_pose).collect()
}
