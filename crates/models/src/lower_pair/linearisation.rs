//! Normal equations of a mechanism's fit, eight frames in the lanes of a register.
//!
//! The kernel is written once for all instruction sets; what is not inlined into the place where these are found would
//! lose them.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

mod bends;

use jointscope_motion::{Pose, arch, sum_of_lanes, twist, twist::Twist};
use nalgebra::{Matrix3, Matrix6, Vector3};
use pulp::{Simd, WithSimd};

pub(super) use bends::Bends;

use super::engine::{Normal, UNKNOWNS, Unknowns};

/// Frames in a block: the lanes of the widest registers.
const BLOCK: usize = 8;
/// A number of each frame of a block.
type Lanes = [f64; BLOCK];

/// The whitening matrices of frames, eight at a time, row by row; zero beyond the last frame.
pub(super) struct Whitening(Vec<[Lanes; 36]>);

impl Whitening {
    pub(super) fn of(matrices: &[Matrix6<f64>]) -> Self {
        let block = |matrices: &[Matrix6<f64>]| {
            let mut block = [[0.0; BLOCK]; 36];
            for (lane, matrix) in matrices.iter().enumerate() {
                for k in 0..36 {
                    block[k][lane] = matrix[(k / 6, k % 6)];
                }
            }
            block
        };
        Self(matrices.chunks(BLOCK).map(block).collect())
    }
}

/// What a frame contributes: its residual, how far the joint has moved it, and how that changes.
pub(super) struct Linear<'a> {
    pub residual: &'a Twist,
    /// `h⁻¹`.
    pub inverse: &'a Pose,
    pub twists: [Twist; 3],
    pub by_constants: [Twist; 2],
}

/// Frames of a block, and what is left of them after their positions are eliminated.
#[derive(Clone)]
struct Block {
    residual: [Lanes; 6],
    /// Rotation of `h⁻¹`, and its translation's cross product with that.
    turn: [Lanes; 9],
    lift: [Lanes; 9],
    twists: [Lanes; 18],
    by_constants: [Lanes; 12],
    /// Of the positions, column by column: how they follow one another, the residual, and the unknowns.
    triangle: [Lanes; 6],
    eliminated: [Lanes; 3],
    rows: [[Lanes; UNKNOWNS]; 3],
}

const EMPTY: Block = Block {
    residual: [[0.0; BLOCK]; 6],
    turn: [[0.0; BLOCK]; 9],
    lift: [[0.0; BLOCK]; 9],
    twists: [[0.0; BLOCK]; 18],
    by_constants: [[0.0; BLOCK]; 12],
    triangle: [[0.0; BLOCK]; 6],
    eliminated: [[0.0; BLOCK]; 3],
    rows: [[[0.0; BLOCK]; UNKNOWNS]; 3],
};

/// The place of entry (row, column) of a triangle, column by column.
const fn entry(row: usize, column: usize) -> usize {
    column * (column + 1) / 2 + row
}

/// The frames of a fit, linearised.
pub(super) struct Linearisation {
    blocks: Vec<Block>,
    freedoms: usize,
    constants: usize,
}

impl Linearisation {
    /// Of a mechanism of so many freedoms and constants.
    pub(super) fn new(frames: usize, freedoms: usize, constants: usize) -> Self {
        Self { blocks: vec![EMPTY; frames.div_ceil(BLOCK)], freedoms, constants }
    }

    /// Takes in a frame.
    pub(super) fn set(&mut self, frame: usize, linear: &Linear<'_>) {
        let (block, lane) = (&mut self.blocks[frame / BLOCK], frame % BLOCK);
        let turn = linear.inverse.rotation.to_rotation_matrix().into_inner();
        let lift: Matrix3<f64> = linear.inverse.translation.vector.cross_matrix() * turn;
        for k in 0..9 {
            block.turn[k][lane] = turn[(k / 3, k % 3)];
            block.lift[k][lane] = lift[(k / 3, k % 3)];
        }
        for k in 0..6 {
            block.residual[k][lane] = linear.residual[k];
            for freedom in 0..self.freedoms {
                block.twists[6 * freedom + k][lane] = linear.twists[freedom][k];
            }
            for constant in 0..self.constants {
                block.by_constants[6 * constant + k][lane] = linear.by_constants[constant][k];
            }
        }
    }

