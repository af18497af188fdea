//! The thesis's ten experiments (its appendices A to J), played again by simulated bodies.
//!
//! What the thesis filmed is not published; sizes, paths and joints here follow its captions and tables. Clusters on
//! the background are seen exactly and do not move by a digit, as optical flow sees what is at rest: the thesis's
//! rigid score of 1.000 for two of them can come about in no other way. Moving clusters have 1 mm of noise.

mod printed;
mod stage;
#[cfg(test)]
mod tests;

use jointscope_motion::Pose;
use nalgebra::{UnitQuaternion, Vector3};

pub use printed::{EXPERIMENTS, Experiment, PrintedPair};

use crate::JointKind::{Planar, Prismatic, Revolute, Rigid};
use crate::law::{drive, stroke, swing};
use crate::{Scene, SceneError, SceneOptions, Shape};
use stage::{Stage, along, at, tilted};

/// Noise of moving clusters, metres.
const NOISE: f64 = 0.001;

/// Builds the scene of an experiment.
pub(crate) fn build(experiment: &Experiment, options: &SceneOptions) -> Result<Scene, SceneError> {
    let useless =
        ["sweep_deg", "travel", "body_size", "axis_distance", "base_distance", "still_base", "poses", "body_shape"];
    options.refuse(experiment.scene, &useless)?;
    let stage = (experiment.stage)(options);
    Ok(stage.into_scene(experiment.scene, options.sensor(NOISE)))
}

/// Appendix A. A toy train is pushed over a table along an S; its cars are coupled by a vertical pin about which they
/// swing through 70°.
fn train(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 437, 20, [40.0, 0.0], 1.2);
    let frames = stage.frames;
    let car = Shape::Box { size: [0.10, 0.05, 0.06] };
    let background = stage.still("background", Shape::Box { size: [0.5, 0.2, 0.2] }, at(0.0, 0.4, 0.1));
    let path = drive(frames, 0.5, 40_f64.to_radians(), 1.0);
    let left = stage.moving("left-train", background, (Planar, at(-0.3, 0.0, 0.0)), path, car, at(-0.3, 0.0, 0.03));
    let bends = vec![swing(frames, 35_f64.to_radians(), 1.5)];
    stage.moving("right-train", left, (Revolute, at(-0.23, 0.0, 0.0)), bends, car, at(-0.16, 0.0, 0.03));
    stage
}

/// Appendix B. A cabinet is pushed over the floor while its top and its bottom drawer are pulled out, one after the
/// other, by 35 and 30 cm. With `monocular` the top drawer has to be scaled by 0.96, as the thesis found.
fn drawers(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 250, 20, [30.0, 25.0], 2.0);
    let frames = stage.frames;
    let front = Shape::Box { size: [0.40, 0.04, 0.16] };
    let push = [0.2, 0.25, 0.06].map(|to| stroke(frames, to, 0.0, 1.0)).to_vec();
    let top = Shape::Box { size: [0.45, 0.40, 0.05] };
    let frame = stage.on_the_floor("frame", (Planar, at(0.0, 0.0, 0.0)), push, top, at(0.0, 0.0, 0.35));
    let towards_camera = |height: f64| (Prismatic, along(-Vector3::y()) * at(0.0, 0.0, height));
    let pull = vec![stroke(frames, 0.35, 0.05, 0.6)];
    let drawer = stage.moving("top-drawer", frame, towards_camera(0.2), pull, front, at(0.0, -0.2, 0.2));
    stage.seen_at_scale(drawer, 0.96);
    let pull = vec![stroke(frames, 0.30, 0.4, 0.95)];
    stage.moving("bottom-drawer", frame, towards_camera(-0.1), pull, front, at(0.0, -0.2, -0.1));
    stage
}

