//! Single frames in which a body is somewhere else altogether.

use nalgebra::Vector3;

/// Frames below which nothing can be told.
const FEW: usize = 6;
/// Departure from the neighbours' midpoint, in distances of the neighbours from each other, in standard deviations of a
/// coordinate, and in medians of all departures, that only a leap makes.
const IN_STEPS: f64 = 5.0;
const IN_NOISE: f64 = 8.0;
const IN_MEDIANS: f64 = 9.0;
/// Largest share of the frames that can be leaps; with more, nobody knows which.
const MOST: f64 = 0.2;

/// The frames in which a place leaps away and is back in the next: no motion does, a tracker that lost the body for one
/// frame does. At the ends, where the nearest frames lead to counts.
///
/// `places` and `noise`, of a coordinate, are in metres.
pub fn leaps(places: &[Vector3<f64>], noise: f64) -> Vec<bool> {
    let count = places.len();
    if count < FEW {
        return vec![false; count];
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
    let usual = *sizes.select_nth_unstable_by(count / 2, f64::total_cmp).1;
    let limit = IN_NOISE * noise + IN_MEDIANS * usual;
    let leaps: Vec<bool> = departures.into_iter().map(|(size, step)| size > limit + IN_STEPS * step).collect();
    let share = leaps.iter().filter(|leap| **leap).count() as f64 / count as f64;
    if share <= MOST { leaps } else { vec![false; count] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(count: usize) -> Vec<Vector3<f64>> {
        (0..count).map(|t| Vector3::new(0.01 * t as f64, 0.001 * (3.0 * t as f64).sin(), 0.0)).collect()
    }

    #[test]
    fn a_leap_is_found_wherever_it_is_and_nothing_else() {
        assert!(!leaps(&line(30), 0.001).contains(&true));
        for at in [0, 1, 13, 28, 29] {
            for far in [0.5, 1e6] {
                let mut places = line(30);
                places[at].z += far;
                let found: Vec<usize> = (0..30).filter(|t| leaps(&places, 0.001)[*t]).collect();
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
            assert!(!leaps(&places, 1e-4).contains(&true));
        }
    }
}
