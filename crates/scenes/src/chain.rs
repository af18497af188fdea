//! The joint between any two bodies, from the joints on the way from one to the other.

use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::{Joint, JointKind, Scene};

/// How far directions and points may differ, relative to 1 and in metres, and still be the same: rounding only.
const SAME: f64 = 1e-9;

impl Scene {
    /// The true joint between two bodies, as it stands at frame 0; joints at rest are rigid.
    pub(crate) fn joint_between(&self, reference: usize, moving: usize) -> Joint {
        let mut up = self.ancestry(reference);
        let mut down = self.ancestry(moving);
        while up.last().is_some_and(|body| down.last() == Some(body)) {
            up.pop();
            down.pop();
        }
        let joint = |&body: &usize| {
            let attachment = &self.bodies[body].attachment;
            if attachment.motion.is_empty() { Joint::rigid() } else { attachment.joint }
        };
        let chain: Vec<_> = up.iter().map(|body| joint(body).reversed()).chain(down.iter().rev().map(joint)).collect();
        Joint::enclosing(&chain)
    }

    /// A body and all that it hangs on, upwards.
    fn ancestry(&self, body: usize) -> Vec<usize> {
        std::iter::successors(Some(body), |&body| self.bodies[body].attachment.parent).collect()
    }
}

impl Joint {
    /// The joint seen from the other body, where it has a name of its own there.
    ///
    /// All lower pairs are subgroups and stay what they are; a trammel seen from its moving body is only planar; a
    /// universal joint turns about its second axis first.
    pub(crate) fn reversed(self) -> Self {
        match self.kind {
            JointKind::Universal => {
                // Half a turn between x and z exchanges the two.
                let between = Unit::new_normalize(Vector3::x() + Vector3::z());
                let exchange = UnitQuaternion::from_axis_angle(&between, std::f64::consts::PI);
                Self { frame: self.frame * exchange, ..self }
            }
            JointKind::Elliptical { .. } => Self { kind: JointKind::Planar, ..self },
            _ => self,
        }
    }

    /// The most restrictive lower pair that allows everything these joints allow one after the other.
    pub(crate) fn enclosing(chain: &[Self]) -> Self {
        let moving: Vec<_> = chain.iter().copied().filter(|joint| joint.kind != JointKind::Rigid).collect();
        let [first, rest @ ..] = moving.as_slice() else { return Self::rigid() };
        if rest.is_empty() {
            return *first;
        }
        // Two slides across each other span a plane that neither of them names.
        let normal = rest.iter().map(|joint| first.direction().cross(&joint.direction())).find(|n| n.norm() > SAME);
        let spanned = normal.map(|normal| Self::about(JointKind::Planar, first.point(), normal.normalize()));
        let named = [JointKind::Cylindrical, JointKind::Planar, JointKind::Spherical]
            .into_iter()
            .flat_map(|kind| moving.iter().map(move |joint| Self { kind, ..*joint }));
        let everything = Self { kind: JointKind::Disconnected, ..*first };
        let candidates = moving.iter().copied().chain(named).chain(spanned);
        candidates.into_iter().find(|one| moving.iter().all(|joint| one.allows(joint))).unwrap_or(everything)
    }

