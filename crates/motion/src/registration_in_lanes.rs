//! Registration of many frames to one shape, several frames in the lanes of a vector register.
//!
//! Kernels are written once for all instruction sets; which one there is is found at run time. What is not inlined into
//! the place where that happens would lose the instructions, so everything here is.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use bytemuck::cast_slice;
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use pulp::{Arch, Simd, WithSimd};

use crate::flat_rows::{expanded, first_holds};
use crate::prefetch::ahead_of;
use crate::registration::register_weighted;
use crate::rotation_in_lanes::{BLOCK, has_digits, solve_rotations};
use crate::{Pose, Tracks};

/// Offset of a body, in its size and weighed by the gap, above which sums about another place than the body's own
/// centre lose digits.
const LARGEST_OFFSET: f64 = 1e5;

/// Registers every frame to a shape whose features are where `shape` says, metres; `None` for frames that determine no
/// rigid motion.
///
/// As [`register`](crate::register) of what a frame shows, to some 1e-11 rad, and many times as fast: covariances are
/// summed straight from frame-major positions, and rotations of eight frames found at a time as the eigenvector of the
/// largest eigenvalue of Horn's 4×4 matrix, by Halley's iteration and the adjugate. Frames for which that would lose
/// digits, of thin or far bodies, are solved by [`register`](crate::register) itself. Nothing is allocated per frame.
///
/// # Panics
/// If `shape` has not one place per feature, or `poses` not one per frame.
///
/// # References
/// D. L. Theobald, Acta Crystallographica A 61 (2005); P. Liu, D. K. Agrafiotis, D. L. Theobald, J. Comput. Chem. 31
/// (2010).
///
/// ```
/// use jointscope_motion::{Tracks, nalgebra::{Isometry3, Point3, Vector3}, register_frames};
/// let shape = [Point3::new(0., 0., 0.), Point3::new(1., 0., 0.), Point3::new(0., 2., 0.)];
/// let truth = [0.0, 0.5, 3.0].map(|angle| Isometry3::new(Vector3::new(1., 2., 3.), Vector3::z() * angle));
/// let tracks = Tracks::new(3, truth.iter().flat_map(|pose| shape.map(|p| pose * p)).collect())?;
/// let mut recording_from_body = vec![None; 3];
/// register_frames(&shape.map(Some), &tracks, &mut recording_from_body);
/// for (found, truth) in recording_from_body.into_iter().zip(truth) {
///     assert!((found.expect("solvable").inverse() * truth).rotation.angle() < 1e-12);
/// }
/// # Ok::<(), jointscope_motion::MotionError>(())
/// ```
pub fn register_frames(shape: &[Option<Point3<f64>>], tracks: &Tracks, poses: &mut [Option<Pose>]) {
    register_frames_weighted(shape, tracks, None, poses);
}

/// As [`register_frames`], every sample with a weight of its own, frame-major; those of weight 0 do not count.
pub(crate) fn register_frames_weighted(
    shape: &[Option<Point3<f64>>],
    tracks: &Tracks,
    weights: Option<&[f64]>,
    poses: &mut [Option<Pose>],
) {
    register_and_look(shape, tracks, weights, poses, &mut Nobody);
}

/// As [`register_frames`], with somebody who looks at frames as soon as they are posed, while caches hold them.
pub(crate) fn register_and_look(
    shape: &[Option<Point3<f64>>],
    tracks: &Tracks,
    weights: Option<&[f64]>,
    poses: &mut [Option<Pose>],
    look: &mut impl Look,
) {
    assert_eq!(shape.len(), tracks.features(), "one place per feature");
    assert_eq!(poses.len(), tracks.frames(), "one pose per frame");
    Arch::new().dispatch(Frames { shape, tracks, weights, poses, look });
}

/// What looks at frames that were just posed.
pub(crate) trait Look {
    /// Looks at up to eight frames from `first` on. Must be inlined, for the instruction set.
    fn look<S: Simd>(&mut self, simd: S, first: usize, poses: &[Option<Pose>]);
}

struct Nobody;

impl Look for Nobody {
    #[inline(always)]
    fn look<S: Simd>(&mut self, _: S, _: usize, _: &[Option<Pose>]) {}
}

struct Frames<'a, L> {
    shape: &'a [Option<Point3<f64>>],
    tracks: &'a Tracks,
    weights: Option<&'a [f64]>,
    poses: &'a mut [Option<Pose>],
    look: &'a mut L,
}

/// Sums over a frame's samples of weight `w`, places `p` about the shape's centre, and positions `q`; frames in lanes.
#[derive(Clone, Copy)]
struct Sums {
    /// `Σ w p qᵀ`, row by row; with the centring in it once solved.
    covariance: [[f64; BLOCK]; 9],
    /// `Σ w q`.
    target: [[f64; BLOCK]; 3],
    /// `Σ w p`.
    source: [[f64; BLOCK]; 3],
    /// `Σ w`, and how many weights are not 0.
    count: [f64; BLOCK],
    found: [usize; BLOCK],
}

