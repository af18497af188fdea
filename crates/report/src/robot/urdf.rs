//! The mechanism as URDF.

use std::fmt::Write;

use super::{Link, Move, Robot, RobotJoint, number, numbers, rgba, roll_pitch_yaw};
use crate::{Report, picture::style::escaped};

/// Effort and speed that are written where nothing tells them: the format asks for both.
const EFFORT: f64 = 100.0;
const SPEED: f64 = 1.0;

/// The mechanism as URDF: a link for every body, a joint for every branch of the tree.
///
/// *Convention.* Metres and radians. The base's coordinates are the recording's at the base's first pose. Every other
/// link has its coordinates on the axis of the joint by which it hangs, with `z` along the axis; a positive position
/// turns or slides the child about or along it. Positions are those of the detection, 0 at the first frame that shows
/// both bodies, and limits are what was seen of them. URDF has joints of one freedom only: a cylindrical joint is a
/// slide and a turn, a planar one two slides and a turn, a spherical one turns about `x`, `y` and `z`, a screw a turn
/// and a slide that mimics it, with links without features between. What nothing connects hangs on the base by a
/// floating joint. There are no inertias: a recording does not tell them.
pub fn to_urdf(report: &Report<'_>) -> String {
    let robot = Robot::of(report);
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<robot name=\"mechanism\">\n");
    for link in &robot.links {
        xml += &of_link(link);
    }
    for (number, joint) in robot.joints.iter().enumerate() {
        xml += &of_joint(&robot, joint, number + 1);
    }
    xml + "</robot>\n"
}

fn of_link(link: &Link) -> String {
    let name = escaped(&link.name);
    if link.features.is_empty() {
        return format!("  <link name=\"{name}\"/>\n");
    }
    let mut xml = format!("  <link name=\"{name}\">\n");
    for feature in &link.features {
        let _ = write!(
            xml,
            "    <visual>\n      <origin xyz=\"{}\"/>\n      <geometry><sphere radius=\"{}\"/></geometry>\n      \
             <material name=\"{name}\"><color rgba=\"{}\"/></material>\n    </visual>\n",
            numbers(feature.iter().copied()),
            number(link.radius),
            rgba(link.colour)
        );
    }
    xml + "  </link>\n"
}

fn of_joint(robot: &Robot, joint: &RobotJoint, child: usize) -> String {
    let kind = match (joint.moves, joint.limits) {
        (Move::Fixed, _) => "fixed",
        (Move::Floating, _) => "floating",
        (Move::Slide, _) => "prismatic",
        (Move::Turn, Some(_)) => "revolute",
        (Move::Turn, None) => "continuous",
    };
    let mut xml = format!(
        "  <joint name=\"{}\" type=\"{kind}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n",
        escaped(&joint.name),
        escaped(&robot.links[joint.parent].name),
        escaped(&robot.links[child].name),
        numbers(joint.origin.translation.vector.iter().copied()),
        numbers(roll_pitch_yaw(&joint.origin.rotation))
    );
    if matches!(joint.moves, Move::Turn | Move::Slide) {
        let _ = writeln!(xml, "    <axis xyz=\"{}\"/>", numbers(joint.axis));
        let speed = number(joint.speed.filter(|speed| *speed > 0.0).unwrap_or(SPEED));
        let limits = joint
            .limits
            .map_or(String::new(), |[least, most]| format!("lower=\"{}\" upper=\"{}\" ", number(least), number(most)));
        let _ = writeln!(xml, "    <limit {limits}effort=\"{}\" velocity=\"{speed}\"/>", number(EFFORT));
        if let Some((of, ratio, offset)) = joint.mimic {
            let of = escaped(&robot.joints[of].name);
            let _ = writeln!(
                xml,
                "    <mimic joint=\"{of}\" multiplier=\"{}\" offset=\"{}\"/>",
                number(ratio),
                number(offset)
            );
        }
    }
    xml + "  </joint>\n"
}
