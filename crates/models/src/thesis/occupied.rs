//! The angle that a trajectory occupies on its circle.

/// Whole degrees that points occupy as seen from the origin: 360 less the longest run of degrees without a point.
pub(super) fn occupied(points: impl Iterator<Item = (f64, f64)>) -> u16 {
    let mut degrees = Degrees::default();
    points.for_each(|(x, y)| degrees.occupy(x, y));
    degrees.occupied()
}

/// The degrees of a circle that points occupy.
#[derive(Clone)]
pub(super) struct Degrees([u8; ROW]);

/// Degrees, filled up to a power of two.
const ROW: usize = 512;

impl Default for Degrees {
    fn default() -> Self {
        Self([0; ROW])
    }
}

impl Degrees {
    /// Takes in a point.
    pub(super) fn occupy(&mut self, x: f64, y: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        self.occupy_degree(y.atan2(x).to_degrees().rem_euclid(360.0) as usize);
    }

    /// Takes in a point at an angle of so many whole degrees, up to 511; rounding may turn a tiny negative angle into 360
    /// exactly, and what is more is none.
    #[inline]
    pub(super) fn occupy_degree(&mut self, degree: usize) {
        self.0[degree & (ROW - 1)] = 1;
    }

    /// 360 less the longest run of degrees without a point.
    pub(super) fn occupied(mut self) -> u16 {
        let (circle, beyond) = self.0.split_at_mut(360);
        circle[359] |= std::mem::take(&mut beyond[0]);
        360 - longest_gap(&self.0)
    }
}

/// The longest run of empty degrees around the circle.
fn longest_gap(occupied: &[u8; ROW]) -> u16 {
    /// Eight degrees all of which are occupied.
    const FULL: u64 = 0x0101_0101_0101_0101;
    let (mut first, mut last, mut longest) = (None, 0, 0);
    for (start, word) in (0..).step_by(8).zip(occupied.as_chunks().0) {
        let mut word = u64::from_le_bytes(*word);
        if word == FULL && first.is_some() {
            longest = longest.max(start - last - 1);
            last = start + 7;
            continue;
        }
        while word != 0 {
            #[expect(clippy::cast_possible_truncation, reason = "a byte of eight")]
            let degree = start + (word.trailing_zeros() / 8) as u16;
            match first {
                None => first = Some(degree),
                Some(_) => longest = longest.max(degree - last - 1),
            }
            last = degree;
            word &= word - 1;
        }
    }
    first.map_or(360, |first| longest.max(first + 359 - last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_occupied_angle_is_what_the_longest_gap_leaves() {
        let mut occupied = [0; ROW];
        assert_eq!(longest_gap(&occupied), 360);
        for degree in 350..380 {
            occupied[degree % 360] = 1;
        }
        assert_eq!(360 - longest_gap(&occupied), 30);
        occupied[200] = 1;
        // Now the largest gap is 20..200, so 180 degrees are occupied.
        assert_eq!(360 - longest_gap(&occupied), 180);
    }
}