    /// Whether every motion of `other` is also one of this joint's.
    fn allows(&self, other: &Self) -> bool {
        use JointKind::{
            Cylindrical, Disconnected, Elliptical, Planar, Prismatic, Revolute, Rigid, Screw, Spherical, Universal,
        };
        let parallel = self.direction().cross(&other.direction()).norm() < SAME;
        let across = self.direction().dot(&other.direction()).abs() < SAME;
        let offset = other.point() - self.point();
        let same_line = parallel && offset.cross(&self.direction()).norm() < SAME;
        let through_origin = offset.cross(&other.direction()).norm() < SAME;
        match (self.kind, other.kind) {
            (_, Rigid) | (Disconnected, _) => true,
            (Prismatic | Cylindrical, Prismatic) | (Planar, Revolute | Planar | Elliptical { .. }) => parallel,
            (Revolute, Revolute) | (Cylindrical, Revolute | Screw { .. } | Cylindrical) => same_line,
            (Screw { pitch: own }, Screw { pitch }) => same_line && (own - pitch).abs() < SAME,
            (Planar, Prismatic) => across,
            (Spherical, Revolute) => through_origin,
            (Spherical, Universal | Spherical) => offset.norm() < SAME,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::JointKind::{
        Cylindrical, Disconnected, Elliptical, Planar, Prismatic, Revolute, Screw, Spherical, Universal,
    };

    fn joint(kind: JointKind, point: [f64; 3], direction: [f64; 3]) -> Joint {
        Joint::about(kind, Point3::from(point), Vector3::from(direction).normalize())
    }

    fn together(chain: &[Joint]) -> &'static str {
        let forward = Joint::enclosing(chain).kind.name();
        let backward: Vec<_> = chain.iter().rev().copied().collect();
        assert_eq!(forward, Joint::enclosing(&backward).kind.name(), "the order of joints does not matter");
        forward
    }

    const X: [f64; 3] = [1.0, 0.0, 0.0];
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    const Z: [f64; 3] = [0.0, 0.0, 1.0];
    const O: [f64; 3] = [0.0; 3];

    #[test]
    fn slides_make_slides_or_planes() {
        assert_eq!(together(&[]), "rigid");
        assert_eq!(together(&[joint(Prismatic, O, X), Joint::rigid(), joint(Prismatic, Z, X)]), "prismatic");
        assert_eq!(together(&[joint(Prismatic, O, X), joint(Prismatic, Z, [1.0, 1.0, 0.0])]), "planar");
        assert_eq!(together(&[joint(Prismatic, O, X), joint(Prismatic, O, Y), joint(Prismatic, O, Z)]), "disconnected");
    }

    #[test]
    fn hinges_make_hinges_planes_cylinders_or_spheres() {
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Revolute, [0.0, 0.0, 3.0], Z)]), "revolute");
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Revolute, X, [0.0, 0.0, -1.0])]), "planar");
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Prismatic, X, Z)]), "cylindrical");
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Prismatic, X, Y)]), "planar");
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Revolute, O, X)]), "spherical");
        assert_eq!(together(&[joint(Revolute, O, Z), joint(Revolute, Y, X)]), "disconnected");
    }

    #[test]
    fn richer_joints_swallow_what_they_allow() {
        let screw = joint(Screw { pitch: 0.1 }, O, Z);
        assert_eq!(together(&[screw, screw]), "screw");
        assert_eq!(together(&[screw, joint(Screw { pitch: 0.2 }, O, Z)]), "cylindrical");
        assert_eq!(together(&[joint(Cylindrical, O, Z), joint(Revolute, O, Z)]), "cylindrical");
        assert_eq!(together(&[joint(Planar, O, Z), joint(Revolute, X, Z), joint(Prismatic, O, Y)]), "planar");
        assert_eq!(together(&[joint(Planar, O, Z), joint(Revolute, O, X)]), "disconnected");
        assert_eq!(together(&[joint(Spherical, O, Z), joint(Spherical, O, X)]), "spherical");
        assert_eq!(together(&[joint(Disconnected, O, Z), joint(Revolute, O, X)]), "disconnected");
    }

    #[test]
    fn a_universal_joint_is_one_from_both_sides() {
        let cross = joint(Universal, [0.3, -0.2, 1.0], [0.6, 0.0, 0.8]);
        let back = cross.reversed();
        assert_eq!(back.kind, Universal);
        for position in [[0.4, 0.0], [0.0, -0.7], [1.1, 0.5]] {
            let there = cross.pose(&position);
            let again = back.position(&there.inverse(), &[]);
            assert!((again[0] + position[1]).abs() < 1e-12 && (again[1] + position[0]).abs() < 1e-12, "{again:?}");
            let error = back.pose(&again).to_homogeneous() - there.inverse().to_homogeneous();
            assert!(error.norm() < 1e-12, "{error}");
        }
    }

    #[test]
    fn universal_joints_and_other_turns_about_their_centre_make_spheres() {
        let cross = joint(Universal, Y, Z);
        assert_eq!(together(&[cross, Joint::rigid()]), "universal");
        assert_eq!(together(&[cross, cross]), "spherical");
        assert_eq!(together(&[cross, joint(Revolute, [0.0, 1.0, 5.0], Z)]), "spherical");
        assert_eq!(together(&[cross, joint(Spherical, Y, X)]), "spherical");
        assert_eq!(together(&[cross, joint(Revolute, O, Z)]), "disconnected");
        assert_eq!(together(&[cross, joint(Prismatic, Y, Z)]), "disconnected");
    }

    #[test]
    fn a_trammel_is_elliptical_from_one_side_only() {
        let trammel = joint(Elliptical { crank: 0.1 }, O, Z);
        assert_eq!(Joint::enclosing(&[trammel]).kind.name(), "elliptical");
        assert_eq!(Joint::enclosing(&[trammel.reversed()]).kind.name(), "planar");
        assert_eq!(together(&[trammel, joint(Elliptical { crank: 0.2 }, O, Z)]), "planar");
    }
}
