//! Where the search for the scale of a pair begins: closed forms that joints with a common point, none or a common line
//! leave of it.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x6, Translation3, Vector3};

use crate::{BodyMotion, Pose};

/// Singular values, as a share of the largest, below which unknowns count as not seen.
const UNSEEN: f64 = 1e-3;
/// Scales between which a slide is sought, and their number.
const SLIDES: std::ops::RangeInclusive<f64> = 0.4..=2.2;
const TRIED: u32 = 60;

/// Factors by which the positions of `moving` may have to be multiplied about the origin of the recording for a joint
/// with `reference` to appear: of a rigid pair, of one with a common point (a hinge, a ball), and of a slide. Those of
/// which the motion shows nothing are left out, and so is what is no positive number.
///
/// *Definition.* With centroids `x` and rotations `R` per frame, `κ x_B - x_A = R_A c` for a rigid pair and
/// `κ x_B + R_B b = x_A + R_A a` for a common point are linear in `κ` and the joint's unknowns, which are eliminated; for
/// a slide, `R_Aᵀ (κ x_B - x_A)` lies on a line: the two smaller eigenvalues of its scatter, over `1 + κ²`, are least.
///
/// Errors in `x_B` draw the linear estimates towards 0; they are starts, no results.
///
/// # References
/// Thesis section 5.5, equations (52), (53); docs/method.md, "One camera".
pub fn linear_scales(reference: &BodyMotion<'_>, moving: &BodyMotion<'_>) -> Vec<f64> {
    let (centre_a, centre_b) = (reference.centre(), moving.centre());
    let both = reference.likely_poses().iter().zip(moving.likely_poses());
    let frames: Vec<Frame> = both
        .filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)))
        .map(|(a, b)| Frame {
            turn_a: *a.rotation.to_rotation_matrix().matrix(),
            turn_b: *b.rotation.to_rotation_matrix().matrix(),
            place_a: (a * centre_a).coords,
            place_b: (b * centre_b).coords,
        })
        .collect();
    if frames.len() < 3 {
        return Vec::new();
    }
    let rigid = eliminated(&frames, |frame| {
        let mut row = Matrix3x6::zeros();
        row.fixed_view_mut::<3, 3>(0, 0).copy_from(&frame.turn_a);
        row
    });
    let point = eliminated(&frames, |frame| {
        let mut row = Matrix3x6::zeros();
        row.fixed_view_mut::<3, 3>(0, 0).copy_from(&frame.turn_a);
        row.fixed_view_mut::<3, 3>(0, 3).copy_from(&frame.turn_b);
        row
    });
    let found = [rigid, point, along_a_line(&frames)].into_iter().flatten();
    found.filter(|scale| scale.is_finite() && *scale > 0.0).collect()
}

/// The pose of a body that is `factor` times as large, and as far away.
pub fn scaled_pose(pose: &Pose, factor: f64) -> Pose {
    Pose::from_parts(Translation3::from(pose.translation.vector * factor), pose.rotation)
}

/// What a frame shows of the two bodies, in the recording's coordinates.
struct Frame {
    turn_a: Matrix3<f64>,
    turn_b: Matrix3<f64>,
    place_a: Vector3<f64>,
    place_b: Vector3<f64>,
}

/// `κ` of `κ x_B - x_A = M y`, with `y` eliminated.
fn eliminated(frames: &[Frame], rows: impl Fn(&Frame) -> Matrix3x6<f64>) -> Option<f64> {
    let (mut normal, mut of_a, mut of_b) = (DMatrix::zeros(6, 6), DVector::zeros(6), DVector::zeros(6));
    for frame in frames {
        let row = rows(frame);
        normal += row.tr_mul(&row);
        of_a += row.tr_mul(&frame.place_a);
        of_b += row.tr_mul(&frame.place_b);
    }
    let limit = UNSEEN * UNSEEN * normal.symmetric_eigenvalues().max();
    let inverse = normal.pseudo_inverse(limit).ok()?;
    let (of_a, of_b) = (&inverse * of_a, &inverse * of_b);
    let (mut product, mut square, mut whole) = (0.0, 0.0, 0.0);
    for frame in frames {
        let row = rows(frame);
        let (left_a, left_b) = (frame.place_a - row * &of_a, frame.place_b - row * &of_b);
        product += left_a.dot(&left_b);
        square += left_b.norm_squared();
        whole += frame.place_b.norm_squared();
    }
    (square > 1e-12 * whole).then(|| product / square)
}

/// `κ` at which the way of B's centroid as seen from A is most like a line.
fn along_a_line(frames: &[Frame]) -> Option<f64> {
    let seen = |place: fn(&Frame) -> Vector3<f64>| {
        let places: Vec<Vector3<f64>> = frames.iter().map(|frame| frame.turn_a.tr_mul(&place(frame))).collect();
        let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
        places.into_iter().map(move |place| place - mean).collect::<Vec<_>>()
    };
    let (of_a, of_b) = (seen(|frame| frame.place_a), seen(|frame| frame.place_b));
    let sum = |left: &[Vector3<f64>], right: &[Vector3<f64>]| -> Matrix3<f64> {
        left.iter().zip(right).map(|(left, right)| left * right.transpose()).sum()
    };
    let (square_a, mixed, square_b) = (sum(&of_a, &of_a), sum(&of_b, &of_a), sum(&of_b, &of_b));
    let width = |scale: f64| {
        let scatter = square_b * (scale * scale) - (mixed + mixed.transpose()) * scale + square_a;
        let mut values = scatter.symmetric_eigenvalues();
        values.as_mut_slice().sort_by(f64::total_cmp);
        (values[0] + values[1]) / (1.0 + scale * scale)
    };
    let step = (SLIDES.end() / SLIDES.start()).powf(1.0 / f64::from(TRIED));
    let tried = (0..=TRIED).map(|k| SLIDES.start() * step.powf(f64::from(k)));
    tried.map(|scale| (width(scale), scale)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, scale)| scale)
}
