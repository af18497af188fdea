//! Labelled markers over frames, and the bodies that groups of them make.

use jointscope_motion::{Body, Recording, Tracks};
use nalgebra::Point3;

/// The markers of one body: its name and their labels.
pub(super) type Group = (&'static str, &'static [&'static str]);

/// All markers of a file.
pub(super) struct Markers {
    /// Numbers of the frames.
    pub(super) frames: Vec<u64>,
    /// Their times in seconds.
    pub(super) times: Vec<f64>,
    pub(super) labels: Vec<String>,
    /// Frame by frame, in the order of the labels, metres; NaN where missing.
    pub(super) positions: Vec<Point3<f64>>,
}

impl Markers {
    /// A recording of the bodies that groups of markers make.
    pub(super) fn recording(self, groups: &[Group]) -> Result<Recording, String> {
        let bodies = groups.iter().map(|group| self.body(group)).collect::<Result<_, _>>()?;
        Recording::new(self.frames, Some(self.times), bodies).map_err(|error| error.to_string())
    }

    fn body(&self, (name, labels): &Group) -> Result<Body, String> {
        let find = |label: &&str| {
            self.labels.iter().position(|other| other == label).ok_or_else(|| format!("no marker `{label}`"))
        };
        let columns: Vec<usize> = labels.iter().map(find).collect::<Result<_, _>>()?;
        let frames = self.positions.chunks_exact(self.labels.len());
        let positions = frames.flat_map(|frame| columns.iter().map(|&column| frame[column])).collect();
        let labels = labels.iter().map(ToString::to_string).collect();
        Tracks::new(columns.len(), positions)
            .and_then(|tracks| Body::from_points(*name, labels, tracks))
            .map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    #[test]
    fn a_group_takes_its_markers_in_its_own_order() {
        let markers = || Markers {
            frames: vec![3, 4],
            times: vec![0., 0.1],
            labels: ["a", "b", "c"].map(String::from).into(),
            positions: [0., 1., 2., 10., f64::NAN, 12.].map(|x| Point3::new(x, 0., 0.)).into(),
        };
        let recording = markers().recording(&[("door", &["c", "b"])]).expect("sound");
        let Observation::Points { tracks, .. } = recording.bodies()[0].observation() else { panic!("points") };
        let x = |frame, feature| tracks.get(frame, feature).map(|p| p.x);
        assert_eq!([x(0, 0), x(0, 1), x(1, 0), x(1, 1)], [Some(2.), Some(1.), Some(12.), None]);
        assert_eq!(markers().recording(&[("door", &["d"])]), Err("no marker `d`".into()));
    }
}
