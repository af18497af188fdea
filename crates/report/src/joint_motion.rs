//! How a found joint moves: from positions to poses, and back.

use jointscope_detection::{Detection, JointKind, PairDetection};
use jointscope_models::{Axis, lower_pair::turn_about_z};
use jointscope_motion::{Pose, scaled_pose, twist};
use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

/// Rounds in which home pose and positions settle on each other.
const ROUNDS: usize = 4;

/// A joint of a pair that can be moved.
///
/// # Convention
/// `reference_from_moving` at positions `q` is `motion(q) · home`, with the motion in the reference's coordinates.
/// Positions are those of the detection where the joint has one freedom or is cylindrical. Else they are told by the
/// measured poses: a planar joint's slides are along the axes `x` and `y` of [`JointMotion::coordinates`], its turn is
/// about `z`; a spherical joint's three are the rotation vector in the axes of the reference.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointMotion {
    pub(crate) kind: JointKind,
    /// Of the reference. Where nothing is known of an axis, it is at the origin.
    pub(crate) axis: Axis,
    /// `reference_from_moving` at rest in the joint's zero; `None` if an orientation is not seen.
    pub(crate) home: Option<Pose>,
    /// Per frame of the recording, as many numbers as the joint has freedoms.
    pub(crate) positions: Vec<Option<Vec<f64>>>,
}

/// By what a pair's moving body is multiplied where every pair has a scale of its own, so that only what is told of the pair
/// can show it; else 1.
pub(crate) fn own_scale(detection: &Detection, pair: &PairDetection) -> f64 {
    pair.scale.as_ref().filter(|_| detection.scales.is_none()).and_then(|scale| scale.factor).unwrap_or(1.0)
}

/// Poses of a body that is multiplied by a factor.
pub(crate) fn larger(poses: &[Option<Pose>], factor: f64) -> Vec<Option<Pose>> {
    poses.iter().map(|pose| pose.as_ref().map(|pose| scaled_pose(pose, factor))).collect()
}

impl JointMotion {
    /// The joint of a pair; `None` where nothing connects the bodies.
    pub(crate) fn of(detection: &Detection, pair: &PairDetection) -> Option<Self> {
        let kind = pair.kind();
        let poses = |name: &String| {
            let index = detection.bodies.iter().position(|body| body == name);
            index.map_or(&[][..], |index| &detection.poses[index])
        };
        let factor = own_scale(detection, pair);
        let measured = relative(poses(&pair.reference), &larger(poses(&pair.moving), factor));
        let axis = pair.axis.unwrap_or(Axis { point: Point3::origin(), direction: None, pitch: None });
        let lever = pair.axis_in_moving.map_or(Point3::origin(), |axis| axis.point * factor);
        let mut joint = Self { kind, axis, home: measured.iter().flatten().next().copied(), positions: Vec::new() };
        let told = |freedoms: usize| {
            let rows = pair.positions.as_ref().filter(|positions| positions.freedoms() == freedoms)?;
            Some(rows.iter().map(|row| row.map(<[f64]>::to_vec)).collect::<Vec<_>>())
        };
        match kind {
            JointKind::Disconnected => return None,
            JointKind::Rigid => {
                joint.positions = measured.iter().map(|pose| pose.map(|_| Vec::new())).collect();
                joint.settle(&measured, lever);
            }
            JointKind::Prismatic
            | JointKind::Revolute
            | JointKind::Elliptical { .. }
            | JointKind::Screw { .. }
            | JointKind::Cylindrical => {
                joint.positions = told(kind.freedoms())?;
                for _ in 0..ROUNDS {
                    joint.settle(&measured, lever);
                }
            }
            JointKind::Planar | JointKind::Spherical | JointKind::Universal => {
                for _ in 0..ROUNDS {
                    joint.project(&measured);
                    joint.settle(&measured, lever);
                }
            }
        }
        Some(joint)
    }

    /// Rotation from the joint's own axes, `z` along the axis, to the reference's.
    pub(crate) fn turn(&self) -> UnitQuaternion<f64> {
        let Some(direction) = self.axis.direction else { return UnitQuaternion::identity() };
        UnitQuaternion::from_rotation_matrix(&towards(&direction))
    }

