//! Joint positions over time: one number per frame, 0 at frame 0.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Sines that make up a smooth random motion.
const SINES: usize = 4;
/// Largest correlation between two coordinates of one random motion. Beyond it they begin to look like one freedom: a
/// cylindrical joint whose slide follows its angle *is* a screw.
const LARGEST_CORRELATION: f64 = 0.7;

/// Share of the recording that has passed at each frame: 0 at the first, 1 at the last.
fn shares(frames: usize) -> impl Iterator<Item = f64> {
    let last = frames.saturating_sub(1).max(1) as f64;
    (0..frames).map(move |frame| frame as f64 / last)
}

/// From 0 to `to` at uniform speed.
pub fn ramp(frames: usize, to: f64) -> Vec<f64> {
    shares(frames).map(|share| share * to).collect()
}

/// From 0 to `to` from rest to rest without jerks, between two shares of the recording.
pub fn stroke(frames: usize, to: f64, begin: f64, end: f64) -> Vec<f64> {
    let eased = |share: f64| {
        let s = ((share - begin) / (end - begin)).clamp(0.0, 1.0);
        s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    };
    shares(frames).map(|share| to * eased(share)).collect()
}

/// Back and forth between ± `amplitude`, so many full cycles.
pub fn swing(frames: usize, amplitude: f64, cycles: f64) -> Vec<f64> {
    shares(frames).map(|share| amplitude * (TAU * cycles * share).sin()).collect()
}

/// Sum of sines of random phase and of 0.3 to 2 cycles per `period` frames, each of at most `amplitude / 4`.
pub fn waves(frames: usize, amplitude: f64, period: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut sines = || {
        let speed = rng.random_range(0.3..2.0) * TAU / period;
        (rng.random_range(-1.0..1.0) * amplitude / SINES as f64, speed, rng.random_range(0.0..TAU))
    };
    let sines: [(f64, f64, f64); SINES] = std::array::from_fn(|_| sines());
    let at = |frame: f64| sines.iter().map(|(a, speed, phase)| a * ((speed * frame + phase).sin() - phase.sin())).sum();
    (0..frames).map(|frame| at(frame as f64)).collect()
}

/// Smooth random motions, one per span, each spanning its span exactly (largest minus smallest position over the
/// frames), and no two of them alike.
pub fn wander(frames: usize, spans: &[f64], rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut motions: Vec<Vec<f64>> = Vec::new();
    for &span in spans {
        let mut motion = spanning(&waves(frames, 1.0, frames as f64, rng), span);
        // Few frames cannot differ in shape; a bounded number of draws ends in any case.
        for _ in 0..50 {
            if motions.iter().all(|other| correlation(other, &motion).abs() <= LARGEST_CORRELATION) {
                break;
            }
            motion = spanning(&waves(frames, 1.0, frames as f64, rng), span);
        }
        motions.push(motion);
    }
    motions
}

/// Smooth random motions about 0, one per standard deviation, each with its standard deviation over the frames exactly.
pub fn waver(frames: usize, deviations: &[f64], rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut motions = wander(frames, &vec![1.0; deviations.len()], rng);
    for (motion, deviation) in motions.iter_mut().zip(deviations) {
        let mean = motion.iter().sum::<f64>() / frames as f64;
        let square = motion.iter().map(|q| (q - mean) * (q - mean)).sum::<f64>() / frames as f64;
        for q in motion {
            *q = (*q - mean) * (deviation / square.sqrt());
        }
    }
    motions
}

