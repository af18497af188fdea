//! Positions of a body's features over frames.

use nalgebra::{Point3, Vector3};

use crate::{MotionError, evenly, quantile};

/// Largest coordinate, in metres, whose squares and fourth powers stay finite sums over any recording.
const LARGEST_COORDINATE: f64 = 1e60;

/// Positions of features over frames, in metres, in the coordinates of the recording.
///
/// # Convention
/// Shape (frames, features, 3), frame-major and contiguous, as numpy's `(T, F, 3)` in C order. Each sample has a
/// visibility bit; the position of a missing sample is the origin, so that masked sums need no branch.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    features: usize,
    positions: Vec<Point3<f64>>,
    visible: Vec<u64>,
    words: usize,
    magnitude: f64,
}

/// Tracks, and the factor by which all positions in them are to be multiplied.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeenAtScale<'a> {
    pub(crate) tracks: &'a Tracks,
    pub(crate) factor: f64,
}

impl Tracks {
    /// Takes frame-major positions; a sample with any NaN coordinate is missing.
    ///
    /// # Errors
    /// [`MotionError::NotRectangular`] if `positions` does not fill whole frames.
    pub fn new(features: usize, mut positions: Vec<Point3<f64>>) -> Result<Self, MotionError> {
        let frames = positions.len().checked_div(features).unwrap_or(0);
        if frames * features != positions.len() {
            return Err(MotionError::NotRectangular { features, found: positions.len() });
        }
        let words = features.div_ceil(64);
        let mut visible = vec![0; words * frames];
        let mut magnitude = 0.0_f64;
        if features > 0 {
            for (row, bits) in positions.chunks_exact_mut(features).zip(visible.chunks_exact_mut(words)) {
                magnitude = magnitude.max(see(row, bits));
            }
        }
        Ok(Self { features, positions, visible, words, magnitude })
    }

    /// Adds a frame.
    pub(crate) fn push(&mut self, frame: &[Point3<f64>]) {
        let (positions, words) = (self.positions.len(), self.visible.len());
        self.positions.extend_from_slice(frame);
        self.visible.resize(words + self.words, 0);
        let (row, bits) = (&mut self.positions[positions..], &mut self.visible[words..]);
        self.magnitude = self.magnitude.max(see(row, bits));
    }

    /// All positions multiplied by a positive factor.
    #[must_use]
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let positions = self.positions.iter().map(|position| position * factor).collect();
        Self { positions, visible: self.visible.clone(), magnitude: factor * self.magnitude, ..*self }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.positions.len().checked_div(self.features).unwrap_or(0)
    }

    /// Number of features.
    pub fn features(&self) -> usize {
        self.features
    }

    /// The largest coordinate of any observed sample, by its size, metres.
    pub fn magnitude(&self) -> f64 {
        self.magnitude
    }

    /// All positions of one frame, in metres, one per feature; missing ones are at the origin.
    pub fn frame(&self, frame: usize) -> &[Point3<f64>] {
        &self.positions[frame * self.features..(frame + 1) * self.features]
    }

    /// Whether a sample was observed.
    pub fn is_visible(&self, frame: usize, feature: usize) -> bool {
        self.visible[frame * self.words + feature / 64] >> (feature % 64) & 1 == 1
    }

    /// The visibility bits of one frame: feature `f` is bit `f % 64` of word `f / 64`.
    pub fn visibility(&self, frame: usize) -> &[u64] {
        &self.visible[frame * self.words..(frame + 1) * self.words]
    }

    /// The position of a sample in metres, if it was observed.
    pub fn get(&self, frame: usize, feature: usize) -> Option<&Point3<f64>> {
        self.is_visible(frame, feature).then(|| &self.positions[frame * self.features + feature])
    }

    /// The observed samples of one frame, as (feature, position in metres).
    pub fn seen(&self, frame: usize) -> impl Iterator<Item = (usize, &Point3<f64>)> + Clone {
        self.frame(frame).iter().enumerate().filter(move |(feature, _)| self.is_visible(frame, *feature))
    }

    /// Number of features observed in a frame.
    pub fn seen_count(&self, frame: usize) -> usize {
        self.visibility(frame).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether a frame repeats the one before it exactly: the same features seen at the same places.
    pub fn repeats_previous(&self, frame: usize) -> bool {
        frame > 0 && self.visibility(frame) == self.visibility(frame - 1) && self.frame(frame) == self.frame(frame - 1)
    }

    /// Whether every feature is always seen at exactly the same place.
    pub fn rest(&self) -> bool {
        let mut places = vec![None; self.features];
        (0..self.frames()).all(|frame| self.seen(frame).all(|(feature, p)| places[feature].get_or_insert(p) == &p))
    }

    /// Whether the features stay in their places but for noise, metres per coordinate: not more than half of them leave
    /// it.
    pub fn rest_but_for(&self, noise: f64) -> bool {
        /// Frames and features that are looked at, evenly: enough for the range of a coordinate, and for most features.
        const FRAMES: usize = 64;
        const FEATURES: usize = 15;
        let frames = evenly(self.frames(), FRAMES);
        let way = |feature| frames.iter().filter_map(|&t| Some(self.get(t, feature)?.coords)).collect();
        let features: Vec<usize> =
            (0..self.features()).filter(|&f| frames.iter().any(|&t| self.is_visible(t, f))).collect();
        let features: Vec<usize> = evenly(features.len(), FEATURES).into_iter().map(|k| features[k]).collect();
        // Once more than half move, others need not be looked at.
        let half = features.len() / 2;
        let ways = features.into_iter().map(way);
        ways.filter(|way: &Vec<Vector3<f64>>| !stay_but_for(way, noise)).take(half + 1).count() <= half
    }

    /// The first sample with a coordinate that is infinite or beyond measure, as (frame, feature, coordinate).
    pub(crate) fn first_unusable(&self) -> Option<(usize, usize, f64)> {
        let (index, value) = unusable(&self.positions)?;
        Some((index / self.features, index % self.features, value))
    }
}

