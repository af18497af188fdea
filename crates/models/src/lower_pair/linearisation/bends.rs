//! What Gauss-Newton leaves out: how unknowns and positions change residuals together.
//!
//! A joint that leaves more free than there is fits noise with its positions, a sphere to a hinge say, and where its centre
//! then is matters as much by these products as by the derivatives themselves: steps without them creep, or go uphill.

use jointscope_motion::sum_of_lanes;
use nalgebra::{Matrix6, SMatrix};
use pulp::Simd;

use super::{BLOCK, Block, cross, entry, load, store};
use crate::lower_pair::engine::{Normal, UNKNOWNS, Unknowns};

/// Unknowns of which bends are known: those of joint and home pose.
const PLACED: usize = 12;
/// Directions that are told the least in which bends count, and how much is told of those that are told at all, in that of the
/// best known direction.
const WEAK: usize = 4;
const TOLD: f64 = 1e-11;
/// Least curvature in a direction, as a share of that without bends: no step is longer by more.
const LEAST_CURVATURE: f64 = 0.02;

/// What bends take off normal equations and their gradient.
pub(in super::super) struct Bends {
    pub(super) normal: Normal,
    pub(super) gradient: Unknowns,
}

impl Bends {
    /// The gradient of what is left once the positions have followed the unknowns, bends and all.
    pub(in super::super) fn gradient(&self, without: &Unknowns) -> Unknowns {
        without - self.gradient
    }

    /// The step of Newton, from that of the normal equations for the same gradient: longer or shorter in directions of which
    /// the data tell little, and never uphill.
    pub(in super::super) fn newton(&self, normal: &Normal, gradient: &Unknowns, step: &Unknowns) -> Unknowns {
        let weak = weak_directions(normal);
        // Bends in these directions as shares of the curvature without them, and the directions in which they do not mix.
        let bent = weak.tr_mul(&(self.normal * weak)).symmetric_eigen();
        let mut lacking = bent.eigenvectors.tr_mul(&weak.tr_mul(gradient));
        for (part, share) in lacking.iter_mut().zip(&bent.eigenvalues) {
            let curvature = 1.0 - share;
            // Downhill where it bends away, no shorter than without bends.
            let curvature = if curvature < 0.0 { (-curvature).min(1.0) } else { curvature };
            *part *= curvature.max(LEAST_CURVATURE).recip() - 1.0;
        }
        step + weak * (bent.eigenvectors * lacking)
    }
}

/// The directions of which the data tell the least, of unit curvature and conjugate to each other; zero where there are fewer.
/// What moves nothing, an axis along itself say, is not among them.
fn weak_directions(normal: &Normal) -> SMatrix<f64, UNKNOWNS, WEAK> {
    let most = |kind: usize| (0..PLACED).filter(|k| k / 3 % 2 == kind).map(|k| normal[(k, k)]).fold(0.0, f64::max);
    let units = [most(0), most(1)];
    let scale = Unknowns::from_fn(|k, _| {
        let unit = if k < PLACED { units[k / 3 % 2] } else { normal[(k, k)] };
        unit.max(f64::MIN_POSITIVE).sqrt().recip()
    });
    let eigen = normal.component_mul(&(scale * scale.transpose())).symmetric_eigen();
    let told = TOLD * eigen.eigenvalues.max();
    let mut order: [usize; UNKNOWNS] = std::array::from_fn(|k| k);
    order.sort_unstable_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mut weak = SMatrix::<f64, UNKNOWNS, WEAK>::zeros();
    for (column, &k) in order.iter().filter(|k| eigen.eigenvalues[**k] > told).take(WEAK).enumerate() {
        let direction = eigen.eigenvectors.column(k).component_mul(&scale);
        weak.set_column(column, &(direction / eigen.eigenvalues[k].sqrt()));
    }
    weak
}

/// Sums over frames, those of all lanes apart.
pub(super) struct AllLanes<const COLUMNS: usize> {
    normal: [[super::Lanes; COLUMNS]; PLACED],
    gradient: [super::Lanes; PLACED],
}

