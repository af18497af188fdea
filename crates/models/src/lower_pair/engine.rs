//! Fits a mechanism to a series of uncertain poses: damped Gauss-Newton with the positions of every frame eliminated.

use std::borrow::Cow;

use jointscope_motion::{
    Pose, evenly,
    twist::{self, Twist},
};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector2, Vector3};

use super::Mechanism;
use super::linearisation::{Bends, Linear, Linearisation, Whitening};
use super::mixing::{Mixing, Step};

/// Unknowns: six of the joint's coordinates, six of the home pose, two constants.
pub(super) const UNKNOWNS: usize = 14;
pub(super) type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;

/// Most iterations, and those that every start gets before the best goes on alone.
const ITERATIONS: usize = 25;
const TRIAL_ITERATIONS: usize = 4;
/// Frames that every start is tried on, where there are twice as many or more.
const TRIAL_FRAMES: usize = 64;
/// Relative change of the cost that ends a fit: where the normal equations promise no more, or two iterations in a row
/// have brought no more.
const CONVERGED: f64 = 1e-6;
/// Share of what an iteration brought from which on the next one creeps, where steps of Newton end that, and by which factor
/// these are shortened until they lower the cost.
const CREEPING: f64 = 0.1;
const SHORTER: f64 = 0.3;
/// Steps that are tried, ever shorter ones; the first damping, and the least.
const TRIES: usize = 5;
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
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
/// Of many frames, a few tell which start is the best, and bring it near to where all frames have it. Steps learn from
/// those before them.
///
/// No frame allocates, and no iteration after the first four.
pub fn fit(
    mechanism: &dyn Mechanism,
    poses: &[Pose],
    whitening: &[Matrix6<f64>],
    starts: &[Placement],
) -> Option<Fitted> {
    let mut fit = Fit::begin(mechanism, poses, whitening, starts)?;
    fit.settle();
    fit.state.cost.is_finite().then(|| fit.fitted())
}

/// A fit that goes on: from what was found so far, or with other weights.
pub(super) struct Fit<'a> {
    problem: Problem<'a>,
    linear: Linearisation,
    state: State,
    /// What the best fit of a few of the frames left per frame; 0 where there was none.
    left_of_few: f64,
}

impl<'a> Fit<'a> {
    /// The best of several starts after a few iterations, of many frames where a few of them have it.
    pub(super) fn begin(
        mechanism: &'a dyn Mechanism,
        poses: &'a [Pose],
        whitening: &'a [Matrix6<f64>],
        starts: &[Placement],
    ) -> Option<Self> {
        let begun = |start: &Placement| (*start, projected(mechanism, poses, start));
        let problem = Problem::of(mechanism, poses, whitening.into());
        if poses.len() < 2 * TRIAL_FRAMES {
            return Self::best_of(problem, starts.iter().map(begun));
        }
        let few = evenly(poses.len(), TRIAL_FRAMES);
        let poses_of_few: Vec<Pose> = few.iter().map(|&frame| poses[frame]).collect();
        let whitening_of_few: Vec<Matrix6<f64>> = few.iter().map(|&frame| whitening[frame]).collect();
        // Positions are followed through all frames, lest a turn be lost between two of the few.
        let thinned = starts.iter().map(begun).map(|(start, q)| (start, few.iter().map(|&frame| q[frame]).collect()));
        let mut found = Fit::best_of(Problem::of(mechanism, &poses_of_few, whitening_of_few.into()), thinned)?;
        found.settle();
        let (start, positions) = begun(&found.state.placement);
        let left_of_few = found.state.cost / few.len() as f64;
        let (state, linear) = (State::new(&problem, start, positions), problem.linearisation());
        state.cost.is_finite().then_some(Self { problem, linear, state, left_of_few })
    }

