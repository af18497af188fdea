//! The angle that a trajectory occupies on its circle.

/// Whole degrees that points occupy as seen from the origin: 360 less the longest run of degrees without a point.
pub(super) fn occupied(points: impl Iterator<Item = (f64, f64)>) -> u16 {
    let mut degrees = Degrees::default();
    points.for_each(|(x, y)| degrees.occupy(x, y));
    degrees.occupied()
}

/// The degrees of a circle that points occupy.
pub(super) struct Degrees([bool; 360]);

impl Default for Degrees {
    fn default() -> Self {
        Self([false; 360])
    }
}

impl Degrees {
    /// Takes in a point.
    pub(super) fn occupy(&mut self, x: f64, y: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        self.occupy_degree(y.atan2(x).to_degrees().rem_euclid(360.0) as usize);
    }

    /// Takes in a point at an angle of so many whole degrees; rounding may turn a tiny negative angle into 360 exactly.
    pub(super) fn occupy_degree(&mut self, degree: usize) {
        self.0[degree.min(359)] = true;
    }

    /// 360 less the longest run of degrees without a point.
    pub(super) fn occupied(&self) -> u16 {
        360 - longest_gap(&self.0)
    }
}

/// The longest run of empty degrees around the circle.
fn longest_gap(occupied: &[bool; 360]) -> u16 {
    let (mut longest, mut run) = (0, 0);
    for &hit in occupied.iter().chain(occupied) {
        run = if hit { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest.min(360)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_occupied_angle_is_what_the_longest_gap_leaves() {
        let mut occupied = [false; 360];
        assert_eq!(longest_gap(&occupied), 360);
        for degree in 350..380 {
            occupied[degree % 360] = true;
        }
        assert_eq!(360 - longest_gap(&occupied), 30);
        occupied[200] = true;
        // Now the largest gap is 20..200, so 180 degrees are occupied.
        assert_eq!(360 - longest_gap(&occupied), 180);
    }
}