impl<const COLUMNS: usize> AllLanes<COLUMNS> {
    pub(super) const ZERO: Self = Self { normal: [[[0.0; BLOCK]; COLUMNS]; PLACED], gradient: [[0.0; BLOCK]; PLACED] };

    #[inline(always)]
    pub(super) fn summed_up(&self) -> Bends {
        let mut bends = Bends { normal: Normal::zeros(), gradient: Unknowns::zeros() };
        for a in 0..PLACED {
            bends.gradient[a] = sum_of_lanes(&self.gradient[a]);
            for b in a..COLUMNS {
                bends.normal[(a, b)] = sum_of_lanes(&self.normal[a][b]);
                bends.normal[(b, a)] = bends.normal[(a, b)];
            }
        }
        bends
    }
}

/// Sums over frames, those of different lanes of a register apart.
pub(super) struct Sums<S: Simd, const COLUMNS: usize> {
    normal: [[S::f64s; COLUMNS]; PLACED],
    gradient: [S::f64s; PLACED],
}

impl<S: Simd, const COLUMNS: usize> Sums<S, COLUMNS> {
    #[inline(always)]
    pub(super) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        Self { normal: [[zero; COLUMNS]; PLACED], gradient: [zero; PLACED] }
    }

    /// Stores a part of the lanes.
    #[inline(always)]
    pub(super) fn store(&self, simd: S, lanes: &mut AllLanes<COLUMNS>, part: usize) {
        for a in 0..PLACED {
            store(simd, &mut lanes.gradient[a], part, self.gradient[a]);
            for b in a..COLUMNS {
                store(simd, &mut lanes.normal[a][b], part, self.normal[a][b]);
            }
        }
    }

    /// Adds the frames of a register, whose positions are eliminated; `dual` is the gradient of their cost by the residual.
    ///
    /// With `v = Ad(K h⁻¹) ∂h`, in the moving body's coordinates, `∂²e/∂θ∂q` is `-½ [Ad(K) δ + Ad(K h⁻¹) δ, v]` for a step `δ`
    /// of the joint and `½ [η, v]` for a step `η` of the home pose: products of exponentials to the second order.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        simd: S,
        block: &mut Block,
        part: usize,
        freedoms: usize,
        carry: &Matrix6<f64>,
        dual: &[S::f64s; 6],
    ) {
        let zero = simd.splat_f64s(0.0);
        let half = simd.splat_f64s(0.5);
        let mut bent = [[zero; PLACED]; 3];
        for k in 0..freedoms {
            let moves = carried(simd, carry, &turned_back(simd, block, k, part));
            let by_body = transposed_bracket(simd, &moves, dual);
            let by_joint = carried_over(simd, carry, &by_body);
            let both = with_turned(simd, block, part, &by_joint);
            for c in 0..6 {
                bent[k][c] = simd.mul_f64s(half, both[c]);
                bent[k][6 + c] = simd.sub_f64s(zero, simd.mul_f64s(half, by_body[c]));
            }
        }
        for k in 0..freedoms {
            // To positions at right angles, as their triangle tells.
            for earlier in 0..k {
                let share = load(simd, &block.triangle[entry(earlier, k)], part);
                for c in 0..PLACED {
                    bent[k][c] = simd.sub_f64s(bent[k][c], simd.mul_f64s(share, bent[earlier][c]));
                }
            }
            let length = load(simd, &block.triangle[entry(k, k)], part);
            let own = load(simd, &block.eliminated[k], part);
            let mut rows = [zero; COLUMNS];
            for c in 0..COLUMNS {
                rows[c] = load(simd, &block.rows[k][c], part);
            }
            for c in 0..PLACED {
                bent[k][c] = simd.div_f64s(bent[k][c], length);
                self.gradient[c] = simd.mul_add_f64s(bent[k][c], own, self.gradient[c]);
            }
            for a in 0..PLACED {
                for b in a..COLUMNS {
                    let mut sum = simd.mul_add_f64s(bent[k][a], rows[b], self.normal[a][b]);
                    if b < PLACED {
                        sum = simd.mul_add_f64s(bent[k][b], simd.add_f64s(rows[a], bent[k][a]), sum);
                    }
                    self.normal[a][b] = sum;
                }
            }
            for c in 0..PLACED {
                store(simd, &mut block.rows[k][c], part, simd.add_f64s(rows[c], bent[k][c]));
            }
        }
    }
}