    fn best_of(problem: Problem<'a>, starts: impl Iterator<Item = (Placement, Vec<Vector3<f64>>)>) -> Option<Self> {
        let mut linear = problem.linearisation();
        let mut best: Option<State> = None;
        for (start, positions) in starts {
            // What explains all poses as well as the truth would needs no rival.
            if best.as_ref().is_some_and(|best| best.converged && best.cost < problem.expected_cost()) {
                break;
            }
            let mut state = State::new(&problem, start, positions);
            state.iterate(&problem, &mut linear, TRIAL_ITERATIONS, 0.0);
            if state.cost.is_finite() && best.as_ref().is_none_or(|best| state.cost < best.cost) {
                best = Some(state);
            }
        }
        Some(Self { state: best?, problem, linear, left_of_few: 0.0 })
    }

    /// A fit that begins near where it will end, with the positions of every frame, and takes steps of Newton where others
    /// creep.
    pub(super) fn near(
        mechanism: &'a dyn Mechanism,
        poses: &'a [Pose],
        whitening: Cow<'a, [Matrix6<f64>]>,
        placement: Placement,
        positions: Vec<Vector3<f64>>,
    ) -> Self {
        let problem = Problem::of(mechanism, poses, whitening);
        let state = State { newton: true, ..State::new(&problem, placement, positions) };
        let linear = problem.linearisation();
        Self { problem, linear, state, left_of_few: 0.0 }
    }

    /// Iterates until nothing is left to gain.
    pub(super) fn settle(&mut self) {
        self.state.iterate(&self.problem, &mut self.linear, ITERATIONS, 0.0);
    }

    /// Iterates until no more than a share of the cost may be left to gain, and gives the cost per frame: as the normal
    /// equations promise, or as the best fit of a few of the frames, spread evenly over all, leaves.
    pub(super) fn settle_roughly(&mut self, share: f64) -> f64 {
        let frames = self.problem.poses.len() as f64;
        if self.state.cost / frames * (1.0 - share) > self.left_of_few {
            self.state.iterate(&self.problem, &mut self.linear, ITERATIONS, share);
        }
        self.state.cost / frames
    }

    /// Goes on with other weights.
    pub(super) fn reweigh(&mut self, whitening: Cow<'a, [Matrix6<f64>]>) {
        self.problem = Problem::of(self.problem.mechanism, self.problem.poses, whitening);
        self.state.begin_anew(&self.problem);
        self.settle();
    }

    pub(super) fn residuals(&self) -> &[Twist] {
        &self.state.now.residuals
    }

    /// Where it is, and the positions of every frame.
    pub(super) fn place(self) -> (Placement, Vec<Vector3<f64>>) {
        (self.state.placement, self.state.now.positions)
    }

    /// What is found.
    pub(super) fn fitted(&mut self) -> Fitted {
        self.state.fitted(&self.problem, &mut self.linear)
    }
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

/// What is fitted to what.
struct Problem<'a> {
    mechanism: &'a dyn Mechanism,
    poses: &'a [Pose],
    whitening: Cow<'a, [Matrix6<f64>]>,
    lanes: Whitening,
}

impl<'a> Problem<'a> {
    fn of(mechanism: &'a dyn Mechanism, poses: &'a [Pose], whitening: Cow<'a, [Matrix6<f64>]>) -> Self {
        Self { mechanism, poses, lanes: Whitening::of(&whitening), whitening }
    }

    /// The cost of the right mechanism, on average, did the data tell every unknown; more where they do not.
    fn expected_cost(&self) -> f64 {
        let unknowns = UNKNOWNS - 2 + self.mechanism.constants();
        ((6 - self.mechanism.freedoms()) * self.poses.len()).saturating_sub(unknowns) as f64
    }

    fn linearisation(&self) -> Linearisation {
        Linearisation::new(self.poses.len(), self.mechanism.freedoms(), self.mechanism.constants())
    }
}

/// Positions of all frames, and what follows from them.
#[derive(Clone)]
struct Trial {
    positions: Vec<Vector3<f64>>,
    /// `h⁻¹`.
    inverses: Vec<Pose>,
    residuals: Vec<Twist>,
}

struct State {
    placement: Placement,
    now: Trial,
    next: Trial,
    cost: f64,
    damping: f64,
    stalled: usize,
    iterations: usize,
    converged: bool,
    mixing: Mixing,
    /// Whether steps of Newton are taken instead of mixed ones where an iteration brought nearly as much as the one before,
    /// what the last one brought, and whether they are taken next.
    newton: bool,
    gain: f64,
    creeps: bool,
}

