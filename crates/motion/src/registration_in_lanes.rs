//! Registration of many frames to one shape, several frames in the lanes of a vector register.
//!
//! Kernels are written once for all instruction sets; which one there is is found at run time. What is not inlined into
//! the place where that happens would lose the instructions, so everything here is.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use bytemuck::cast_slice;
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use pulp::{Simd, WithSimd};

use crate::flat_rows::{expanded, holds, lanes_lack};
use crate::instructions::arch;
use crate::prefetch::{AHEAD, ahead_of};
use crate::registration::register_weighted;
use crate::rotation_in_lanes::{BLOCK, have_digits, solve_rotations};
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
    arch().dispatch(Frames { shape, tracks, weights, poses, look });
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
struct Sums {
    /// `Σ w p qᵀ`, row by row, and `Σ w q`.
    products: [[f64; BLOCK]; 12],
    /// `Σ w p`.
    source: [[f64; BLOCK]; 3],
    /// `Σ w`, and how many weights are not 0.
    count: [f64; BLOCK],
    found: [usize; BLOCK],
}

/// Poses of a block: quaternion `w, x, y, z`, translation, and 1 where they can be trusted.
struct Solved {
    quaternion: [[f64; BLOCK]; 4],
    translation: [[f64; BLOCK]; 3],
    trusted: [f64; BLOCK],
}

