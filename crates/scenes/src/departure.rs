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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nominal::KINDS;
    use crate::{SceneOptions, Simulation, simulate};

    const BEND: f64 = 0.05;
    const SWEEP: f64 = 70_f64.to_radians();
    const TRAVEL: f64 = 0.2;
    /// Distance of the part's centre from the axis, metres.
    const ARM: f64 = 0.15;

    fn bent(kind: JointKind, seed: u64, bend: Option<f64>) -> Simulation {
        let options = SceneOptions { seed, bend, frames: Some(400), ..SceneOptions::default() };
        let options = SceneOptions { sweep_deg: Some(SWEEP.to_degrees()), travel: Some(TRAVEL), ..options };
        simulate(kind.name(), &options).expect("a scene")
    }

    fn relative(simulation: &Simulation) -> Vec<Pose> {
        simulation.poses[0].iter().zip(&simulation.poses[1]).map(|(base, part)| base.inv_mul(part)).collect()
    }

    /// By how much a bend displaces the part, in coordinates of the base.
    fn departures(kind: JointKind, seed: u64) -> Vec<Vector3<f64>> {
        let [ideal, real] = [None, Some(BEND)].map(|bend| relative(&bent(kind, seed, bend)));
        let pairs = ideal.iter().zip(&real);
        pairs
            .map(|(ideal, real)| {
                assert!(ideal.rotation.angle_to(&real.rotation) < 1e-7, "a bend does not turn");
                real.translation.vector - ideal.translation.vector
            })
            .collect()
    }

    #[test]
    fn a_bend_departs_by_its_share_of_the_travel_in_one_direction() {
        let arc = SWEEP * ARM;
        let travel = |kind| match kind {
            JointKind::Rigid => 0.0,
            JointKind::Screw { .. } => arc.hypot(TRAVEL),
            JointKind::Revolute | JointKind::Spherical | JointKind::Universal | JointKind::Elliptical { .. } => arc,
            _ => TRAVEL,
        };
        for (kind, seed) in KINDS.into_iter().flat_map(|kind| (0..4).map(move |seed| (kind, seed))) {
            let departures = departures(kind, seed);
            assert!(departures[0].norm() < 1e-14, "none at frame 0");
            let farthest = departures.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).expect("frames");
            let direction = farthest.try_normalize(1e-9).unwrap_or(Vector3::z());
            assert!(departures.iter().all(|d| d.cross(&direction).norm() < 1e-12), "along one line");
            let along: Vec<_> = departures.iter().map(|d| d.dot(&direction)).collect();
            let [least, most] = law::extremes(&along);
            let expected = BEND * travel(kind);
            assert!((most - least - expected).abs() <= 0.001 * expected, "{}: {}", kind.name(), most - least);
        }
    }

    #[test]
    fn a_bend_is_a_bow_over_the_position() {
        let departures = departures(JointKind::Prismatic, 3);
        let truth = bent(JointKind::Prismatic, 3, Some(BEND)).truth;
        let Some(crate::Positions::Single(q)) = &truth.pairs[0].positions else { panic!("one number per frame") };
        let [least, _] = law::extremes(q);
        let height = |q: f64| 1.0 - (2.0 * (q - least) / TRAVEL - 1.0).powi(2);
        for (departure, q) in departures.iter().zip(q) {
            let expected = BEND * TRAVEL * (height(*q) - height(0.0)).abs();
            assert!((departure.norm() - expected).abs() < 1e-9, "{} {expected}", departure.norm());
        }
    }

    #[test]
    fn bends_go_where_the_joint_does_not() {
        for kind in KINDS {
            let direction = bent(kind, 1, None).truth.pairs[0].axis.and_then(|axis| axis.direction);
            let Some(direction) = direction.map(Vector3::from) else { continue };
            let along = |d: &Vector3<f64>| d.dot(&direction).abs();
            let departures = departures(kind, 1);
            if kind == JointKind::Planar {
                assert!(departures.iter().all(|d| (along(d) - d.norm()).abs() < 1e-12));
            } else {
                assert!(departures.iter().all(|d| along(d) < 1e-12), "{}", kind.name());
            }
        }
    }

    #[test]
    fn the_truth_is_that_of_the_ideal_joint() {
        for kind in KINDS {
            let [ideal, real] = [None, Some(BEND)].map(|bend| bent(kind, 2, bend).truth.pairs.remove(0));
            assert_eq!((ideal.axis, ideal.joint, ideal.thesis_joint), (real.axis, real.joint, real.thesis_joint));
        }
    }

    #[test]
    fn a_body_centred_on_its_axis_has_no_travel_to_depart_by() {
        let options = SceneOptions { bend: Some(0.5), axis_distance: Some(0.0), ..SceneOptions::default() };
        let bent = relative(&simulate("revolute", &options).expect("revolute"));
        let ideal = relative(&simulate("revolute", &SceneOptions { bend: None, ..options }).expect("revolute"));
        let off = bent.iter().zip(&ideal).map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        assert!(off.fold(0.0, f64::max) < 1e-12);
    }
}