impl State {
    fn new(problem: &Problem<'_>, start: Placement, positions: Vec<Vector3<f64>>) -> Self {
        let frames = positions.len();
        let now =
            Trial { positions, inverses: vec![Pose::identity(); frames], residuals: vec![Twist::zeros(); frames] };
        let mut state = Self {
            placement: start,
            next: now.clone(),
            now,
            cost: f64::INFINITY,
            damping: 0.0,
            stalled: 0,
            iterations: 0,
            converged: false,
            mixing: Mixing::default(),
            newton: false,
            gain: f64::INFINITY,
            creeps: false,
        };
        state.begin_anew(problem);
        state
    }

    /// Begins where it is, with weights that are new.
    fn begin_anew(&mut self, problem: &Problem<'_>) {
        self.cost = self.now.follow(problem, &self.placement);
        (self.damping, self.stalled, self.iterations, self.converged) = (FIRST_DAMPING, 0, 0, false);
        (self.gain, self.creeps) = (f64::INFINITY, false);
        self.mixing.clear();
    }

    /// Iterates up to so many iterations in all, or until no more than a share of the cost is promised.
    fn iterate(&mut self, problem: &Problem<'_>, linear: &mut Linearisation, iterations: usize, enough: f64) {
        while !self.converged && self.iterations < iterations {
            let (normal, gradient, bends) = self.linearise(problem, linear, self.creeps);
            let ends = CONVERGED * (1.0 + self.cost);
            let propose = |damping: f64| {
                let step = solve(&normal, &gradient, damping)?;
                Some(bends.as_ref().map_or(step, |bends| bends.newton(&normal, &gradient, &step)))
            };
            let mut proposed = propose(self.damping);
            let mut promised = promised(linear, proposed.as_ref(), &gradient);
            // Damping never adds to what is promised.
            if promised < ends.max(enough * self.cost) {
                let whole = propose(LEAST_DAMPING);
                promised = self::promised(linear, whole.as_ref(), &gradient);
                if promised < enough * self.cost {
                    break;
                }
                if promised < ends {
                    (self.damping, proposed) = (LEAST_DAMPING, whole);
                }
            }
            self.iterations += 1;
            // A last whole step is all that is left to gain.
            let last = promised < ends;
            let lowered = self.step(problem, linear, (&normal, &gradient), proposed, if last { 1 } else { TRIES });
            self.converged = last || !lowered || self.stalled >= 2;
        }
    }

    /// Normal equations of the unknowns, the positions eliminated, with their bends if these are asked for.
    fn linearise(
        &self,
        problem: &Problem<'_>,
        linear: &mut Linearisation,
        bent: bool,
    ) -> (Normal, Unknowns, Option<Bends>) {
        let Placement { joint, home, constants } = self.placement;
        let Trial { positions, inverses, residuals } = &self.now;
        for (frame, q) in positions.iter().enumerate() {
            linear.set(
                frame,
                &Linear {
                    residual: &residuals[frame],
                    inverse: &inverses[frame],
                    twists: problem.mechanism.twists(q, &constants),
                    by_constants: problem.mechanism.constant_twists(q, &constants),
                },
            );
        }
        let (normal, gradient, bends) = linear.equations(&problem.lanes, &(home.inverse() * joint), bent);
        let gradient = bends.as_ref().map_or(gradient, |bends| bends.gradient(&gradient));
        (normal, gradient, bends)
    }