/// Appendix C. A tricycle rolls along an S; its front wheel, of 12 cm radius and 5 cm width, turns without slipping, by more than a
/// full turn.
fn tricycle(options: &SceneOptions) -> Stage<'_> {
    const LENGTH: f64 = 1.0;
    const RADIUS: f64 = 0.12;
    let mut stage = Stage::new(options, 300, 20, [30.0, 0.0], 2.2);
    let frames = stage.frames;
    let background = stage.still("background", Shape::Box { size: [1.0, 0.1, 0.6] }, at(0.0, 0.8, 0.3));
    let path = drive(frames, LENGTH, 35_f64.to_radians(), 1.0);
    let seat = Shape::Box { size: [0.25, 0.15, 0.15] };
    let top = stage.moving("top", background, (Planar, at(-0.5, 0.0, 0.0)), path, seat, at(-0.5, 0.0, 0.45));
    let axle = at(-0.2, 0.0, RADIUS) * along(Vector3::y());
    let roll = vec![stroke(frames, LENGTH / RADIUS, 0.0, 1.0)];
    stage.moving("wheel", top, (Revolute, axle), roll, Shape::Ring { inner: 0.03, outer: 0.11, width: 0.05 }, axle);
    stage
}

/// Appendix D. A table is pushed 80 cm to the right; clusters on its top and on its bottom belong to one rigid body.
fn table(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 200, 20, [20.0, 0.0], 2.5);
    let frames = stage.frames;
    let background = stage.still("background", Shape::Box { size: [1.5, 0.1, 1.0] }, at(0.0, 1.0, 0.3));
    let push = vec![stroke(frames, 0.8, 0.0, 1.0)];
    let to_the_right = (Prismatic, along(Vector3::new(1.0, 0.1, 0.0).normalize()));
    let board = Shape::Box { size: [0.7, 0.4, 0.04] };
    let top = stage.moving("top-table", background, to_the_right, push, board, at(-0.4, 0.0, 0.4));
    let shelf = Shape::Box { size: [0.6, 0.35, 0.08] };
    stage.moving("bottom-table", top, (Rigid, Pose::identity()), vec![], shelf, at(-0.4, 0.0, -0.2));
    stage
}

/// Appendix E. A box is moved over a table along an S while its lid opens by 75° about the rear edge.
fn diaper_box(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 240, 20, [30.0, 15.0], 1.3);
    let frames = stage.frames;
    let background = stage.still("background", Shape::Box { size: [0.15; 3] }, at(0.35, 0.2, 0.075));
    let path = drive(frames, 0.3, 50_f64.to_radians(), 1.0);
    let front = Shape::Box { size: [0.30, 0.02, 0.18] };
    let side = stage.moving("side", background, (Planar, at(-0.2, 0.0, 0.0)), path, front, at(-0.2, -0.1, 0.1));
    let hinge = at(-0.2, 0.1, 0.2) * along(-Vector3::x());
    let lid = vec![stroke(frames, 75_f64.to_radians(), 0.2, 0.9)];
    stage.moving("top", side, (Revolute, hinge), lid, Shape::Plate { size: [0.30, 0.20] }, at(-0.2, 0.0, 0.2));
    stage
}

/// Appendix F. The doors of an elevator part by 45 cm each.
fn elevator(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 150, 20, [5.0, 10.0], 3.0);
    let frames = stage.frames;
    let wing = Shape::Plate { size: [0.40, 1.20] };
    let wall = Shape::Box { size: [0.30, 0.10, 1.00] };
    let slide = vec![stroke(frames, 0.45, 0.1, 0.9)];
    let to_the = |side: f64| (Prismatic, along(side * Vector3::x()));
    stage.on_the_floor("left-door", to_the(-1.0), slide.clone(), wing, at(-0.22, 0.0, 0.0) * upright());
    stage.still("background", wall, at(-1.0, -0.1, 0.2));
    stage.on_the_floor("right-door", to_the(1.0), slide, wing, at(0.22, 0.0, 0.0) * upright());
    stage
}

