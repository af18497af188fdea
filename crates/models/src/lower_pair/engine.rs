//! Fits a mechanism to a series of uncertain poses: damped Gauss-Newton with the positions of every frame eliminated.

use jointscope_motion::{
    Pose,
    twist::{self, Twist},
};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, SMatrix, SVector, Vector2, Vector3, Vector6};

use super::Mechanism;

/// Unknowns: six of the joint's coordinates, six of the home pose, two constants.
const UNKNOWNS: usize = 14;
type Jacobian = SMatrix<f64, 6, UNKNOWNS>;
type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;

/// Most iterations, and those that every start gets before the best goes on alone.
const ITERATIONS: usize = 25;
const TRIAL_ITERATIONS: usize = 4;
/// Relative change of the cost at which two iterations in a row end the fit.
const CONVERGED: f64 = 1e-6;
/// Largest turn of one step, radians: beyond, the linearisation means nothing.
const LARGEST_TURN: f64 = 0.5;
/// Damping of directions that the data do not tell, as a share of the mean diagonal.
const GAUGE: f64 = 1e-10;
/// Damping of every turn, and of every shift, as a share of the damping of the best known.
const EVEN: f64 = 1e-3;

/// Where a mechanism's fit begins, or where it ended.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// `reference_from_joint`.
    pub joint: Pose,
    /// `reference_from_moving` where all positions are 0.
    pub home: Pose,
    /// The mechanism's constants, a pitch say.
    pub constants: Vector2<f64>,
}

/// A fitted mechanism.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Where the joint is.
    pub placement: Placement,
    /// Positions of every frame.
    pub positions: Vec<Vector3<f64>>,
    /// `fitted⁻¹ · measured` of every frame, as a twist in the moving body's coordinates about its centre.
    pub residuals: Vec<Twist>,
    /// Weighted sum of squared residuals.
    pub chi_squared: f64,
    /// Covariance of the joint's coordinates, as a twist in joint coordinates; directions of which nothing is told are
    /// huge.
    pub joint_covariance: Matrix6<f64>,
    /// Covariance of the first constant.
    pub constant_variance: f64,
    /// Covariance of the positions in every frame.
    pub position_noise: Vec<Matrix3<f64>>,
}

/// Fits a mechanism: `pose_t = joint · h(q_t) · joint⁻¹ · home · exp(e_t)`, minimising `Σ |A_t e_t|²`.
///
/// `whitening` holds `A_t`, a root of the information of every pose: `A_tᵀ A_t = N_t⁻¹`.
///
/// *Method.* Steps are taken on the right of joint and home, so that all derivatives are in joint coordinates:
/// `∂e/∂joint = -K (Ad(h⁻¹) - 1)`, `∂e/∂home = -1`, `∂e/∂q = -K Ad(h⁻¹) ∂h` with `K = Ad(home⁻¹ joint)`. The positions
/// of every frame are eliminated by an orthogonal projection; damping (Levenberg-Marquardt) keeps what the data do not
/// tell where it is.
///
/// No frame and no iteration allocates.
pub fn fit(
    mechanism: &dyn Mechanism,
    poses: &[Pose],
    whitening: &[Matrix6<f64>],
    starts: &[Placement],
) -> Option<Fitted> {
    let mut best: Option<State> = None;
    for start in starts {
        let mut state = State::new(mechanism, poses, whitening, *start, projected(mechanism, poses, start));
        state.iterate(mechanism, poses, whitening, if starts.len() > 1 { TRIAL_ITERATIONS } else { ITERATIONS });
        if state.cost.is_finite() && best.as_ref().is_none_or(|best| state.cost < best.cost) {
            best = Some(state);
        }
    }
    let mut state = best?;
    if starts.len() > 1 && !state.converged {
        state.iterate(mechanism, poses, whitening, ITERATIONS - TRIAL_ITERATIONS);
    }
    Some(state.finish(mechanism, poses, whitening))
}

/// Fits a mechanism with other weights, from where a fit of the same poses ended.
pub fn refit(mechanism: &dyn Mechanism, poses: &[Pose], whitening: &[Matrix6<f64>], from: &Fitted) -> Option<Fitted> {
    let mut state = State::new(mechanism, poses, whitening, from.placement, from.positions.clone());
    state.iterate(mechanism, poses, whitening, ITERATIONS);
    state.cost.is_finite().then(|| state.finish(mechanism, poses, whitening))
}

/// Positions nearest to the poses.
fn projected(mechanism: &dyn Mechanism, poses: &[Pose], start: &Placement) -> Vec<Vector3<f64>> {
    let (back, away) = (start.joint.inverse(), start.home.inverse() * start.joint);
    let mut previous = Vector3::zeros();
    let project = |pose: &Pose| {
        previous = mechanism.project(&(back * pose * away), &previous, &start.constants);
        previous
    };
    poses.iter().map(project).collect()
}