    /// Normal equations of the unknowns, the positions eliminated; `carry` takes joint coordinates to the moving body's.
    ///
    /// If asked for, also what bends take off them; positions then follow a step by their bends as well.
    pub(super) fn equations(
        &mut self,
        white: &Whitening,
        carry: &Pose,
        bent: bool,
    ) -> (Normal, Unknowns, Option<Bends>) {
        let carry = &twist::adjoint(carry);
        if bent {
            arch().dispatch(Equations::<true> { white, carry, linear: self })
        } else {
            arch().dispatch(Equations::<false> { white, carry, linear: self })
        }
    }

    /// How a step of the unknowns moves the positions of a frame.
    pub(super) fn advance(&self, frame: usize, step: &Unknowns) -> Vector3<f64> {
        let (block, lane) = (&self.blocks[frame / BLOCK], frame % BLOCK);
        let mut left = Vector3::zeros();
        for k in (0..self.freedoms).rev() {
            left[k] = block.eliminated[k][lane];
            for column in 0..12 + self.constants {
                left[k] -= block.rows[k][column][lane] * step[column];
            }
            for later in k + 1..self.freedoms {
                left[k] -= block.triangle[entry(k, later)][lane] * left[later];
            }
            left[k] /= block.triangle[entry(k, k)][lane];
        }
        left
    }

    /// What the cost would fall by, did the positions alone move and were all residuals linear.
    pub(super) fn promised_by_positions(&self) -> f64 {
        let eliminated = self.blocks.iter().flat_map(|block| &block.eliminated[..self.freedoms]);
        eliminated.flatten().map(|part| part * part).sum()
    }

    /// The triangle of a frame's positions, whose square is their information; 1 for positions that are not used.
    pub(super) fn triangle(&self, frame: usize) -> Matrix3<f64> {
        let (block, lane) = (&self.blocks[frame / BLOCK], frame % BLOCK);
        let mut triangle = Matrix3::identity();
        for column in 0..self.freedoms {
            for row in 0..=column {
                triangle[(row, column)] = block.triangle[entry(row, column)][lane];
            }
        }
        triangle
    }
}

struct Equations<'a, const BENT: bool> {
    white: &'a Whitening,
    carry: &'a Matrix6<f64>,
    linear: &'a mut Linearisation,
}

impl<const BENT: bool> WithSimd for Equations<'_, BENT> {
    type Output = (Normal, Unknowns, Option<Bends>);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // Loops of known lengths are unrolled.
        match self.linear.constants {
            0 => self.of_columns::<S, 12>(simd),
            1 => self.of_columns::<S, 13>(simd),
            _ => self.of_columns::<S, 14>(simd),
        }
    }
}

