//! The mechanism as MJCF, the format of the simulator `MuJoCo`.

use std::fmt::Write;

use jointscope_motion::Pose;
use nalgebra::Point3;

use super::{Link, Move, Robot, RobotJoint, number, numbers, rgba};
use crate::{Report, picture::style::escaped};

/// The mechanism as MJCF: a body for every body, with as many joints as it has freedoms.
///
/// *Convention.* As [`to_urdf`](crate::to_urdf): metres and radians, a body's coordinates on the axis of its joint with
/// `z` along it, positions as detected. A screw's slide, and joints that moved in proportion, are equality constraints.
/// What nothing connects is free in the world, whose coordinates are the base's. Features are spheres that touch
/// nothing; masses are those of water, since a recording does not tell them.
pub fn to_mjcf(report: &Report<'_>) -> String {
    let robot = Robot::of(report);
    let mut xml = String::from(
        "<mujoco model=\"mechanism\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  <default>\n    \
         <geom type=\"sphere\" contype=\"0\" conaffinity=\"0\" density=\"1000\"/>\n  </default>\n  <worldbody>\n",
    );
    body(&robot, 0, &Pose::identity(), "", 2, &mut xml);
    for (index, joint) in robot.joints.iter().enumerate().filter(|(_, joint)| joint.moves == Move::Floating) {
        let place = robot.links[joint.parent].place.inverse() * joint.origin;
        body(&robot, index + 1, &place, "<freejoint/>", 2, &mut xml);
    }
    xml += "  </worldbody>\n";
    let coupled: Vec<&RobotJoint> = robot.joints.iter().filter(|joint| joint.mimic.is_some()).collect();
    if !coupled.is_empty() {
        xml += "  <equality>\n";
        for joint in coupled {
            if let Some((of, ratio, offset)) = joint.mimic {
                let _ = writeln!(
                    xml,
                    "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{} 0 0 0\"/>",
                    escaped(&joint.name),
                    escaped(&robot.joints[of].name),
                    numbers([offset, ratio])
                );
            }
        }
        xml += "  </equality>\n";
    }
    xml + "</mujoco>\n"
}

/// A link at a place of its parent, with all that hangs on it. Stages of a joint become joints of the last one.
fn body(robot: &Robot, link: usize, place: &Pose, joints: &str, depth: usize, xml: &mut String) {
    let indent = "  ".repeat(depth);
    let q = place.rotation.quaternion();
    let Link { name, features, radius, colour, .. } = &robot.links[link];
    let _ = writeln!(
        xml,
        "{indent}<body name=\"{}\" pos=\"{}\" quat=\"{}\">",
        escaped(&allowed(name)),
        numbers(place.translation.vector.iter().copied()),
        numbers([q.w, q.i, q.j, q.k])
    );
    for line in joints.lines() {
        let _ = writeln!(xml, "{indent}  {line}");
    }
    // What moves must have a mass.
    let origin = [Point3::origin()];
    let (spheres, size) = if features.is_empty() { (&origin[..], 0.01) } else { (features.as_slice(), *radius) };
    for place in spheres {
        let _ = writeln!(
            xml,
            "{indent}  <geom pos=\"{}\" size=\"{}\" rgba=\"{}\"/>",
            numbers(place.iter().copied()),
            number(size),
            rgba(colour)
        );
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        if joint.parent == link && joint.moves != Move::Floating {
            let (last, joints) = stages(robot, index);
            body(robot, last + 1, &joint.origin, &joints, depth + 1, xml);
        }
    }
    let _ = writeln!(xml, "{indent}</body>");
}

/// The name of a body that the format allows: its world has a name already.
fn allowed(name: &str) -> String {
    if name == "world" { "world_2".into() } else { name.into() }
}

/// The joints from one to the next body, and the index of the last of them.
fn stages(robot: &Robot, first: usize) -> (usize, String) {
    let mut last = first;
    let mut joints = of_joint(&robot.joints[first]);
    while robot.links[last + 1].body.is_none() {
        last += 1;
        joints += &of_joint(&robot.joints[last]);
    }
    (last, joints)
}

fn of_joint(joint: &RobotJoint) -> String {
    let kind = match joint.moves {
        Move::Turn => "hinge",
        Move::Slide => "slide",
        Move::Fixed | Move::Floating => return String::new(),
    };
    let range = joint.limits.map_or(String::new(), |limits| format!(" range=\"{}\"", numbers(limits)));
    format!("<joint name=\"{}\" type=\"{kind}\" axis=\"{}\"{range}/>\n", escaped(&joint.name), numbers(joint.axis))
}