/// Rotations of a block: quaternion `w, x, y, z`, the eigenvalue and the gap that say whether it can be trusted.
struct Rotations {
    quaternion: [[f64; BLOCK]; 4],
    eigenvalue: [[f64; BLOCK]; 1],
    gap: [[f64; BLOCK]; 1],
}

impl<L: Look> WithSimd for Frames<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { shape, tracks, weights, poses, look } = self;
        let places = Places::of(shape);
        let mut row = vec![0.0; places.expanded[0].len()];
        for (number, poses) in poses.chunks_mut(BLOCK).enumerate() {
            let none = [0.0; BLOCK];
            let mut sums =
                Sums { covariance: [none; 9], target: [none; 3], source: [none; 3], count: none, found: [0; BLOCK] };
            for lane in 0..poses.len() {
                let frame = number * BLOCK + lane;
                let weights = weights.map(|weights| &weights[frame * shape.len()..(frame + 1) * shape.len()]);
                add_frame(simd, &places, tracks, frame, weights, &mut row, &mut sums, lane);
            }
            let rotations = solve(simd, &mut sums);
            for (lane, pose) in poses.iter_mut().enumerate() {
                *pose = finish(&places, &sums, &rotations, lane).or_else(|| {
                    let frame = number * BLOCK + lane;
                    let weight = |feature| weights.map_or(1.0, |weights| weights[frame * shape.len() + feature]);
                    let seen = tracks.seen(frame);
                    register_weighted(seen.filter_map(|(f, target)| Some((shape[f].as_ref()?, target, weight(f))))).ok()
                });
            }
            look.look(simd, number * BLOCK, poses);
        }
    }
}

/// A shape as the sums need it.
struct Places {
    centre: Vector3<f64>,
    /// Of every feature about the centre; 0 where unknown.
    about_centre: Vec<Vector3<f64>>,
    known: Vec<bool>,
    /// As a frame's row meets them.
    expanded: [Vec<f64>; 3],
    /// Their sum, zero but for rounding.
    sum: Vector3<f64>,
    complete: bool,
    /// Largest distance from the centre, and largest coordinate, metres.
    radius: f64,
    magnitude: f64,
}

impl Places {
    fn of(shape: &[Option<Point3<f64>>]) -> Self {
        let known: Vec<bool> = shape.iter().map(Option::is_some).collect();
        let count = known.iter().filter(|known| **known).count();
        let centre = shape.iter().flatten().map(|p| p.coords).sum::<Vector3<f64>>() / count.max(1) as f64;
        let about_centre: Vec<_> =
            shape.iter().map(|place| place.map_or_else(Vector3::zeros, |place| place.coords - centre)).collect();
        let expanded = expanded(&about_centre);
        Self {
            centre,
            sum: about_centre.iter().sum(),
            complete: count == shape.len(),
            radius: about_centre.iter().map(Vector3::norm).fold(0.0, f64::max),
            magnitude: shape.iter().flatten().map(|p| p.coords.amax()).fold(0.0, f64::max),
            about_centre,
            known,
            expanded,
        }
    }
}

/// Sums one frame into a lane.
///
/// A frame is read as the flat row of numbers that it is, as in `flat_rows`.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the inner part of one loop")]
fn add_frame<S: Simd>(
    simd: S,
    places: &Places,
    tracks: &Tracks,
    frame: usize,
    weights: Option<&[f64]>,
    row: &mut [f64],
    sums: &mut Sums,
    lane: usize,
) {
    let lanes = S::F64_LANES;
    let positions: &[f64] = cast_slice(tracks.frame(frame));
    let features = places.known.len();
    let whole = places.complete
        && tracks.seen_count(frame) == features
        && weights.is_none_or(|weights| weights.iter().all(|weight| *weight == 1.0));
    if whole {
        (sums.found[lane], sums.count[lane]) = (features, features as f64);
        for axis in 0..3 {
            sums.source[axis][lane] = places.sum[axis];
        }
    } else {
        let (mut found, mut count, mut source) = (0, 0.0, Vector3::zeros());
        for (feature, place) in places.about_centre.iter().enumerate() {
            let counts = places.known[feature] && tracks.is_visible(frame, feature);
            let weight = if counts { weights.map_or(1.0, |weights| weights[feature]) } else { 0.0 };
            row[3 * feature..3 * feature + 3].fill(weight);
            found += usize::from(weight > 0.0);
            count += weight;
            source += place * weight;
        }
        (sums.found[lane], sums.count[lane]) = (found, count);
        for axis in 0..3 {
            sums.source[axis][lane] = source[axis];
        }
    }
    let zero = simd.splat_f64s(0.0);
    let (mut covariance, mut target) = ([[zero; 3]; 3], [zero; 3]);
    let x = S::as_simd_f64s(&places.expanded[0]).0;
    let y = S::as_simd_f64s(&places.expanded[1]).0;
    let z = S::as_simd_f64s(&places.expanded[2]).0;
    let row = S::as_simd_f64s(row).0;
    let (full, rest) = S::as_simd_f64s(positions);
    let triples = full.len() / 3;
    for triple in 0..triples {
        for k in 0..3 {
            let at = 3 * triple + k;
            ahead_of(positions[lanes * at..].as_ptr());
            let mut q = full[at];
            if !whole {
                q = simd.mul_f64s(q, row[at]);
            }
            covariance[0][k] = simd.mul_add_e_f64s(x[at], q, covariance[0][k]);
            covariance[1][k] = simd.mul_add_e_f64s(y[at], q, covariance[1][k]);
            covariance[2][k] = simd.mul_add_e_f64s(z[at], q, covariance[2][k]);
            target[k] = simd.add_f64s(target[k], q);
        }
    }
    for at in 3 * triples..(3 * features).div_ceil(lanes) {
        let k = at - 3 * triples;
        let mut q = if at < full.len() { full[at] } else { simd.partial_load_f64s(rest) };
        if !whole {
            q = simd.mul_f64s(q, row[at]);
        }
        covariance[0][k] = simd.mul_add_e_f64s(x[at], q, covariance[0][k]);
        covariance[1][k] = simd.mul_add_e_f64s(y[at], q, covariance[1][k]);
        covariance[2][k] = simd.mul_add_e_f64s(z[at], q, covariance[2][k]);
        target[k] = simd.add_f64s(target[k], q);
    }
    for axis in 0..3 {
        let [first, second, third] = sums_by_coordinate(simd, covariance[axis]);
        sums.covariance[3 * axis][lane] = first;
        sums.covariance[3 * axis + 1][lane] = second;
        sums.covariance[3 * axis + 2][lane] = third;
    }
    let target = sums_by_coordinate(simd, target);
    for axis in 0..3 {
        sums.target[axis][lane] = target[axis];
    }
}