impl<const BENT: bool> Equations<'_, BENT> {
    #[inline(always)]
    fn of_columns<S: Simd, const COLUMNS: usize>(self, simd: S) -> (Normal, Unknowns, Option<Bends>) {
        let Self { white, carry, linear } = self;
        let freedoms = linear.freedoms;
        let zero = simd.splat_f64s(0.0);
        let (mut normals, mut gradients) = ([[[0.0; BLOCK]; COLUMNS]; COLUMNS], [[0.0; BLOCK]; COLUMNS]);
        let mut all_bends = bends::AllLanes::<COLUMNS>::ZERO;
        // Narrow registers hold a part of the lanes at a time.
        for at in 0..BLOCK / S::F64_LANES {
            let (mut normal, mut gradient) = ([[zero; COLUMNS]; COLUMNS], [zero; COLUMNS]);
            let mut bends = bends::Sums::<S, COLUMNS>::zero(simd);
            for (white, block) in white.0.iter().zip(&mut linear.blocks) {
                let mut w = [[zero; 6]; 6];
                for r in 0..6 {
                    for c in 0..6 {
                        w[r][c] = load(simd, &white[6 * r + c], at);
                    }
                }
                let mut left = [zero; 6];
                for c in 0..6 {
                    left[c] = load(simd, &block.residual[c], at);
                }
                let mut residual = [zero; 6];
                for r in 0..6 {
                    for c in 0..6 {
                        residual[r] = simd.mul_add_f64s(w[r][c], left[c], residual[r]);
                    }
                }
                let dual = unwhitened(simd, &w, &residual);
                let w = if BENT { before_residual(simd, &w, &left) } else { w };
                let carried = whitened_carry(simd, &w, carry);
                let along = carried_back(simd, &carried, block, at);
                let mut j = [[zero; COLUMNS]; 6];
                for r in 0..6 {
                    for c in 0..6 {
                        j[r][c] = simd.sub_f64s(along[r][c], carried[r][c]);
                        j[r][6 + c] = w[r][c];
                    }
                    for constant in 0..COLUMNS - 12 {
                        for m in 0..6 {
                            let by = load(simd, &block.by_constants[6 * constant + m], at);
                            j[r][12 + constant] = simd.mul_add_f64s(along[r][m], by, j[r][12 + constant]);
                        }
                    }
                }
                eliminate(simd, block, at, freedoms, &along, &mut j, &mut residual);
                if BENT {
                    bends.add(simd, block, at, freedoms, carry, &dual);
                }
                for a in 0..COLUMNS {
                    for r in 0..6 {
                        gradient[a] = simd.mul_add_f64s(j[r][a], residual[r], gradient[a]);
                    }
                    for b in a..COLUMNS {
                        let mut sum = normal[a][b];
                        for r in 0..6 {
                            sum = simd.mul_add_f64s(j[r][a], j[r][b], sum);
                        }
                        normal[a][b] = sum;
                    }
                }
            }
            for a in 0..COLUMNS {
                store(simd, &mut gradients[a], at, gradient[a]);
                for b in a..COLUMNS {
                    store(simd, &mut normals[a][b], at, normal[a][b]);
                }
            }
            if BENT {
                bends.store(simd, &mut all_bends, at);
            }
        }
        let (mut sums, mut right) = (Normal::zeros(), Unknowns::zeros());
        for a in 0..COLUMNS {
            right[a] = sum_of_lanes(&gradients[a]);
            for b in a..COLUMNS {
                sums[(a, b)] = sum_of_lanes(&normals[a][b]);
                sums[(b, a)] = sums[(a, b)];
            }
        }
        (sums, right, if BENT { Some(all_bends.summed_up()) } else { None })
    }
}

#[inline(always)]
fn load<S: Simd>(_: S, lanes: &Lanes, part: usize) -> S::f64s {
    S::as_simd_f64s(lanes).0[part]
}

#[inline(always)]
fn store<S: Simd>(_: S, lanes: &mut Lanes, part: usize, value: S::f64s) {
    S::as_mut_simd_f64s(lanes).0[part] = value;
}

/// The gradient of a frame's cost by its residual, `Wᵀ W e`.
#[inline(always)]
fn unwhitened<S: Simd>(simd: S, w: &[[S::f64s; 6]; 6], whitened: &[S::f64s; 6]) -> [S::f64s; 6] {
    let mut dual = [simd.splat_f64s(0.0); 6];
    for r in 0..6 {
        for c in 0..6 {
            dual[c] = simd.mul_add_f64s(w[r][c], whitened[r], dual[c]);
        }
    }
    dual
}

/// `W (1 - ad(e)/2)`: what comes before a residual `e` changes it by so much, to first order.
#[inline(always)]
fn before_residual<S: Simd>(simd: S, w: &[[S::f64s; 6]; 6], left: &[S::f64s; 6]) -> [[S::f64s; 6]; 6] {
    let half = simd.splat_f64s(0.5);
    let (turn, shift) = ([left[0], left[1], left[2]], [left[3], left[4], left[5]]);
    let mut out = *w;
    for r in 0..6 {
        let (of_turn, of_shift) = ([w[r][0], w[r][1], w[r][2]], [w[r][3], w[r][4], w[r][5]]);
        let (a, b, c) = (cross(simd, of_turn, turn), cross(simd, of_shift, shift), cross(simd, of_shift, turn));
        for k in 0..3 {
            out[r][k] = simd.sub_f64s(w[r][k], simd.mul_f64s(half, simd.add_f64s(a[k], b[k])));
            out[r][3 + k] = simd.sub_f64s(w[r][3 + k], simd.mul_f64s(half, c[k]));
        }
    }
    out
}