impl<L: Look> WithSimd for Frames<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { shape, tracks, weights, poses, look } = self;
        let places = Places::of(shape);
        let mut row = vec![0.0; places.expanded[0].len()];
        let lanes_lack = lanes_lack(simd);
        for (number, poses) in poses.chunks_mut(BLOCK).enumerate() {
            let none = [0.0; BLOCK];
            let mut sums = Sums { products: [none; 12], source: [none; 3], count: none, found: [0; BLOCK] };
            let mut products = [[simd.splat_f64s(0.0); BLOCK]; 12];
            for lane in 0..poses.len() {
                let frame = number * BLOCK + lane;
                let weights = weights.map(|weights| &weights[frame * shape.len()..(frame + 1) * shape.len()]);
                let of_frame = add_frame(simd, &places, tracks, frame, weights, &mut row, &mut sums, lane);
                for k in 0..12 {
                    products[k][lane] = of_frame[k];
                }
            }
            for k in 0..12 {
                sums_of_registers(simd, lanes_lack, &products[k], &mut sums.products[k]);
            }
            let solved = solve(simd, &places, &sums);
            for (lane, pose) in poses.iter_mut().enumerate() {
                *pose = solved.pose(&sums, lane).or_else(|| {
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

/// Sums one frame: counts and places into a lane, the products into registers whose lanes still are to be summed up.
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
) -> [S::f64s; 12] {
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
    let numbers = Numbers {
        places: [0, 1, 2].map(|axis| S::as_simd_f64s(&places.expanded[axis]).0),
        positions,
        weights: if whole { None } else { Some(S::as_simd_f64s(row).0) },
    };
    // Narrow registers hold a part of what a wide one would, and sums are those of wide ones, lane by lane.
    match BLOCK / S::F64_LANES {
        1 => numbers.products(simd, 0),
        2 => added(simd, numbers.products(simd, 0), numbers.products(simd, 1)),
        4 => numbers.products_of_four(simd, 0, 1),
        _ => added(simd, numbers.products_of_four(simd, 0, 2), numbers.products_of_four(simd, 1, 2)),
    }
}

/// A frame's numbers, the places of the shape that they meet, and weights unless all are 1.
struct Numbers<'a, S: Simd> {
    places: [&'a [S::f64s]; 3],
    positions: &'a [f64],
    weights: Option<&'a [S::f64s]>,
}

impl<S: Simd> Numbers<'_, S> {
    /// `Σ w p qᵀ`, row by row, and `Σ w q`, in one part of the lanes.
    #[inline(always)]
    fn products(&self, simd: S, part: usize) -> [S::f64s; 12] {
        let (zero, parts) = (simd.splat_f64s(0.0), BLOCK / S::F64_LANES);
        let (full, rest) = S::as_simd_f64s(self.positions);
        // Rows of the covariance, and the targets.
        let mut sums = [[zero; 3]; 4];
        let triples = full.len() / (3 * parts);
        for triple in 0..triples {
            for k in 0..3 {
                let at = (3 * triple + k) * parts + part;
                if part == 0 {
                    ahead_of(self.positions[S::F64_LANES * at..].as_ptr(), AHEAD);
                }
                self.add(simd, &mut sums, k, at, full[at]);
            }
        }
        for k in 0..3 {
            let at = (3 * triples + k) * parts + part;
            if at < full.len() {
                self.add(simd, &mut sums, k, at, full[at]);
            } else if at == full.len() && !rest.is_empty() {
                self.add(simd, &mut sums, k, at, simd.partial_load_f64s(rest));
            }
        }
        let mut products = [zero; 12];
        for (row, registers) in sums.into_iter().enumerate() {
            let by_coordinate = by_coordinate(simd, part, registers);
            for k in 0..3 {
                products[3 * row + k] = by_coordinate[k];
            }
        }
        products
    }

    /// Adds a register, whose coordinates are those of the register `k` of a triple.
    #[inline(always)]
    fn add(&self, simd: S, sums: &mut [[S::f64s; 3]; 4], k: usize, at: usize, mut q: S::f64s) {
        if let Some(weights) = self.weights {
            q = simd.mul_f64s(q, weights[at]);
        }
        for axis in 0..3 {
            sums[axis][k] = simd.mul_add_f64s(self.places[axis][at], q, sums[axis][k]);
        }
        sums[3][k] = simd.add_f64s(sums[3][k], q);
    }

    /// The same of four parts, of every so many from the first on.
    #[inline(always)]
    fn products_of_four(&self, simd: S, first: usize, every: usize) -> [S::f64s; 12] {
        let pair = |part| added(simd, self.products(simd, part), self.products(simd, part + 2 * every));
        added(simd, pair(first), pair(first + every))
    }
}

#[inline(always)]
fn added<S: Simd>(simd: S, mut a: [S::f64s; 12], b: [S::f64s; 12]) -> [S::f64s; 12] {
    for k in 0..12 {
        a[k] = simd.add_f64s(a[k], b[k]);
    }
    a
}

/// Of three wide registers that hold all coordinates in turn, each lane each of them once, the lanes of every coordinate in
/// one part of them.
#[inline(always)]
fn by_coordinate<S: Simd>(simd: S, part: usize, [a, b, c]: [S::f64s; 3]) -> [S::f64s; 3] {
    let [is_0, is_1] = holds(simd, part);
    // The register that follows holds, in the same lane, the coordinate that is two on.
    let (next, last) = (c, b);
    // By the coordinate that the first register holds, the register with coordinate 0, 1 or 2.
    let first = simd.select_f64s(is_0, a, simd.select_f64s(is_1, last, next));
    let second = simd.select_f64s(is_0, next, simd.select_f64s(is_1, a, last));
    let third = simd.select_f64s(is_0, last, simd.select_f64s(is_1, next, a));
    [first, second, third]
}

/// The sum over the lanes of each of several registers, in the order of `sum_of_lanes`.
///
/// Of two registers, the lower half of the one and the upper half of the other are added to their other halves; of two that
/// come of that, every other quarter; and so on, until each lane is the sum of one register.
#[inline(always)]
fn sums_of_registers<S: Simd>(
    simd: S,
    lanes_lack: [S::m64s; 3],
    registers: &[S::f64s; BLOCK],
    sums: &mut [f64; BLOCK],
) {
    if S::F64_LANES < BLOCK {
        // Narrow registers are summed up in as few instructions alone.
        for lane in 0..BLOCK {
            sums[lane] = simd.reduce_sum_f64s(registers[lane]);
        }
        return;
    }
    let mut left = *registers;
    let mut count = BLOCK;
    for bit in (0..3).rev() {
        count /= 2;
        for k in 0..count {
            let (a, b) = (left[k], left[k + count]);
            let stays = simd.select_f64s(lanes_lack[bit], a, b);
            let comes = if 2 << bit == BLOCK {
                simd.rotate_left_f64s(simd.select_f64s(lanes_lack[bit], b, a), 1 << bit)
            } else {
                let (up, down) = (simd.rotate_left_f64s(a, 1 << bit), simd.rotate_right_f64s(b, 1 << bit));
                simd.select_f64s(lanes_lack[bit], up, down)
            };
            left[k] = simd.add_f64s(stays, comes);
        }
    }
    S::as_mut_simd_f64s(sums).0[0] = left[0];
}

/// Poses of a block of frames.
#[inline(always)]
fn solve<S: Simd>(simd: S, places: &Places, sums: &Sums) -> Solved {
    let none = [0.0; BLOCK];
    let mut found = Solved { quaternion: [none; 4], translation: [none; 3], trusted: none };
    let count = S::as_simd_f64s(&sums.count).0;
    let (zero, one, two) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0), simd.splat_f64s(2.0));
    for part in 0..count.len() {
        let inverse = simd.div_f64s(one, count[part]);
        let (mut h, mut source, mut target) = ([inverse; 9], [inverse; 3], [inverse; 3]);
        for axis in 0..3 {
            source[axis] = simd.mul_f64s(S::as_simd_f64s(&sums.source[axis]).0[part], inverse);
            target[axis] = S::as_simd_f64s(&sums.products[9 + axis]).0[part];
        }
        for axis in 0..3 {
            for other in 0..3 {
                let sum = S::as_simd_f64s(&sums.products[3 * axis + other]).0[part];
                h[3 * axis + other] = simd.sub_f64s(sum, simd.mul_f64s(source[axis], target[other]));
            }
        }
        let [(quaternion, eigenvalue, gap)] = solve_rotations(simd, &[h]);
        let mut farthest = zero;
        for axis in 0..3 {
            source[axis] = simd.add_f64s(source[axis], simd.splat_f64s(places.centre[axis]));
            target[axis] = simd.mul_f64s(target[axis], inverse);
            farthest = simd.max_f64s(farthest, simd.abs_f64s(target[axis]));
        }
        // Far bodies lose digits, as thin ones do.
        let reach = simd.add_f64s(farthest, simd.splat_f64s(places.magnitude));
        let offset = simd.mul_f64s(simd.mul_f64s(count[part], simd.splat_f64s(places.radius)), reach);
        let bearable = simd.mul_f64s(simd.mul_f64s(simd.splat_f64s(LARGEST_OFFSET), gap), eigenvalue);
        let trusted = simd.select_f64s(simd.less_than_f64s(offset, bearable), one, zero);
        let trusted = simd.select_f64s(have_digits(simd, gap, eigenvalue), trusted, zero);
        S::as_mut_simd_f64s(&mut found.trusted).0[part] = trusted;
        // v + 2 u × (u × v + w v) for the quaternion (w, u).
        let [w, x, y, z] = quaternion;
        let mut turned = cross(simd, [x, y, z], source);
        for axis in 0..3 {
            turned[axis] = simd.mul_add_f64s(w, source[axis], turned[axis]);
        }
        let turned = cross(simd, [x, y, z], turned);
        for axis in 0..3 {
            let placed = simd.mul_add_f64s(two, turned[axis], source[axis]);
            S::as_mut_simd_f64s(&mut found.translation[axis]).0[part] = simd.sub_f64s(target[axis], placed);
        }
        for k in 0..4 {
            S::as_mut_simd_f64s(&mut found.quaternion[k]).0[part] = quaternion[k];
        }
    }
    found
}

/// Vector products.
#[inline(always)]
fn cross<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    let x = simd.sub_f64s(simd.mul_f64s(a[1], b[2]), simd.mul_f64s(a[2], b[1]));
    let y = simd.sub_f64s(simd.mul_f64s(a[2], b[0]), simd.mul_f64s(a[0], b[2]));
    let z = simd.sub_f64s(simd.mul_f64s(a[0], b[1]), simd.mul_f64s(a[1], b[0]));
    [x, y, z]
}

impl Solved {
    /// The pose of a lane, if it can be trusted.
    #[inline(always)]
    fn pose(&self, sums: &Sums, lane: usize) -> Option<Pose> {
        if sums.found[lane] < 3 || self.trusted[lane] == 0.0 {
            return None;
        }
        let (q, t) = (&self.quaternion, &self.translation);
        let rotation = Quaternion::new(q[0][lane], q[1][lane], q[2][lane], q[3][lane]);
        let translation = Translation3::new(t[0][lane], t[1][lane], t[2][lane]);
        Some(Pose::from_parts(translation, UnitQuaternion::new_unchecked(rotation)))
    }
}

#[cfg(test)]
mod tests;