/// Sums of the lanes of three registers that hold the same coordinate; each lane holds each coordinate once in them.
#[inline(always)]
fn sums_by_coordinate<S: Simd>(simd: S, [a, b, c]: [S::f64s; 3]) -> [f64; 3] {
    let [is_0, is_1] = first_holds(simd);
    // The register that follows holds, in the same lane, the coordinate that is `lanes mod 3` on.
    let (next, last) = if S::F64_LANES % 3 == 1 { (b, c) } else { (c, b) };
    // By the coordinate that the first register holds, the register with coordinate 0, 1 or 2.
    let first = simd.select_f64s(is_0, a, simd.select_f64s(is_1, last, next));
    let second = simd.select_f64s(is_0, next, simd.select_f64s(is_1, a, last));
    let third = simd.select_f64s(is_0, last, simd.select_f64s(is_1, next, a));
    [simd.reduce_sum_f64s(first), simd.reduce_sum_f64s(second), simd.reduce_sum_f64s(third)]
}

/// Rotations of a block of frames, from the covariances about their centres, which replace those in `sums`.
#[inline(always)]
fn solve<S: Simd>(simd: S, sums: &mut Sums) -> Rotations {
    let none = [0.0; BLOCK];
    let mut found = Rotations { quaternion: [none; 4], eigenvalue: [none], gap: [none] };
    let count = S::as_simd_f64s(&sums.count).0;
    for part in 0..count.len() {
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), count[part]);
        let mut h = [inverse; 9];
        for axis in 0..3 {
            let source = simd.mul_f64s(S::as_simd_f64s(&sums.source[axis]).0[part], inverse);
            for other in 0..3 {
                let sum = S::as_simd_f64s(&sums.covariance[3 * axis + other]).0[part];
                let product = simd.mul_f64s(source, S::as_simd_f64s(&sums.target[other]).0[part]);
                h[3 * axis + other] = simd.sub_f64s(sum, product);
            }
        }
        let [(quaternion, eigenvalue, gap)] = solve_rotations(simd, &[h]);
        for (row, value) in found.quaternion.iter_mut().zip(quaternion) {
            S::as_mut_simd_f64s(row).0[part] = value;
        }
        S::as_mut_simd_f64s(&mut found.eigenvalue[0]).0[part] = eigenvalue;
        S::as_mut_simd_f64s(&mut found.gap[0]).0[part] = gap;
    }
    found
}

/// The pose of a lane, if its rotation can be trusted.
#[inline(always)]
fn finish(places: &Places, sums: &Sums, rotations: &Rotations, lane: usize) -> Option<Pose> {
    let (count, eigenvalue, gap) = (sums.count[lane], rotations.eigenvalue[0][lane], rotations.gap[0][lane]);
    let source = places.centre + Vector3::from_fn(|axis, _| sums.source[axis][lane]) / count;
    let target = Vector3::from_fn(|axis, _| sums.target[axis][lane]) / count;
    let offset = count * places.radius * (target.amax() + places.magnitude);
    let trusted = sums.found[lane] >= 3 && has_digits(gap, eigenvalue) && offset < LARGEST_OFFSET * gap * eigenvalue;
    if !trusted {
        return None;
    }
    let [w, x, y, z] = [0, 1, 2, 3].map(|k| rotations.quaternion[k][lane]);
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    Some(Pose::from_parts(Translation3::from(target - rotation * source), rotation))
}

#[cfg(test)]
mod tests;
