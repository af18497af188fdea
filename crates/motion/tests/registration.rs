//! Registration of point sets: against random truth, against the singular value decomposition of `faer`, and against
//! the symmetries of the problem.

use std::f64::consts::PI;

use faer::Mat;
use jointscope_motion::{
    Pose, RegistrationError,
    nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3},
    register,
};
use proptest::{prelude::*, test_runner::RngSeed};

/// Rounding of a coordinate, as a share of the largest one: some dozen operations of half an ulp each lie between the
/// true coordinates and the pose.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// The covariance squares the aspect of a cloud, and is taken a second time below an aspect of 1e-2: between, rounding
/// of the length counts up to 100 times as much against the thickness.
const SQUARED_ASPECT: f64 = 100.0;
/// Thickness over length below which nothing is promised; few points of a thin box can lie so by chance.
const THINNEST: f64 = 1e-7;
/// A minimum found twice, in other coordinates or another order, radians and metres on bodies of 1 m: rounding over
/// the smallest aspect of 0.05, squared.
const SAME: f64 = 1e-12;

type Cloud = Vec<Point3<f64>>;

fn config() -> ProptestConfig {
    ProptestConfig { cases: 1000, failure_persistence: None, rng_seed: RngSeed::Fixed(20), ..ProptestConfig::default() }
}

fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-reach..=reach).prop_map(Vector3::from)
}

/// Any rotation, half turns and the identity included.
fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    let angle = prop_oneof![6 => -PI..PI, 2 => Just(PI), 1 => Just(0.0), 1 => -1e-9..1e-9];
    let axis = vector(1.0).prop_filter_map("an axis", |v| Unit::try_new(v, 0.1));
    (axis, angle).prop_map(|(axis, angle)| UnitQuaternion::from_axis_angle(&axis, angle))
}

fn pose(reach: f64) -> impl Strategy<Value = Pose> {
    (vector(reach), rotation()).prop_map(|(t, r)| Pose::from_parts(Translation3::from(t), r))
}

/// An edge from ten to the power of `least_exponent` to 1, all magnitudes alike.
fn edge(least_exponent: f64) -> impl Strategy<Value = f64> {
    (least_exponent..=0.0).prop_map(|exponent| 10_f64.powf(exponent))
}

/// Points in a box of 1 × `b` × `c`, in general orientation at the origin.
fn boxed(edges: impl Strategy<Value = (f64, f64)>) -> impl Strategy<Value = Cloud> {
    let points = prop::collection::vec(prop::array::uniform3(-0.5..0.5), 4..16);
    (points, edges, rotation()).prop_map(|(points, (b, c), turn)| {
        points.into_iter().map(|[x, y, z]: [f64; 3]| turn * Point3::new(x, b * y, c * z)).collect()
    })
}

/// Full, flat and thin clouds.
fn any_cloud() -> impl Strategy<Value = Cloud> {
    prop_oneof![
        2 => boxed(Just((1.0, 1.0))),
        2 => boxed((edge(-2.0), Just(0.0))),
        4 => boxed((edge(-6.0), edge(-6.0))),
        2 => boxed((edge(-6.0), Just(0.0))),
        1 => boxed(Just((1e-6, 1e-6))),
    ]
}

/// Clouds whose rotation is well determined in all directions.
fn sound_cloud() -> impl Strategy<Value = Cloud> {
    boxed((0.5..=1.0, 0.3..=0.7)).prop_filter("no thin one by chance", |cloud| aspect(cloud) > 0.05)
}

fn noise() -> impl Strategy<Value = Vec<Vector3<f64>>> {
    prop::collection::vec(vector(1.0), 16)
}

fn centroid(points: &[Point3<f64>]) -> Vector3<f64> {
    points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64
}

/// Root mean square extents along the principal axes, metres, the largest first, by the decomposition of the points
/// themselves, which does not square them.
fn extents(points: &[Point3<f64>]) -> [f64; 3] {
    let centre = centroid(points);
    let rows = Mat::from_fn(points.len(), 3, |i, j| points[i][j] - centre[j]);
    let values = rows.svd().expect("finite").S().column_vector().iter().copied().collect::<Vec<_>>();
    [0, 1, 2].map(|k| values[k] / (points.len() as f64).sqrt())
}

fn aspect(points: &[Point3<f64>]) -> f64 {
    let [length, thickness, _] = extents(points);
    thickness / length
}

fn magnitude(points: &[Point3<f64>]) -> f64 {
    points.iter().fold(0.0, |m, p| m.max(p.coords.amax()))
}