/// The first position with a coordinate that is infinite or beyond measure, by its index, and that coordinate.
pub(crate) fn unusable(positions: &[Point3<f64>]) -> Option<(usize, f64)> {
    let unusable = |c: &f64| c.abs() > LARGEST_COORDINATE;
    positions.iter().enumerate().find_map(|(index, p)| Some((index, p.iter().copied().find(unusable)?)))
}

/// Marks which samples of a frame are seen, puts the others at the origin, and gives the largest coordinate.
fn see(row: &mut [Point3<f64>], bits: &mut [u64]) -> f64 {
    let mut magnitude = 0.0_f64;
    for (feature, point) in row.iter_mut().enumerate() {
        if point.iter().any(|c| c.is_nan()) {
            *point = Point3::origin();
        } else {
            bits[feature / 64] |= 1 << (feature % 64);
            magnitude = magnitude.max(point.coords.amax());
        }
    }
    magnitude
}

/// Whether places are one place but for noise, metres per coordinate.
pub fn stay_but_for(places: &[Vector3<f64>], noise: f64) -> bool {
    /// Range of noise from 2 to 98 %, and what is allowed, in standard deviations.
    const ALLOWED: f64 = 1.5 * 4.1;
    let range = |mut values: Vec<f64>| quantile(&mut values, 0.98) - quantile(&mut values, 0.02);
    (0..3).all(|axis| range(places.iter().map(|place| place[axis]).collect()) <= ALLOWED * noise)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_coordinate_makes_the_sample_missing() {
        let tracks = Tracks::new(
            2,
            vec![Point3::new(1., 2., 3.), Point3::new(0., f64::NAN, 0.), Point3::origin(), Point3::origin()],
        )
        .expect("two frames of two features");
        assert_eq!(tracks.frames(), 2);
        assert_eq!(tracks.get(0, 0), Some(&Point3::new(1., 2., 3.)));
        assert_eq!(tracks.get(0, 1), None);
        assert_eq!(tracks.seen_count(0), 1);
        assert_eq!(tracks.seen_count(1), 2);
        assert!(!tracks.repeats_previous(1));
    }

    #[test]
    fn positions_that_do_not_fill_frames_are_refused() {
        assert_eq!(
            Tracks::new(2, vec![Point3::origin(); 3]),
            Err(MotionError::NotRectangular { features: 2, found: 3 })
        );
        assert!(Tracks::new(0, vec![Point3::origin()]).is_err());
        assert_eq!(Tracks::new(0, vec![]).expect("nothing").frames(), 0);
    }

    #[test]
    fn visibility_reaches_beyond_one_word() {
        let mut row = vec![Point3::origin(); 130];
        row[129].x = f64::NAN;
        let tracks = Tracks::new(130, row).expect("one frame");
        assert!(tracks.is_visible(0, 128) && !tracks.is_visible(0, 129));
        assert_eq!(tracks.seen_count(0), 129);
    }
}