/// `Ad(h⁻¹)` of a position's twist.
#[inline(always)]
fn turned_back<S: Simd>(simd: S, block: &Block, freedom: usize, part: usize) -> [S::f64s; 6] {
    let mut out = [simd.splat_f64s(0.0); 6];
    for m in 0..3 {
        for c in 0..3 {
            let (turn, lift) = (load(simd, &block.turn[3 * m + c], part), load(simd, &block.lift[3 * m + c], part));
            let angular = load(simd, &block.twists[6 * freedom + c], part);
            let linear = load(simd, &block.twists[6 * freedom + 3 + c], part);
            out[m] = simd.mul_add_f64s(turn, angular, out[m]);
            out[3 + m] = simd.mul_add_f64s(turn, linear, simd.mul_add_f64s(lift, angular, out[3 + m]));
        }
    }
    out
}

/// A covector and `Ad(h⁻¹)ᵀ` of it.
#[inline(always)]
fn with_turned<S: Simd>(simd: S, block: &Block, part: usize, covector: &[S::f64s; 6]) -> [S::f64s; 6] {
    let mut out = *covector;
    for m in 0..3 {
        for c in 0..3 {
            let (turn, lift) = (load(simd, &block.turn[3 * m + c], part), load(simd, &block.lift[3 * m + c], part));
            out[c] = simd.mul_add_f64s(turn, covector[m], simd.mul_add_f64s(lift, covector[3 + m], out[c]));
            out[3 + c] = simd.mul_add_f64s(turn, covector[3 + m], out[3 + c]);
        }
    }
    out
}

/// `Ad(K)` of a twist.
#[inline(always)]
fn carried<S: Simd>(simd: S, carry: &Matrix6<f64>, twist: &[S::f64s; 6]) -> [S::f64s; 6] {
    let mut out = [simd.splat_f64s(0.0); 6];
    for r in 0..6 {
        // The upper right of an adjoint is zero.
        for c in 0..(if r < 3 { 3 } else { 6 }) {
            out[r] = simd.mul_add_f64s(simd.splat_f64s(carry[(r, c)]), twist[c], out[r]);
        }
    }
    out
}

/// `Ad(K)ᵀ` of a covector.
#[inline(always)]
fn carried_over<S: Simd>(simd: S, carry: &Matrix6<f64>, covector: &[S::f64s; 6]) -> [S::f64s; 6] {
    let mut out = [simd.splat_f64s(0.0); 6];
    for c in 0..6 {
        for r in (if c < 3 { 0 } else { 3 })..6 {
            out[c] = simd.mul_add_f64s(simd.splat_f64s(carry[(r, c)]), covector[r], out[c]);
        }
    }
    out
}

/// `ad(v)ᵀ g`, so that its product with a twist `s` is that of `g` with `[v, s]`.
#[inline(always)]
fn transposed_bracket<S: Simd>(simd: S, v: &[S::f64s; 6], g: &[S::f64s; 6]) -> [S::f64s; 6] {
    let (angular, linear) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
    let (of_turn, of_shift) = ([g[0], g[1], g[2]], [g[3], g[4], g[5]]);
    let (turn, lever, shift) =
        (cross(simd, of_turn, angular), cross(simd, of_shift, linear), cross(simd, of_shift, angular));
    let mut out = [turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]];
    for k in 0..3 {
        out[k] = simd.add_f64s(out[k], lever[k]);
    }
    out
}