    /// A step as proposed, mixed with those before or alone, or ever shorter ones: of Newton's a share, of others by more
    /// damping. `false` if none of so many lowers the cost.
    fn step(
        &mut self,
        problem: &Problem<'_>,
        linear: &Linearisation,
        (normal, gradient): (&Normal, &Unknowns),
        proposed: Option<Unknowns>,
        tries: usize,
    ) -> bool {
        let mut proposed = proposed;
        for attempt in 0..tries {
            let Some(step) = proposed else { return false };
            let turn = step.fixed_rows::<3>(0).amax().max(step.fixed_rows::<3>(6).amax());
            let step = if turn > LARGEST_TURN { step * (LARGEST_TURN / turn) } else { step };
            let shares = if attempt == 0 && !self.newton { self.mixing.shares(normal, &step) } else { None };
            if attempt > 0 {
                self.mixing.clear();
            }
            let mut now = self.mixing.spare(step);
            now.moves.extend((0..self.now.positions.len()).map(|frame| linear.advance(frame, &step)));
            if let Some(shares) = shares {
                self.mixing.mix(&mut now, &shares);
                if self.take(problem, &now) {
                    self.mixing.keep(now);
                    return true;
                }
            }
            now.alone();
            if self.take(problem, &now) {
                self.damping = (self.damping / 5.0).max(LEAST_DAMPING);
                self.mixing.keep(now);
                return true;
            }
            self.damping = (self.damping * 10.0).min(1e6);
            proposed = if self.creeps { Some(step * SHORTER) } else { solve(normal, gradient, self.damping) };
        }
        false
    }

    /// Takes a step if that lowers the cost.
    fn take(&mut self, problem: &Problem<'_>, step: &Step) -> bool {
        let placement = Placement {
            joint: self.placement.joint * twist::exp(&step.taken.fixed_rows::<6>(0).into_owned()),
            home: self.placement.home * twist::exp(&step.taken.fixed_rows::<6>(6).into_owned()),
            constants: self.placement.constants + step.taken.fixed_rows::<2>(12),
        };
        for (next, (q, moved)) in self.next.positions.iter_mut().zip(self.now.positions.iter().zip(&step.moved)) {
            *next = problem.mechanism.advance(q, moved);
        }
        let cost = self.next.follow(problem, &placement);
        if cost > self.cost || cost.is_nan() {
            return false;
        }
        let gain = self.cost - cost;
        self.stalled = if gain < CONVERGED * (1.0 + cost) { self.stalled + 1 } else { 0 };
        (self.gain, self.creeps) = (gain, self.newton && gain > CREEPING * self.gain);
        self.placement = placement;
        std::mem::swap(&mut self.now, &mut self.next);
        self.cost = cost;
        true
    }

    fn fitted(&self, problem: &Problem<'_>, linear: &mut Linearisation) -> Fitted {
        let (normal, ..) = self.linearise(problem, linear, false);
        let covariance = solve_all(&normal);
        let position_noise = (0..problem.poses.len())
            .map(|frame| {
                let inverse = linear.triangle(frame).try_inverse().unwrap_or_else(Matrix3::identity);
                inverse * inverse.transpose()
            })
            .collect();
        Fitted {
            placement: self.placement,
            positions: self.now.positions.clone(),
            residuals: self.now.residuals.clone(),
            chi_squared: self.cost,
            joint_covariance: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
            constant_variance: covariance[(12, 12)],
            position_noise,
        }
    }
}

impl Trial {
    /// Residual of every frame where a placement puts it; gives the weighted sum of their squares.
    fn follow(&mut self, problem: &Problem<'_>, placement: &Placement) -> f64 {
        let (back, away) = (placement.home.inverse() * placement.joint, placement.joint.inverse());
        let mut sum = 0.0;
        for (frame, (pose, white)) in problem.poses.iter().zip(&*problem.whitening).enumerate() {
            let inverse = problem.mechanism.pose(&self.positions[frame], &placement.constants).inverse();
            let residual = twist::log(&(back * inverse * (away * pose)));
            sum += (white * residual).norm_squared();
            (self.inverses[frame], self.residuals[frame]) = (inverse, residual);
        }
        sum
    }
}

/// What the cost would fall by with a step, were all residuals linear.
fn promised(linear: &Linearisation, step: Option<&Unknowns>, gradient: &Unknowns) -> f64 {
    linear.promised_by_positions() + step.map_or(f64::INFINITY, |step| step.dot(gradient))
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
pub(super) fn solve_all(normal: &Normal) -> Normal {
    damped(normal, LEAST_DAMPING).cholesky().map_or_else(|| Normal::identity() * 1e12, |factor| factor.inverse())
}