/// Appendix G. The door of a fridge, seen obliquely, turns through the image plane towards the camera by 80°; two
/// clusters are on it. The single camera compresses the depth changes of `door1` to 0.6 and those of `door2` to 0.97:
/// `door1` runs on ellipses, and the two, though parts of one rigid door, seem to move against each other.
fn fridge(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 100, 12, [0.0, 20.0], 1.8);
    let frames = stage.frames;
    let background = stage.still("background", Shape::Box { size: [0.3, 0.3, 0.6] }, at(0.6, 0.1, 0.0));
    let hinge = (Revolute, at(-0.3, 0.0, 0.0));
    let open = vec![stroke(frames, -80_f64.to_radians(), 0.05, 0.95)];
    let cluster = Shape::Plate { size: [0.25, 0.25] };
    let door1 = stage.moving("door1", background, hinge, open, cluster, at(0.1, 0.0, 0.25) * upright());
    stage.seen_with_depth_gain(door1, 0.6);
    let same = (Rigid, Pose::identity());
    let door2 = stage.moving("door2", door1, same, vec![], cluster, at(0.05, 0.0, -0.25) * upright());
    stage.seen_with_depth_gain(door2, 0.97);
    stage
}

/// Appendix H. The door of a book shelf slides by 50 cm past two clusters at rest.
fn sliding_door(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 160, 20, [10.0, 15.0], 2.0);
    let frames = stage.frames;
    let top = stage.still("top-part", Shape::Box { size: [0.15; 3] }, at(0.1, 0.1, 0.55));
    let wing = Shape::Plate { size: [0.40, 0.80] };
    let slide = (Prismatic, along(Vector3::x()));
    let run = vec![stroke(frames, 0.5, 0.05, 0.95)];
    stage.moving("door", top, slide, run, wing, at(-0.25, 0.0, 0.0) * upright());
    stage.still("left-part", wing, at(-0.7, 0.03, 0.0) * upright());
    stage
}

/// Appendix I. A laptop is moved over the table in an arc of 55° past its power supply while its screen opens by 75°.
/// With `monocular` the keyboard has to be scaled by 0.94, as the thesis found.
fn laptop(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 320, 20, [35.0, 0.0], 1.3);
    let frames = stage.frames;
    let supply = stage.still("power-supply", Shape::Box { size: [0.15, 0.08, 0.04] }, at(-0.45, 0.25, 0.02));
    let arc = vec![stroke(frames, 55_f64.to_radians(), 0.0, 0.8)];
    let pivot = (Revolute, at(-0.1, 0.45, 0.0));
    let keys = Shape::Box { size: [0.30, 0.20, 0.01] };
    let keyboard = stage.moving("keyboard", supply, pivot, arc, keys, at(-0.15, 0.0, 0.01));
    stage.seen_at_scale(keyboard, 0.94);
    let edge = at(-0.15, 0.1, 0.02) * along(-Vector3::x());
    let open = vec![stroke(frames, 75_f64.to_radians(), 0.25, 1.0)];
    // The lid stands 20° open at first; its centre is half its height in front of the hinge.
    let lid = at(-0.15, 0.1, 0.02) * tilted(-Vector3::x(), 20.0) * at(0.0, -0.1, 0.0);
    stage.moving("screen", keyboard, (Revolute, edge), open, Shape::Plate { size: [0.30, 0.20] }, lid);
    stage
}

/// Appendix J. A door opens by 70° beside a poster on the wall.
fn door(options: &SceneOptions) -> Stage<'_> {
    let mut stage = Stage::new(options, 180, 20, [10.0, 10.0], 2.8);
    let frames = stage.frames;
    let sheet = Shape::Plate { size: [0.50, 0.70] };
    let poster = stage.still("poster", sheet, at(-0.8, 0.0, 0.2) * upright());
    let hinge = (Revolute, at(0.4, 0.0, 0.0));
    let open = vec![stroke(frames, 70_f64.to_radians(), 0.05, 0.95)];
    let wing = Shape::Plate { size: [0.60, 1.20] };
    stage.moving("door", poster, hinge, open, wing, at(0.05, 0.0, 0.0) * upright());
    stage
}

/// Stands a plate upright, facing the camera.
fn upright() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2)
}
