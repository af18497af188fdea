//! Joints that are not ideal: how a moving body departs from what its joint lets it do.

use jointscope_motion::Pose;
use nalgebra::{Point3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, UnitSphere};

use crate::sensor::Purpose;
use crate::{Attachment, Joint, JointKind, law};

impl Attachment {
    /// Poses `parent_from_body`, per frame, of a body whose centre is at a point of the recording at frame 0.
    pub(crate) fn poses(
        &self,
        frames: usize,
        centre: Point3<f64>,
        random: impl Fn(Purpose) -> ChaCha8Rng,
    ) -> Vec<Pose> {
        let position = |frame| self.motion.iter().map(|series| series[frame] - series[0]).collect::<Vec<_>>();
        let mut poses: Vec<Pose> = (0..frames).map(|frame| self.joint.pose(&position(frame))).collect();
        if self.play > 0.0 {
            let departure = law::wander(frames, &[self.play; 3], &mut random(Purpose::Play));
            for (frame, pose) in poses.iter_mut().enumerate() {
                pose.translation.vector += Vector3::from_fn(|axis, _| departure[axis][frame]);
            }
        }
        if self.bend > 0.0
            && let Some(first) = self.motion.first()
        {
            let aside = self.bend * self.travel(centre) * self.joint.aside(&mut random(Purpose::Bend));
            for (pose, share) in poses.iter_mut().zip(bow(first)) {
                pose.translation.vector += share * aside;
            }
        }
        poses
    }

    /// How far the coordinate that moves a point of frame 0 farthest takes it, metres.
    fn travel(&self, point: Point3<f64>) -> f64 {
        let arm = self.joint.arm(point);
        let way = |(number, series): (usize, &Vec<f64>)| {
            let [least, most] = law::extremes(series);
            let per_unit = match self.joint.kind {
                JointKind::Screw { pitch } => arm.hypot(pitch),
                kind if number < kind.angles() => arm,
                _ => 1.0,
            };
            (most - least) * per_unit
        };
        self.motion.iter().enumerate().map(way).fold(0.0, f64::max)
    }
}

impl Joint {
    /// Distance of a point from the axis, or from the centre of joints that turn about a point, metres.
    fn arm(&self, point: Point3<f64>) -> f64 {
        let offset = point - self.point();
        match self.kind {
            JointKind::Spherical | JointKind::Universal | JointKind::Disconnected => offset.norm(),
            _ => offset.cross(&self.direction()).norm(),
        }
    }

    /// A unit direction in which the joint does not let the body move, if there is one.
    fn aside(&self, rng: &mut ChaCha8Rng) -> Vector3<f64> {
        match self.kind {
            JointKind::Planar => self.direction(),
            JointKind::Rigid | JointKind::Spherical | JointKind::Universal | JointKind::Disconnected => {
                Vector3::from(UnitSphere.sample(rng))
            }
            _ => {
                let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
                self.frame.rotation * Vector3::new(cos, sin, 0.0)
            }
        }
    }
}

/// A bow of height 1 over the range of a series, less what it is at the first frame.
fn bow(series: &[f64]) -> impl Iterator<Item = f64> {
    let [least, most] = law::extremes(series);
    // A series that does not move has no bow.
    let range = if most > least { most - least } else { f64::INFINITY };
    let height = move |q: f64| 1.0 - (2.0 * (q - least) / range - 1.0).powi(2);
    series.iter().map(move |&q| height(q) - height(series[0]))
}