fn moved(pose: &Pose, points: &[Point3<f64>]) -> Cloud {
    points.iter().map(|p| pose * p).collect()
}

fn registered(source: &[Point3<f64>], target: &[Point3<f64>]) -> Pose {
    register(source.iter().zip(target)).expect("a rigid motion")
}

/// Angle in radians, and distance in metres at the cloud's centroid, between two motions of it.
fn difference(a: &Pose, b: &Pose, source: &[Point3<f64>]) -> (f64, f64) {
    let centre = Point3::from(centroid(source));
    ((a.inverse() * b).rotation.angle(), (a * centre - b * centre).norm())
}

/// Root mean square distance that remains between the clouds, metres.
fn residual(pose: &Pose, source: &[Point3<f64>], target: &[Point3<f64>]) -> f64 {
    let squares = source.iter().zip(target).map(|(p, q)| (pose * p - q).norm_squared());
    (squares.sum::<f64>() / source.len() as f64).sqrt()
}

/// Kabsch's solution by the singular value decomposition of `faer`: the independent answer.
fn kabsch(source: &[Point3<f64>], target: &[Point3<f64>]) -> Pose {
    let (from, to) = (centroid(source), centroid(target));
    let covariance = Mat::from_fn(3, 3, |i, j| {
        source.iter().zip(target).map(|(p, q)| (p[i] - from[i]) * (q[j] - to[j])).sum::<f64>()
    });
    let svd = covariance.svd().expect("finite");
    let matrix = |m: faer::MatRef<'_, f64>| Matrix3::from_fn(|i, j| m[(i, j)]);
    let (u, v) = (matrix(svd.U()), matrix(svd.V()));
    let sign = (v * u.transpose()).determinant().signum();
    let turn = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Pose::from_parts(Translation3::from(to - turn * from), turn)
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn poses_are_recovered_from_clouds_of_all_shapes(cloud in any_cloud(), truth in pose(1.0)) {
        let target = moved(&truth, &cloud);
        let [length, thickness, _] = extents(&cloud);
        prop_assume!(thickness > THINNEST * length);
        let (angle, distance) = difference(&registered(&cloud, &target), &truth, &cloud);
        let coordinates = magnitude(&cloud).max(magnitude(&target));
        let tolerance = ROUNDING * coordinates.max(SQUARED_ASPECT * length) / thickness;
        prop_assert!(angle <= tolerance, "{angle:e} rad off, {tolerance:e} allowed, thickness {thickness:e} m");
        prop_assert!(distance <= ROUNDING * coordinates, "{distance:e} m off");
    }

    #[test]
    fn poses_are_recovered_far_from_the_origin(
        cloud in any_cloud(), place in vector(1.0), exponent in 0.0..6.0, truth in pose(1.0),
    ) {
        let away = place * 10_f64.powf(exponent);
        let source: Cloud = cloud.iter().map(|p| p + away).collect();
        let far = Pose::from_parts(Translation3::from(away), UnitQuaternion::identity());
        let truth = far * truth * far.inverse();
        // The true motion of such coordinates is itself known to their rounding only, at the cloud.
        let centre = (truth * Point3::from(away)).coords;
        let target: Cloud = cloud.iter().map(|p| truth.rotation * p + centre).collect();
        let (coordinates, [length, thickness, _]) = (magnitude(&source).max(magnitude(&target)), extents(&cloud));
        prop_assume!(thickness > THINNEST * length && thickness > 100.0 * ROUNDING * coordinates);
        let found = registered(&source, &target);
        let angle = (found.rotation.inverse() * truth.rotation).angle();
        let tolerance = ROUNDING * coordinates.max(SQUARED_ASPECT * length) / thickness;
        prop_assert!(angle <= tolerance, "{angle:e} rad off, {tolerance:e} allowed");
        let farthest = source.iter().zip(&target).map(|(p, q)| (found * p - q).norm()).fold(0.0, f64::max);
        prop_assert!(farthest <= 4.0 * ROUNDING * coordinates, "a point is {farthest:e} m off");
    }

    #[test]
    fn no_rigid_motion_by_faer_fits_better(
        cloud in any_cloud(), truth in pose(1.0), noise in noise(), exponent in -6.0..=0.0,
    ) {
        let sigma = 10_f64.powf(exponent);
        let target: Cloud = cloud.iter().zip(noise).map(|(p, e)| truth * p + sigma * e).collect();
        let ours = residual(&registered(&cloud, &target), &cloud, &target);
        let theirs = residual(&kabsch(&cloud, &target), &cloud, &target);
        let rounding = ROUNDING * magnitude(&cloud).max(magnitude(&target));
        prop_assert!(ours <= theirs + rounding, "{ours:e} m against {theirs:e} m");
    }

    #[test]
    fn the_result_is_a_rotation_even_for_mirrored_and_unrelated_clouds(
        cloud in any_cloud(), other in boxed(Just((1.0, 1.0))), mirror in any::<bool>(),
    ) {
        let target: Cloud = if mirror { cloud.iter().map(|p| Point3::new(p.x, p.y, -p.z)).collect() } else { other };
        let cloud = &cloud[..cloud.len().min(target.len())];
        let target = &target[..cloud.len()];
        prop_assume!(aspect(cloud) > THINNEST && aspect(target) > THINNEST);
        let found = registered(cloud, target);
        let matrix = found.rotation.to_rotation_matrix().into_inner();
        prop_assert!((matrix * matrix.transpose() - Matrix3::identity()).amax() <= ROUNDING);
        prop_assert!((matrix.determinant() - 1.0).abs() <= ROUNDING);
        let [ours, theirs] = [found, kabsch(cloud, target)].map(|pose| residual(&pose, cloud, target));
        prop_assert!(ours <= theirs + ROUNDING, "{ours:e} m against {theirs:e} m");
    }

    #[test]
    fn collinear_and_coincident_points_are_refused_by_name(
        places in prop::collection::vec(-1.0..1.0, 3..12), direction in vector(1.0), start in vector(10.0),
        truth in pose(10.0), other in any_cloud(), still in any::<bool>(),
    ) {
        let line: Cloud =
            places.iter().map(|s| Point3::from(start + if still { 0.0 } else { *s } * direction)).collect();
        let target = moved(&truth, &line);
        for (source, target) in [(&line, &target), (&line, &other), (&other, &line)] {
            let refused = register(source.iter().zip(target));
            prop_assert!(matches!(refused, Err(RegistrationError::Collinear { .. })), "{refused:?}");
        }
    }

    #[test]
    fn fewer_than_three_points_are_refused_by_their_number(points in prop::collection::vec(vector(1.0), 0..3)) {
        let points: Cloud = points.into_iter().map(Point3::from).collect();
        let expected = Err(RegistrationError::TooFewPoints { found: points.len() });
        prop_assert_eq!(register(points.iter().zip(&points)), expected);
    }

    #[test]
    fn neither_order_nor_repetition_of_points_matters(
        pairs in (sound_cloud(), noise()).prop_flat_map(|(cloud, noise)| {
            let indices: Vec<usize> = (0..cloud.len()).collect();
            (Just(cloud), Just(noise), Just(indices).prop_shuffle())
        }),
        truth in pose(1.0), times in 2..4_usize,
    ) {
        let (cloud, noise, order) = pairs;
        let target: Cloud = cloud.iter().zip(noise).map(|(p, e)| truth * p + 0.005 * e).collect();
        let found = registered(&cloud, &target);
        let of = |points: &[Point3<f64>], times: usize| -> Cloud {
            order.iter().flat_map(|&i| std::iter::repeat_n(points[i], times)).collect()
        };
        for times in [1, times] {
            let (angle, distance) = difference(&registered(&of(&cloud, times), &of(&target, times)), &found, &cloud);
            prop_assert!(angle <= SAME && distance <= SAME, "{angle:e} rad, {distance:e} m");
        }
    }

    #[test]
    fn moving_source_or_target_moves_the_result_with_it(
        cloud in sound_cloud(), noise in noise(), truth in pose(1.0), before in pose(2.0), after in pose(2.0),
    ) {
        let target: Cloud = cloud.iter().zip(noise).map(|(p, e)| truth * p + 0.005 * e).collect();
        let found = registered(&cloud, &target);
        let (source_moved, target_moved) = (moved(&before, &cloud), moved(&after, &target));
        let (angle, distance) = difference(&(registered(&source_moved, &target) * before), &found, &cloud);
        prop_assert!(angle <= SAME && distance <= SAME, "source: {angle:e} rad, {distance:e} m");
        let (angle, distance) = difference(&registered(&cloud, &target_moved), &(after * found), &cloud);
        prop_assert!(angle <= SAME && distance <= SAME, "target: {angle:e} rad, {distance:e} m");
        let (angle, distance) = difference(&registered(&target, &cloud), &found.inverse(), &target);
        prop_assert!(angle <= SAME && distance <= SAME, "exchanged: {angle:e} rad, {distance:e} m");
    }
}