/// `W Ad(carry)`, where the upper right of an adjoint is zero.
#[inline(always)]
fn whitened_carry<S: Simd>(simd: S, w: &[[S::f64s; 6]; 6], carry: &Matrix6<f64>) -> [[S::f64s; 6]; 6] {
    let mut carried = [[simd.splat_f64s(0.0); 6]; 6];
    for c in 0..6 {
        for m in (if c < 3 { 0 } else { 3 })..6 {
            let factor = simd.splat_f64s(carry[(m, c)]);
            for r in 0..6 {
                carried[r][c] = simd.mul_add_f64s(w[r][m], factor, carried[r][c]);
            }
        }
    }
    carried
}

/// The same times `Ad(h⁻¹)`.
#[inline(always)]
fn carried_back<S: Simd>(simd: S, carried: &[[S::f64s; 6]; 6], block: &Block, part: usize) -> [[S::f64s; 6]; 6] {
    let mut along = [[simd.splat_f64s(0.0); 6]; 6];
    for m in 0..3 {
        for c in 0..3 {
            let (turn, lift) = (load(simd, &block.turn[3 * m + c], part), load(simd, &block.lift[3 * m + c], part));
            for r in 0..6 {
                let sum = simd.mul_add_f64s(carried[r][m], turn, along[r][c]);
                along[r][c] = simd.mul_add_f64s(carried[r][3 + m], lift, sum);
                along[r][3 + c] = simd.mul_add_f64s(carried[r][3 + m], turn, along[r][3 + c]);
            }
        }
    }
    along
}

/// Projects Jacobian and residual to where no position moves them, and keeps what is projected away.
#[inline(always)]
fn eliminate<S: Simd, const COLUMNS: usize>(
    simd: S,
    block: &mut Block,
    part: usize,
    freedoms: usize,
    along: &[[S::f64s; 6]; 6],
    j: &mut [[S::f64s; COLUMNS]; 6],
    residual: &mut [S::f64s; 6],
) {
    let zero = simd.splat_f64s(0.0);
    let mut basis = [[zero; 6]; 3];
    for k in 0..freedoms {
        let mut column = [zero; 6];
        for m in 0..6 {
            let twist = load(simd, &block.twists[6 * k + m], part);
            for r in 0..6 {
                column[r] = simd.mul_add_f64s(along[r][m], twist, column[r]);
            }
        }
        for other in 0..k {
            let share = scalar_product(simd, &basis[other], &column);
            store(simd, &mut block.triangle[entry(other, k)], part, share);
            for r in 0..6 {
                column[r] = simd.sub_f64s(column[r], simd.mul_f64s(basis[other][r], share));
            }
        }
        let length = simd.sqrt_f64s(scalar_product(simd, &column, &column));
        let length = simd.max_f64s(length, simd.splat_f64s(f64::MIN_POSITIVE));
        store(simd, &mut block.triangle[entry(k, k)], part, length);
        for r in 0..6 {
            column[r] = simd.div_f64s(column[r], length);
        }
        let own = scalar_product(simd, &column, residual);
        store(simd, &mut block.eliminated[k], part, own);
        for r in 0..6 {
            residual[r] = simd.sub_f64s(residual[r], simd.mul_f64s(column[r], own));
        }
        for c in 0..COLUMNS {
            let mut row = zero;
            for r in 0..6 {
                row = simd.mul_add_f64s(column[r], j[r][c], row);
            }
            store(simd, &mut block.rows[k][c], part, row);
            for r in 0..6 {
                j[r][c] = simd.sub_f64s(j[r][c], simd.mul_f64s(column[r], row));
            }
        }
        basis[k] = column;
    }
}

#[inline(always)]
fn cross<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    let mut out = a;
    for k in 0..3 {
        let (next, last) = ((k + 1) % 3, (k + 2) % 3);
        out[k] = simd.sub_f64s(simd.mul_f64s(a[next], b[last]), simd.mul_f64s(a[last], b[next]));
    }
    out
}

