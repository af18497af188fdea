//! Steps that learn from those before them.
//!
//! Where residuals are large their bends, which normal equations leave out, shorten or reverse every step by much the same
//! factors, and a fit would creep. Mixing a step with those before it such that what is left is least ends that.
//!
//! # References
//! D. G. Anderson, J. ACM 12 (1965); H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011).

use nalgebra::{Matrix3, Vector3};

use super::engine::{Normal, Unknowns};

/// Steps that are remembered.
const MEMORY: usize = 3;

/// A step: what the normal equations proposed, and what was taken.
#[derive(Default)]
pub(super) struct Step {
    pub(super) proposed: Unknowns,
    pub(super) taken: Unknowns,
    /// The same of every frame's positions.
    pub(super) moves: Vec<Vector3<f64>>,
    pub(super) moved: Vec<Vector3<f64>>,
}

impl Step {
    /// Takes what was proposed.
    pub(super) fn alone(&mut self) {
        self.taken = self.proposed;
        self.moved.clone_from(&self.moves);
    }
}

/// The last steps of a fit, the latest at the end.
#[derive(Default)]
pub(super) struct Mixing {
    steps: Vec<Step>,
    unused: Vec<Step>,
}

impl Mixing {
    pub(super) fn clear(&mut self) {
        self.unused.append(&mut self.steps);
    }

    /// A step to fill in, without what its positions do.
    pub(super) fn spare(&mut self, proposed: Unknowns) -> Step {
        let mut step = self.unused.pop().unwrap_or_default();
        step.moves.clear();
        step.proposed = proposed;
        step
    }

    pub(super) fn keep(&mut self, step: Step) {
        if self.steps.len() == MEMORY {
            let oldest = self.steps.remove(0);
            self.unused.push(oldest);
        }
        self.steps.push(step);
    }

    /// How much of each difference of successive steps, the latest last, to take off a step that is proposed now.
    pub(super) fn shares(&self, normal: &Normal, proposed: &Unknowns) -> Option<Vector3<f64>> {
        /// Share of the largest difference's square below which others tell nothing.
        const RIDGE: f64 = 1e-8;
        let (steps, count) = (&self.steps, self.steps.len());
        if count < 2 {
            return None;
        }
        let mut changes = [Unknowns::zeros(); MEMORY];
        for (k, change) in changes[..count].iter_mut().enumerate() {
            *change = steps.get(k + 1).map_or(proposed, |next| &next.proposed) - steps[k].proposed;
        }
        let (mut square, mut right) = (Matrix3::identity(), Vector3::zeros());
        for a in 0..count {
            let weighed = normal * changes[a];
            right[a] = weighed.dot(proposed);
            for b in 0..count {
                square[(a, b)] = weighed.dot(&changes[b]);
            }
        }
        let ridge = RIDGE * (0..count).map(|k| square[(k, k)]).fold(0.0, f64::max) + f64::MIN_POSITIVE;
        (0..count).for_each(|k| square[(k, k)] += ridge);
        let shares = square.cholesky()?.solve(&right);
        shares.iter().all(|share| share.is_finite()).then_some(shares)
    }

    /// Takes so much of the differences off a step.
    pub(super) fn mix(&self, now: &mut Step, shares: &Vector3<f64>) {
        now.alone();
        for (k, step) in self.steps.iter().enumerate() {
            let (share, next) = (shares[k], self.steps.get(k + 1));
            now.taken -= (next.map_or(now.proposed, |next| next.proposed) - step.proposed + step.taken) * share;
            let after = next.map_or(&now.moves, |next| &next.moves);
            for (frame, moved) in now.moved.iter_mut().enumerate() {
                *moved -= (after[frame] - step.moves[frame] + step.moved[frame]) * share;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that close a tenth of one gap, and overshoot another by eight tenths, end at once where they are mixed; a
    /// position follows the first gap.
    #[test]
    fn what_shortens_or_reverses_steps_is_told_by_three_of_them() {
        let factors = [0.9, -0.8, 0.3];
        let (mut gaps, mut position, mut mixing) = ([1.0, 1.0, 1.0], 2.0, Mixing::default());
        for _ in 0..=MEMORY {
            let mut proposed = Unknowns::zeros();
            (0..3).for_each(|k| proposed[k] = (factors[k] - 1.0) * gaps[k]);
            let mut step = mixing.spare(proposed);
            step.moves.push(Vector3::new(2.0 * proposed[0], 0.0, 0.0));
            match mixing.shares(&Normal::identity(), &proposed).filter(|_| mixing.steps.len() == MEMORY) {
                Some(shares) => mixing.mix(&mut step, &shares),
                None => step.alone(),
            }
            (0..3).for_each(|k| gaps[k] += step.taken[k]);
            position += step.moved[0].x;
            mixing.keep(step);
        }
        // Alone, four steps leave two thirds of the slowest gap; of mixed ones the ridge leaves a thousandth.
        assert!(gaps.iter().all(|gap: &f64| gap.abs() < 1e-3) && position.abs() < 2e-3, "{gaps:?} {position}");
    }
}