    /// `reference_from_joint`: origin at the axis's point, `z` along the axis.
    pub(crate) fn coordinates(&self) -> Pose {
        Pose::from_parts(self.axis.point.coords.into(), self.turn())
    }

    /// `reference_from_reference`: what the positions do.
    pub(crate) fn motion(&self, q: &[f64]) -> Pose {
        let coordinates = self.coordinates();
        let about = |angle: f64, shift: Vector3<f64>| {
            Pose::from_parts(shift.into(), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle))
        };
        let own = match (self.kind, q) {
            (JointKind::Prismatic, &[length]) => about(0.0, Vector3::z() * length),
            (JointKind::Revolute | JointKind::Elliptical { .. }, &[angle]) => about(angle, Vector3::zeros()),
            (JointKind::Screw { pitch }, &[angle]) => about(angle, Vector3::z() * pitch * angle),
            (JointKind::Cylindrical, &[angle, length]) => about(angle, Vector3::z() * length),
            (JointKind::Planar, &[angle, x, y]) => about(angle, Vector3::new(x, y, 0.0)),
            (JointKind::Spherical | JointKind::Universal, &[x, y, z]) => {
                Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z)))
            }
            _ => return Pose::identity(),
        };
        coordinates * own * coordinates.inverse()
    }

    /// Where a place was before the positions moved it; on ellipses, features do not move as one body does.
    pub(crate) fn carried_back(&self, q: &[f64], place: &Point3<f64>) -> Point3<f64> {
        let (JointKind::Elliptical { ratio, long_axis }, Some(normal), &[angle]) = (self.kind, self.axis.direction, q)
        else {
            return self.motion(q).inverse() * place;
        };
        let short_axis = normal.cross(&long_axis);
        let from = place - self.axis.point;
        let (sin, cos) = angle.sin_cos();
        let (x, y) = (from.dot(&long_axis), from.dot(&short_axis) / ratio);
        let change = long_axis.scale(x * cos + y * sin - x) + short_axis * ratio * (y * cos - x * sin - y);
        place + change
    }

    /// Positions nearest to the measured poses.
    fn project(&mut self, measured: &[Option<Pose>]) {
        let Some(home) = self.home else { return };
        let coordinates = self.coordinates();
        let kind = self.kind;
        let mut before = 0.0;
        let mut nearest = |pose: &Pose| {
            let own = coordinates.inverse() * (pose * home.inverse()) * coordinates;
            if kind != JointKind::Planar {
                return own.rotation.scaled_axis().iter().copied().collect();
            }
            before = turn_about_z(&own, before);
            vec![before, own.translation.x, own.translation.y]
        };
        self.positions = measured.iter().map(|pose| pose.as_ref().map(&mut nearest)).collect();
    }

    /// Home as most frames tell it: the median departure from the home so far, about the moving body's side of the joint.
    fn settle(&mut self, measured: &[Option<Pose>], lever: Point3<f64>) {
        let Some(home) = self.home else { return };
        let lever = Pose::translation(lever.x, lever.y, lever.z);
        let departures: Vec<_> = measured
            .iter()
            .zip(&self.positions)
            .filter_map(|(pose, q)| {
                let departure = home.inverse() * self.motion(q.as_ref()?).inverse() * (*pose)?;
                Some(twist::log(&(lever.inverse() * departure * lever)))
            })
            .collect();
        if departures.is_empty() {
            return;
        }
        let middle = |axis: usize| median(departures.iter().map(|departure| departure[axis]).collect());
        let middle = twist::Twist::from_fn(|axis, _| middle(axis));
        self.home = Some(home * lever * twist::exp(&middle) * lever.inverse());
    }
}

/// `reference_from_moving` in every frame that poses both.
pub(crate) fn relative(reference: &[Option<Pose>], moving: &[Option<Pose>]) -> Vec<Option<Pose>> {
    reference.iter().zip(moving).map(|(reference, moving)| Some((*reference)?.inverse() * (*moving)?)).collect()
}

/// A rotation that takes `z` to a direction, and `x` across it, where a coordinate axis is farthest from the direction.
fn towards(direction: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let z = direction.into_inner();
    let farthest = Vector3::ith(z.iamin(), 1.0);
    let x = (farthest - z * z.dot(&farthest)).normalize();
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() { 0.0 } else { jointscope_motion::quantile(&mut values, 0.5) }
}
