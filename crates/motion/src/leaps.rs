//! Single frames in which a body is somewhere else altogether.

use nalgebra::Vector3;

use crate::quantile;

/// Frames below which nothing can be told.
const FEW: usize = 6;
/// Departure from the neighbours' midpoint, in distances of the neighbours from each other and in what a fifth of all
/// departures stays below, that only a leap makes. A leap spoils three departures, so that of many the median tells
/// nothing.
const IN_STEPS: f64 = 5.0;
const IN_QUIET: f64 = 14.0;
const QUIET: f64 = 0.2;
/// Largest share of the frames that can be leaps; with more, nobody knows which.
const MOST: f64 = 0.2;

/// Frames in which a place leaps away.
#[derive(Debug, Clone, PartialEq)]
pub struct Leaps {
    /// Whether a frame is one; none is, where there are too many to tell which.
    pub frames: Vec<bool>,
    /// Their share, also where it is too large.
    pub share: f64,
}

/// The frames in which a place leaps away and is back in the next: no motion does, a tracker that lost the body for one
/// frame does. At the ends, where the nearest frames lead to counts.
///
/// `places` and the least departure that matters are in metres.
pub fn leaps(places: &[Vector3<f64>], least: f64) -> Leaps {
    let count = places.len();
    if count < FEW {
        return Leaps { frames: vec![false; count], share: 0.0 };
    }
    let departure = |at: usize| {
        let beyond = |a: usize, b: usize, c: usize| {
            let step = (places[a] - places[b]).norm() + (places[b] - places[c]).norm();
            ((places[at] - (places[a] * 2.0 - places[b])).norm(), step)
        };
        match at {
            0 => beyond(1, 2, 3),
            _ if at + 1 == count => beyond(at - 1, at - 2, at - 3),
            _ => {
                let (before, after) = (places[at - 1], places[at + 1]);
                ((places[at] - (before + after) / 2.0).norm(), (after - before).norm())
            }
        }
    };
    let departures: Vec<(f64, f64)> = (0..count).map(departure).collect();
    let mut sizes: Vec<f64> = departures.iter().map(|(size, _)| *size).collect();
    let quiet = quantile(&mut sizes, QUIET);
    let limit = IN_QUIET * quiet.max(least);
    let frames: Vec<bool> = departures.into_iter().map(|(size, step)| size > limit + IN_STEPS * step).collect();
    let share = frames.iter().filter(|leap| **leap).count() as f64 / count as f64;
    Leaps { frames: if share <= MOST { frames } else { vec![false; count] }, share }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(count: usize) -> Vec<Vector3<f64>> {
        (0..count).map(|t| Vector3::new(0.01 * t as f64, 0.001 * (3.0 * t as f64).sin(), 0.0)).collect()
    }

    #[test]
    fn a_leap_is_found_wherever_it_is_and_nothing_else() {
        assert!(!leaps(&line(30), 1e-4).frames.contains(&true));
        for at in [0, 1, 13, 28, 29] {
            for far in [0.5, 1e6] {
                let mut places = line(30);
                places[at].z += far;
                let found: Vec<usize> = (0..30).filter(|t| leaps(&places, 1e-4).frames[*t]).collect();
                assert_eq!(found, [at], "{far} m");
            }
        }
    }

    #[test]
    fn a_step_a_start_and_a_stop_are_motion() {
        let moves = [
            |t: usize| f64::from(u8::from(t >= 15)),
            |t: usize| 0.1 * t.saturating_sub(20) as f64,
            |t: usize| 0.1 * t.min(3) as f64,
            |t: usize| if (10..12).contains(&t) { 1.0 } else { 0.0 },
        ];
        for motion in moves {
            let places: Vec<Vector3<f64>> = (0..30).map(|t| Vector3::new(motion(t), 0.0, 0.0)).collect();
            assert!(!leaps(&places, 1e-4).frames.contains(&true));
        }
    }
}
