use nalgebra::Vector3;
use pulp::Arch;

use super::*;
use crate::instructions::Instructions;

/// Angle within which two solves agree, radians.
const SAME: f64 = 1e-11;

fn turn(seed: usize) -> UnitQuaternion<f64> {
    let wild = |k: usize| ((seed * 3 + k) as f64 * 12.9898).sin() * 3.0;
    UnitQuaternion::from_scaled_axis(Vector3::new(wild(0), wild(1), wild(2)))
}

/// A covariance with such singular values, which `target_from_source` fits best.
fn covariance(seed: usize, values: [f64; 3]) -> (Matrix3<f64>, UnitQuaternion<f64>) {
    let (left, right) = (turn(seed), turn(seed + 1000));
    let [of_left, of_right] = [left, right].map(|turn| *turn.to_rotation_matrix().matrix());
    (of_left * Matrix3::from_diagonal(&Vector3::from(values)) * of_right.transpose(), right * left.inverse())
}

fn fitted(arch: Arch, covariances: &[Matrix3<f64>]) -> Vec<Option<UnitQuaternion<f64>>> {
    let mut rotations = vec![None; covariances.len()];
    arch.dispatch(Covariances { covariances, rotations: &mut rotations });
    rotations
}

#[test]
fn rotations_are_found_whatever_the_cloud_its_units_and_the_instructions() {
    let clouds = [
        [3.0, 2.0, 1.0],
        [1.0, 1.0, 1.0],
        [3.0, 2.0, 0.0],
        // Mirrored: the smallest value is the one that counts against.
        [3.0, 2.0, -0.5],
        [1.0, 1e-3, 1e-4],
        [1.0, 1e-3, 0.0],
    ];
    for cloud in clouds {
        for unit in [1e-90, 1e-12, 1.0, 1e90] {
            // Not a multiple of the lanes.
            let (covariances, truth): (Vec<_>, Vec<_>) =
                (0..43).map(|seed| covariance(seed, cloud.map(|value| value * unit))).unzip();
            for arch in Instructions::here().into_iter().filter_map(Instructions::arch) {
                for (found, truth) in fitted(arch, &covariances).into_iter().zip(&truth) {
                    let off = found.expect("solvable").angle_to(truth);
                    assert!(off < SAME, "{cloud:?} in units of {unit:e}: {off:e} rad off");
                }
            }
        }
    }
}

#[test]
fn half_turns_are_rotations_like_others() {
    let axis = nalgebra::Unit::new_normalize(Vector3::new(0.3, -0.4, 0.8));
    let half = UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI);
    let covariance =
        Matrix3::from_diagonal(&Vector3::new(3.0, 2.0, 1.0)) * half.to_rotation_matrix().matrix().transpose();
    let found = fitted(arch(), &[covariance])[0].expect("solvable");
    assert!(found.angle_to(&half) < SAME);
}

#[test]
fn lines_places_and_what_is_no_number_have_no_rotation() {
    let (line, _) = covariance(3, [2.0, 0.0, 0.0]);
    let (box_shaped, truth) = covariance(5, [3.0, 2.0, 1.0]);
    let nonsense = Matrix3::repeat(f64::NAN);
    for arch in Instructions::here().into_iter().filter_map(Instructions::arch) {
        let found = fitted(arch, &[line, Matrix3::zeros(), box_shaped, nonsense]);
        assert_eq!((found[0], found[1], found[3]), (None, None, None));
        assert!(found[2].expect("solvable").angle_to(&truth) < SAME);
    }
}