struct State {
    placement: Placement,
    positions: Vec<Vector3<f64>>,
    residuals: Vec<Twist>,
    cost: f64,
    damping: f64,
    stalled: usize,
    converged: bool,
    trial: Vec<Vector3<f64>>,
    trial_residuals: Vec<Twist>,
    eliminated: Vec<Eliminated>,
}

/// What is left of a frame after its positions are eliminated: how they follow the unknowns.
#[derive(Clone)]
struct Eliminated {
    basis: Matrix6x3<f64>,
    triangle: Matrix3<f64>,
    residual: Vector3<f64>,
    jacobian: SMatrix<f64, 3, UNKNOWNS>,
}

impl State {
    fn new(
        mechanism: &dyn Mechanism,
        poses: &[Pose],
        whitening: &[Matrix6<f64>],
        start: Placement,
        positions: Vec<Vector3<f64>>,
    ) -> Self {
        let mut state = Self {
            placement: start,
            trial: positions.clone(),
            positions,
            residuals: vec![Twist::zeros(); poses.len()],
            trial_residuals: vec![Twist::zeros(); poses.len()],
            cost: f64::INFINITY,
            damping: 1e-3,
            stalled: 0,
            converged: false,
            eliminated: vec![
                Eliminated {
                    basis: Matrix6x3::zeros(),
                    triangle: Matrix3::identity(),
                    residual: Vector3::zeros(),
                    jacobian: SMatrix::zeros()
                };
                poses.len()
            ],
        };
        state.cost = residuals(mechanism, poses, whitening, &state.placement, &state.positions, &mut state.residuals);
        state
    }

    fn iterate(&mut self, mechanism: &dyn Mechanism, poses: &[Pose], whitening: &[Matrix6<f64>], iterations: usize) {
        for _ in 0..iterations {
            let (normal, gradient) = self.linearise(mechanism, whitening);
            if !self.step(mechanism, poses, whitening, &normal, &gradient) || self.stalled >= 2 {
                self.converged = true;
                break;
            }
        }
    }

    /// Normal equations of the unknowns, the positions eliminated.
    fn linearise(&mut self, mechanism: &dyn Mechanism, whitening: &[Matrix6<f64>]) -> (Normal, Unknowns) {
        let Placement { joint, home, constants } = self.placement;
        let carry = twist::adjoint(&(home.inverse() * joint));
        let freedoms = mechanism.freedoms();
        let (mut normal, mut gradient) = (Normal::zeros(), Unknowns::zeros());
        for (frame, white) in whitening.iter().enumerate() {
            let q = &self.positions[frame];
            let turned = twist::adjoint(&mechanism.pose(q, &constants).inverse());
            let carried = white * carry;
            let along = carried * turned;
            let mut jacobian = Jacobian::zeros();
            jacobian.fixed_view_mut::<6, 6>(0, 0).copy_from(&(along - carried));
            jacobian.fixed_view_mut::<6, 6>(0, 6).copy_from(white);
            let by_constants = mechanism.constant_twists(q, &constants);
            for (column, by_constant) in by_constants.iter().enumerate().take(mechanism.constants()) {
                jacobian.set_column(12 + column, &(along * by_constant));
            }
            let mut residual: Vector6<f64> = white * self.residuals[frame];
            let eliminated = &mut self.eliminated[frame];
            let twists = mechanism.twists(q, &constants);
            for (k, twist) in twists.iter().enumerate().take(freedoms) {
                let mut column: Vector6<f64> = along * twist;
                for other in 0..k {
                    let share = eliminated.basis.column(other).dot(&column);
                    eliminated.triangle[(other, k)] = share;
                    column -= eliminated.basis.column(other) * share;
                }
                let length = column.norm().max(f64::MIN_POSITIVE);
                eliminated.triangle[(k, k)] = length;
                column /= length;
                eliminated.basis.set_column(k, &column);
                eliminated.residual[k] = column.dot(&residual);
                residual -= column * eliminated.residual[k];
                let row = column.tr_mul(&jacobian);
                jacobian -= column * row;
                eliminated.jacobian.set_row(k, &row);
            }
            normal += jacobian.tr_mul(&jacobian);
            gradient += jacobian.tr_mul(&residual);
        }
        (normal, gradient)
    }

