//! The shifted Q-function by which the thesis turns measures into scores.

/// `Q(x, μ, λ) = ½ (1 - erf((x - μ) λ / √2))`: 1 far below `mean`, 0 far above, in between as `steepness` says.
///
/// # References
/// Thesis equations (16)-(18), with the standard error function: the factor `1/√(2π)` printed in (17) would keep the
/// scores within [0.32, 0.68], against the thesis's own tables.
pub fn q_function(x: f64, mean: f64, steepness: f64) -> f64 {
    0.5 * libm::erfc((x - mean) * steepness / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_lines_score_phi_of_2_8() {
        // Equation (19) at a mean length of 1: 1 - Q(1, 0.93, 40) = Φ(0.07 · 40) = Φ(2.8).
        assert!((1.0 - q_function(1.0, 0.93, 40.0) - 0.997_444_869_669_572).abs() < 1e-15);
        assert!((1.0 - q_function(0.93, 0.93, 40.0) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn twenty_degrees_are_half_an_angle() {
        // Equation (42): Φ((24 - 20) · 0.5) = Φ(2).
        assert!((1.0 - q_function(20.0, 20.0, 0.5) - 0.5).abs() < 1e-15);
        assert!((1.0 - q_function(24.0, 20.0, 0.5) - 0.977_249_868_051_820_8).abs() < 1e-15);
    }
}