#[inline(always)]
fn scalar_product<S: Simd>(simd: S, a: &[S::f64s; 6], b: &[S::f64s; 6]) -> S::f64s {
    let mut sum = simd.mul_f64s(a[0], b[0]);
    for r in 1..6 {
        sum = simd.mul_add_f64s(a[r], b[r], sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, Vector6};

    use super::*;

    fn wild(seed: usize) -> f64 {
        (seed as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) * 2.0 - 1.0
    }

    fn wild_twist(seed: usize) -> Twist {
        Vector6::from_fn(|row, _| wild(7 * seed + row))
    }

    /// Normal equations and steps of positions are those of the dense system in which positions are unknowns too.
    #[test]
    fn positions_are_eliminated_as_in_the_dense_system() {
        const FRAMES: usize = 11;
        let carry = twist::exp(&wild_twist(1));
        for (freedoms, constants) in [(0, 0), (1, 0), (1, 1), (2, 2), (3, 0)] {
            let white: Vec<Matrix6<f64>> = (0..FRAMES)
                .map(|frame| Matrix6::from_fn(|r, c| wild(100 + 37 * frame + 6 * r + c)) + Matrix6::identity())
                .collect();
            let inverses: Vec<Pose> = (0..FRAMES).map(|frame| twist::exp(&wild_twist(200 + frame))).collect();
            let residuals: Vec<Twist> = (0..FRAMES).map(|frame| wild_twist(300 + frame)).collect();
            let twists = |frame: usize| [0, 1, 2].map(|k| wild_twist(400 + 3 * frame + k));
            let by_constants = |frame: usize| [0, 1].map(|k| wild_twist(500 + 2 * frame + k));
            let mut linear = Linearisation::new(FRAMES, freedoms, constants);
            for frame in 0..FRAMES {
                let (residual, inverse) = (&residuals[frame], &inverses[frame]);
                let (twists, by_constants) = (twists(frame), by_constants(frame));
                linear.set(frame, &Linear { residual, inverse, twists, by_constants });
            }
            let (normal, gradient, _) = linear.equations(&Whitening::of(&white), &carry, false);

            let (mut expected, mut right) = (Normal::zeros(), Unknowns::zeros());
            let step = Unknowns::from_fn(|row, _| if row < 12 + constants { wild(600 + row) } else { 0.0 });
            for frame in 0..FRAMES {
                let carried = white[frame] * twist::adjoint(&carry);
                let along = carried * twist::adjoint(&inverses[frame]);
                let mut jacobian = SMatrix::<f64, 6, UNKNOWNS>::zeros();
                jacobian.fixed_view_mut::<6, 6>(0, 0).copy_from(&(along - carried));
                jacobian.fixed_view_mut::<6, 6>(0, 6).copy_from(&white[frame]);
                for constant in 0..constants {
                    jacobian.set_column(12 + constant, &(along * by_constants(frame)[constant]));
                }
                let moves = nalgebra::DMatrix::from_fn(6, freedoms, |r, k| (along * twists(frame)[k])[r]);
                let residual = white[frame] * residuals[frame];
                let inverse = (moves.transpose() * &moves).try_inverse().expect("independent positions");
                let project = Matrix6::identity() - &moves * &inverse * moves.transpose();
                expected += jacobian.transpose() * project * jacobian;
                right += jacobian.transpose() * project * residual;
                let position = &inverse * moves.transpose() * (residual - jacobian * step);
                let found = linear.advance(frame, &step);
                for k in 0..freedoms {
                    assert!((found[k] - position[k]).abs() < 1e-7 * position.amax().max(1.0), "{found} {position}");
                }
                let triangle = linear.triangle(frame);
                let information = moves.transpose() * &moves;
                let square = triangle.transpose() * triangle;
                for k in 0..freedoms {
                    assert!((square[(k, k)] - information[(k, k)]).abs() < 1e-9 * information.amax());
                }
            }
            assert!((normal - expected).amax() < 1e-9 * expected.amax(), "{freedoms} freedoms: {normal} {expected}");
            assert!((gradient - right).amax() < 1e-9 * right.amax());
        }
    }
}