#[cfg(test)]
mod tests {
    use jointscope_motion::{
        Pose,
        twist::{self, Twist},
    };
    use nalgebra::{Matrix6, Vector2, Vector3, Vector6};

    use super::super::{Linear, Linearisation, Whitening};
    use super::*;
    use crate::lower_pair::{Mechanism, Spherical};

    /// What is added to products of derivatives, position by position and unknown by unknown, is that of the residual's mixed
    /// second derivatives, by differences.
    #[test]
    fn bends_are_mixed_second_derivatives() {
        /// Size of the residual, of which terms of second order are left out, and the step of differences.
        const SMALL: f64 = 1e-3;
        const STEP: f64 = 1e-3;
        let wild = |seed: usize| (seed as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) * 2.0 - 1.0;
        let wild_twist = |seed: usize| Vector6::from_fn(|row, _| wild(7 * seed + row));
        let (sphere, none) = (Spherical::default(), Vector2::zeros());
        let (joint, home, q) = (twist::exp(&wild_twist(1)), twist::exp(&wild_twist(2)), Vector3::new(0.4, -0.3, 0.6));
        let seen = joint * sphere.pose(&q, &none) * joint.inverse() * home * twist::exp(&(wild_twist(3) * SMALL));
        let white = Matrix6::from_fn(|r, c| 0.3 * wild(100 + 6 * r + c)) + Matrix6::identity();
        let residual = |unknown: usize, step: f64, position: usize, moved: f64| {
            let placed = twist::exp(&Twist::ith(unknown % 6, step));
            let (joint, home) = if unknown < 6 { (joint * placed, home) } else { (joint, home * placed) };
            let motion: Pose = sphere.pose(&sphere.advance(&q, &Vector3::ith(position, moved)), &none);
            twist::log(&(home.inverse() * joint * motion.inverse() * joint.inverse() * seen))
        };
        let left = residual(0, 0.0, 0, 0.0);
        let mut linear = Linearisation::new(1, 3, 0);
        let inverse = sphere.pose(&q, &none).inverse();
        let (twists, by_constants) = (sphere.twists(&q, &none), [Twist::zeros(); 2]);
        linear.set(0, &Linear { residual: &left, inverse: &inverse, twists, by_constants });
        let carry = home.inverse() * joint;
        linear.equations(&Whitening::of(&[white]), &carry, true);
        let (rows, triangle) = (linear.blocks[0].rows, linear.triangle(0));
        // Derivatives where the residual does not vanish: half a bracket less.
        let turn = twist::angular(&left).cross_matrix();
        let mut bracket = Matrix6::zeros();
        bracket.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        bracket.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        bracket.fixed_view_mut::<3, 3>(3, 0).copy_from(&twist::linear(&left).cross_matrix());
        let before = white * (Matrix6::identity() - 0.5 * bracket);
        let (carried, along) = (before * twist::adjoint(&carry), before * twist::adjoint(&(carry * inverse)));
        let by_unknown =
            |c: usize| if c < 6 { (along - carried).column(c).into_owned() } else { before.column(c - 6).into_owned() };
        let dual = white.tr_mul(&(white * left));
        let mut most = 0.0_f64;
        for k in 0..3 {
            for c in 0..PLACED {
                // Rows are those of positions at right angles, which the triangle turns back.
                let product: f64 = (0..=k).map(|m| triangle[(m, k)] * rows[m][c][0]).sum();
                let found = product - (along * twists[k]).dot(&by_unknown(c));
                let across = |step: f64| residual(c, step, k, STEP) - residual(c, step, k, -STEP);
                let expected = dual.dot(&((across(STEP) - across(-STEP)) / (4.0 * STEP * STEP)));
                assert!((found - expected).abs() < 20.0 * SMALL * SMALL, "{k}, {c}: {found:e} {expected:e}");
                most = most.max(expected.abs());
            }
        }
        assert!(most > 100.0 * SMALL * SMALL, "bends are seen: {most:e}");
    }
}