/// A path driven over a floor from rest to rest: heading, forward and leftward position as a planar joint has them,
/// with x ahead at the start. The heading swings between ± `bend` radians in so many cycles.
pub fn drive(frames: usize, length: f64, bend: f64, cycles: f64) -> Vec<Vec<f64>> {
    /// Pieces of the path: the integration error stays far below a micrometre.
    const PIECES: usize = 20_000;
    let heading = |share: f64| bend * (TAU * cycles * share).sin();
    let mut way = vec![(0.0, 0.0)];
    let (mut x, mut y) = (0.0, 0.0);
    for piece in 0..PIECES {
        let (sin, cos) = heading((piece as f64 + 0.5) / PIECES as f64).sin_cos();
        x += cos * length / PIECES as f64;
        y += sin * length / PIECES as f64;
        way.push((x, y));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the pieces")]
    let place = |share: f64| {
        let piece = ((share * PIECES as f64) as usize).min(PIECES - 1);
        let rest = share * PIECES as f64 - piece as f64;
        let ((x, y), (next_x, next_y)) = (way[piece], way[piece + 1]);
        (x + rest * (next_x - x), y + rest * (next_y - y))
    };
    let shares = stroke(frames, 1.0, 0.0, 1.0);
    let each = |coordinate: &dyn Fn(f64) -> f64| shares.iter().map(|&share| coordinate(share)).collect();
    vec![each(&heading), each(&|share| place(share).0), each(&|share| place(share).1)]
}

/// The same motion, counted from frame 0 and stretched to span `span` exactly.
fn spanning(motion: &[f64], span: f64) -> Vec<f64> {
    let [least, most] = extremes(motion);
    if most - least < 1e-9 {
        return ramp(motion.len(), span);
    }
    motion.iter().map(|q| (q - motion[0]) * (span / (most - least))).collect()
}

/// The least and the largest number of a series.
pub(crate) fn extremes(series: &[f64]) -> [f64; 2] {
    let least = series.iter().copied().fold(f64::INFINITY, f64::min);
    [least, series.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum::<f64>();
    let spread = (product(&|a, _| a * a) * product(&|_, b| b * b)).sqrt();
    if spread > 0.0 { product(&|a, b| a * b) / spread } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    fn range(series: &[f64]) -> f64 {
        let [least, most] = extremes(series);
        most - least
    }

    #[test]
    fn random_motions_span_exactly_what_is_asked_and_differ() {
        for seed in 0..50 {
            let motions = wander(50, &[0.3, 0.2, 0.7], &mut ChaCha8Rng::seed_from_u64(seed));
            for (motion, span) in motions.iter().zip([0.3, 0.2, 0.7]) {
                assert!(motion[0] == 0.0 && (range(motion) - span).abs() < 1e-12);
            }
            assert!(correlation(&motions[0], &motions[1]).abs() <= LARGEST_CORRELATION);
            assert!(correlation(&motions[1], &motions[2]).abs() <= LARGEST_CORRELATION);
        }
    }

    #[test]
    fn two_frames_span_what_is_asked_too() {
        let motions = wander(2, &[0.3, 0.2], &mut ChaCha8Rng::seed_from_u64(1));
        assert!((range(&motions[0]) - 0.3).abs() < 1e-12 && (range(&motions[1]) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn wavering_is_about_0_with_the_standard_deviation_that_is_asked() {
        for frames in [2, 50] {
            for motion in waver(frames, &[0.3, 0.02], &mut ChaCha8Rng::seed_from_u64(4)).iter().zip([0.3, 0.02]) {
                let mean = motion.0.iter().sum::<f64>() / frames as f64;
                let deviation = (motion.0.iter().map(|q| q * q).sum::<f64>() / frames as f64).sqrt();
                assert!(mean.abs() < 1e-14 && (deviation / motion.1 - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn strokes_begin_and_end_at_rest() {
        let motion = stroke(101, 2.0, 0.1, 0.9);
        assert!(motion[..=10].iter().all(|q| *q == 0.0) && motion[91..].iter().all(|q| (q - 2.0).abs() < 1e-12));
        assert!(motion.windows(2).all(|pair| pair[0] <= pair[1]));
        assert!((motion[50] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_driven_path_has_its_length_and_follows_its_heading() {
        let path = drive(2001, 0.5, 0.7, 1.0);
        let mut length = 0.0;
        for frame in 1..2001 {
            let (dx, dy) = (path[1][frame] - path[1][frame - 1], path[2][frame] - path[2][frame - 1]);
            length += dx.hypot(dy);
            if dx.hypot(dy) > 1e-4 {
                let heading = f64::midpoint(path[0][frame], path[0][frame - 1]);
                assert!((dy.atan2(dx) - heading).abs() < 1e-3);
            }
        }
        assert!((length - 0.5).abs() < 1e-6, "{length}");
        assert!((range(&path[0]) - 1.4).abs() < 1e-3);
    }
}
