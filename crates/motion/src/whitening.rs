//! Roots of the information of uncertain poses, by which their residuals are weighed.

use std::sync::OnceLock;

use nalgebra::Matrix6;

use crate::PoseSeries;

/// Roots of a series that every model asks for, computed once.
#[derive(Debug, Default)]
pub(crate) struct Roots {
    of_noise: OnceLock<Vec<Matrix6<f64>>>,
    with_play: OnceLock<Vec<Matrix6<f64>>>,
}

/// A copy of a series may be given another noise.
impl Clone for Roots {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PoseSeries {
    /// A root of the information of every pose: `Aᵀ A = N⁻¹` with the covariance `N` of its noise, a twist `[ω; v]` in
    /// the moving body's coordinates about its centre; it takes radians and metres to standard deviations. Zero where a
    /// covariance is not positive definite.
    pub fn whitening(&self) -> &[Matrix6<f64>] {
        self.roots.of_noise.get_or_init(|| self.whitening_with([0.0; 2]))
    }

    /// The same of noise and [`usual_play`](Self::usual_play).
    pub fn whitening_with_play(&self) -> &[Matrix6<f64>] {
        self.roots.with_play.get_or_init(|| self.whitening_with(self.usual_play()))
    }

    /// The same of noise and of play of a rotation, radians, and of a position, metres; a standard deviation of each
    /// coordinate.
    pub fn whitening_with(&self, play: [f64; 2]) -> Vec<Matrix6<f64>> {
        let root = |noise: &Matrix6<f64>| {
            let mut covariance = *noise;
            for k in 0..6 {
                covariance[(k, k)] += play[k / 3].powi(2);
            }
            let root = covariance.cholesky().and_then(|factor| factor.l().solve_lower_triangular(&Matrix6::identity()));
            root.unwrap_or_else(Matrix6::zeros)
        };
        self.noise().iter().map(root).collect()
    }

    /// Play of the pair before its joint is known: of a rotation, radians, and of the moving body's position, metres.
    pub fn usual_play(&self) -> [f64; 2] {
        let play = self.play();
        [play.least_turn.to_radians().max(play.turn * self.turn()), self.ends()[0].shift_play]
    }
}
