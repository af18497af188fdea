//! The price of a joint's positions: they are not parameters, but draws from a distribution that is itself fitted.

use nalgebra::{SMatrix, SVector};

/// Rounds of expectation maximisation.
const ROUNDS: usize = 20;
/// Least variance of a position, in variances of its noise.
const LEAST: f64 = 1e-10;

/// Cost of positions `q_t` of `D` freedoms, measured with covariances `N_t`, in units of -2 log likelihood:
/// `Σ ln det(S + N_t) - ln det N_t + (q_t - μ)ᵀ (S + N_t)⁻¹ (q_t - μ)`.
///
/// `μ` is their mean, `S` is found by expectation maximisation. A degree of freedom that is not there so costs its
/// parameters, not one parameter per frame. Positions are in metres or radians, one per pose of a
/// [`PoseSeries`](jointscope_motion::PoseSeries).
///
/// # References
/// docs/method.md, equation (11).
pub fn cost<const D: usize>(positions: &[SVector<f64, D>], noise: &[SMatrix<f64, D, D>]) -> f64 {
    let count = positions.len() as f64;
    if positions.is_empty() || D == 0 {
        return 0.0;
    }
    let mean = positions.iter().sum::<SVector<f64, D>>() / count;
    let mean_noise = noise.iter().sum::<SMatrix<f64, D, D>>() / count;
    // In units of the mean noise, all coordinates are alike.
    let Some(factor) = mean_noise.cholesky() else { return 0.0 };
    let white = |x: &SVector<f64, D>| {
        let mut x = *x;
        factor.l().solve_lower_triangular_mut(&mut x);
        x
    };
    let departures: Vec<SVector<f64, D>> = positions.iter().map(|q| white(&(q - mean))).collect();
    let inverse_root = factor.l().try_inverse().unwrap_or_else(SMatrix::identity);
    let noise: Vec<SMatrix<f64, D, D>> =
        noise.iter().map(|noise| inverse_root * noise * inverse_root.transpose()).collect();
    let scatter = departures.iter().map(|d| d * d.transpose()).sum::<SMatrix<f64, D, D>>() / count;
    // From above: a spread that starts too small grows only slowly.
    let mut spread = scatter + SMatrix::identity() * LEAST;
    for _ in 0..ROUNDS {
        let mut next = SMatrix::<f64, D, D>::zeros();
        for (departure, noise) in departures.iter().zip(&noise) {
            // With `S + N = L Lᵀ`: what is expected is `S (S + N)⁻¹ d`, and `S - S (S + N)⁻¹ S` is not known of it.
            let Some(total) = (spread + noise).cholesky() else { continue };
            let (mut carried, mut white) = (spread, *departure);
            total.l_dirty().solve_lower_triangular_mut(&mut carried);
            total.l_dirty().solve_lower_triangular_mut(&mut white);
            let expected = carried.tr_mul(&white);
            next += expected * expected.transpose() + spread - carried.tr_mul(&carried);
        }
        next = (next + next.transpose()) / (2.0 * count);
        let change = (next - spread).norm();
        let size = spread.norm();
        spread = next;
        if change < 1e-4 * size {
            break;
        }
    }
    let mut sum = 0.0;
    for (departure, noise) in departures.iter().zip(&noise) {
        let (Some(total), Some(alone)) = ((spread + noise).cholesky(), noise.cholesky()) else { continue };
        sum += ln_determinant(&total.l()) - ln_determinant(&alone.l()) + departure.dot(&total.solve(departure));
    }
    sum
}

fn ln_determinant<const D: usize>(triangle: &SMatrix<f64, D, D>) -> f64 {
    2.0 * triangle.diagonal().iter().map(|x| x.ln()).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix1, Matrix2, Vector1, Vector2};

    #[test]
    fn positions_that_are_only_noise_cost_little_and_moving_ones_a_logarithm_per_frame() {
        // Alternating +1, -1 in units of the noise: spread 0, every frame costs its square.
        let still: Vec<_> = (0..200).map(|t| Vector1::new(if t % 2 == 0 { 1.0 } else { -1.0 })).collect();
        let noise = vec![Matrix1::new(1.0); 200];
        // From above the spread falls to 0 slowly: a fortieth of the cost is left after the rounds there are.
        assert!((cost(&still, &noise) - 200.0).abs() < 5.0, "{}", cost(&still, &noise));
        // Ten times as much: S = 99, so ln 100 + 1 per frame.
        let moving: Vec<_> = still.iter().map(|q| q * 10.0).collect();
        assert!((cost(&moving, &noise) / 200.0 - (100_f64.ln() + 1.0)).abs() < 1e-3);
    }

    #[test]
    fn the_cost_does_not_depend_on_units() {
        let q: Vec<_> = (0..50).map(|t| Vector2::new(f64::from(t).sin() * 2.0, f64::from(t) * 0.01)).collect();
        let noise = vec![Matrix2::new(0.01, 0.002, 0.002, 0.03); 50];
        let scale = Matrix2::new(1000.0, 0.0, 0.0, 0.1);
        let scaled: Vec<_> = q.iter().map(|q| scale * q).collect();
        let scaled_noise: Vec<_> = noise.iter().map(|n| scale * n * scale).collect();
        assert!((cost(&q, &noise) - cost(&scaled, &scaled_noise)).abs() < 1e-6);
    }
}