    /// One damped step; `false` if none lowers the cost.
    fn step(
        &mut self,
        mechanism: &dyn Mechanism,
        poses: &[Pose],
        whitening: &[Matrix6<f64>],
        normal: &Normal,
        gradient: &Unknowns,
    ) -> bool {
        for _ in 0..5 {
            let Some(step) = solve(normal, gradient, self.damping) else { return false };
            let turn = step.fixed_rows::<3>(0).amax().max(step.fixed_rows::<3>(6).amax());
            let step = if turn > LARGEST_TURN { step * (LARGEST_TURN / turn) } else { step };
            let placement = Placement {
                joint: self.placement.joint * twist::exp(&step.fixed_rows::<6>(0).into_owned()),
                home: self.placement.home * twist::exp(&step.fixed_rows::<6>(6).into_owned()),
                constants: self.placement.constants + step.fixed_rows::<2>(12),
            };
            let freedoms = mechanism.freedoms();
            for ((trial, q), eliminated) in self.trial.iter_mut().zip(&self.positions).zip(&self.eliminated) {
                let mut left = eliminated.residual - eliminated.jacobian * step;
                for k in (0..freedoms).rev() {
                    for later in k + 1..freedoms {
                        left[k] -= eliminated.triangle[(k, later)] * left[later];
                    }
                    left[k] /= eliminated.triangle[(k, k)];
                }
                (freedoms..3).for_each(|k| left[k] = 0.0);
                *trial = mechanism.advance(q, &left);
            }
            let cost = residuals(mechanism, poses, whitening, &placement, &self.trial, &mut self.trial_residuals);
            if cost <= self.cost {
                let gain = self.cost - cost;
                self.stalled = if gain < CONVERGED * (1.0 + cost) { self.stalled + 1 } else { 0 };
                self.placement = placement;
                std::mem::swap(&mut self.positions, &mut self.trial);
                std::mem::swap(&mut self.residuals, &mut self.trial_residuals);
                self.cost = cost;
                self.damping = (self.damping / 5.0).max(1e-9);
                return true;
            }
            self.damping = (self.damping * 10.0).min(1e6);
        }
        false
    }

    fn finish(mut self, mechanism: &dyn Mechanism, poses: &[Pose], whitening: &[Matrix6<f64>]) -> Fitted {
        let (normal, _) = self.linearise(mechanism, whitening);
        let covariance = solve_all(&normal);
        let freedoms = mechanism.freedoms();
        let position_noise = self
            .eliminated
            .iter()
            .map(|eliminated| {
                let mut triangle = Matrix3::identity();
                triangle
                    .view_mut((0, 0), (freedoms, freedoms))
                    .copy_from(&eliminated.triangle.view((0, 0), (freedoms, freedoms)));
                (0..3).for_each(|column| (column + 1..3).for_each(|row| triangle[(row, column)] = 0.0));
                let inverse = triangle.try_inverse().unwrap_or_else(Matrix3::identity);
                inverse * inverse.transpose()
            })
            .collect();
        debug_assert_eq!(poses.len(), self.positions.len());
        Fitted {
            placement: self.placement,
            positions: self.positions,
            residuals: self.residuals,
            chi_squared: self.cost,
            joint_covariance: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
            constant_variance: covariance[(12, 12)],
            position_noise,
        }
    }
}

/// Residual of every frame; gives the weighted sum of their squares.
fn residuals(
    mechanism: &dyn Mechanism,
    poses: &[Pose],
    whitening: &[Matrix6<f64>],
    placement: &Placement,
    positions: &[Vector3<f64>],
    residuals: &mut [Twist],
) -> f64 {
    let (back, away) = (placement.home.inverse() * placement.joint, placement.joint.inverse());
    let mut sum = 0.0;
    for (((pose, white), q), residual) in poses.iter().zip(whitening).zip(positions).zip(residuals) {
        let inverse = mechanism.pose(q, &placement.constants).inverse();
        *residual = twist::log(&(back * inverse * (away * pose)));
        sum += (white * *residual).norm_squared();
    }
    sum
}

fn damped(normal: &Normal, damping: f64) -> Normal {
    let floor = GAUGE * normal.trace() / UNKNOWNS as f64 + f64::MIN_POSITIVE;
    let most = |range: [usize; 6]| range.into_iter().map(|k| normal[(k, k)]).fold(0.0, f64::max);
    let (turns, shifts) = (most([0, 1, 2, 6, 7, 8]), most([3, 4, 5, 9, 10, 11]));
    let mut damped = *normal;
    for k in 0..UNKNOWNS {
        // Damping in proportion to what the data tell pulls along what they do not.
        let least = if k >= 12 { 0.0 } else { EVEN * if k % 6 < 3 { turns } else { shifts } };
        damped[(k, k)] += damping * (normal[(k, k)] + least) + floor;
    }
    damped
}

fn solve(normal: &Normal, gradient: &Unknowns, damping: f64) -> Option<Unknowns> {
    let step = damped(normal, damping).cholesky()?.solve(gradient);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Inverse of the normal matrix, huge where it is singular.
fn solve_all(normal: &Normal) -> Normal {
    damped(normal, 1e-9).cholesky().map_or_else(|| Normal::identity() * 1e12, |factor| factor.inverse())
}
