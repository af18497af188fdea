//! The results that the thesis prints for its experiments.

use super::{Stage, diaper_box, door, drawers, elevator, fridge, laptop, sliding_door, table, train, tricycle};
use crate::SceneOptions;

/// One of the thesis's experiments.
#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// Letter of its appendix, A to J.
    pub letter: char,
    /// Name of the scene.
    pub scene: &'static str,
    /// Its title in the thesis.
    pub title: &'static str,
    /// What happens, in one line.
    pub summary: &'static str,
    /// Its pairs, in the order and orientation of the thesis's table.
    pub pairs: &'static [PrintedPair],
    pub(super) stage: for<'a> fn(&'a SceneOptions) -> Stage<'a>,
}

/// A row of the thesis's tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedPair {
    /// Name of the reference body.
    pub reference: &'static str,
    /// Name of the moving body.
    pub moving: &'static str,
    /// The printed confidences: rigid, prismatic, revolute, disconnected.
    pub confidences: [f64; 4],
    /// What the joint truly is, in the same four classes.
    pub joint: &'static str,
}

impl PrintedPair {
    /// The four classes, in the order of the tables' columns.
    pub const CLASSES: [&'static str; 4] = ["rigid", "prismatic", "revolute", "disconnected"];

    /// The class that the thesis finds: the largest printed confidence.
    pub fn printed_joint(&self) -> &'static str {
        let largest = self.confidences.iter().copied().fold(0.0, f64::max);
        let columns = Self::CLASSES.iter().zip(self.confidences);
        columns
            .filter(|(_, confidence)| *confidence >= largest)
            .map(|(class, _)| *class)
            .next()
            .unwrap_or("disconnected")
    }
}

const fn pair(
    reference: &'static str,
    moving: &'static str,
    confidences: [f64; 4],
    joint: &'static str,
) -> PrintedPair {
    PrintedPair { reference, moving, confidences, joint }
}

/// The ten experiments in the order of the thesis's appendices.
///
/// Two first labels that the thesis leaves out are filled in: Frame-Top Drawer and Background-Door1. Both doors of the
/// fridge are clusters on one rigid door, whatever the thesis counts as right.
pub const EXPERIMENTS: [Experiment; 10] = [
    Experiment {
        letter: 'A',
        scene: "train",
        title: "Train Toy",
        summary: "a toy train is pushed over a table; its cars swing about their coupling",
        pairs: &[
            pair("background", "left-train", [0.000, 0.000, 0.025, 0.975], "disconnected"),
            pair("background", "right-train", [0.000, 0.000, 0.250, 0.750], "disconnected"),
            pair("left-train", "right-train", [0.000, 0.004, 0.996, 0.000], "revolute"),
        ],
        stage: train,
    },
    Experiment {
        letter: 'B',
        scene: "drawers",
        title: "Drawers",
        summary: "a cabinet is pushed while two of its drawers are pulled out",
        pairs: &[
            pair("frame", "top-drawer", [0.000, 0.996, 0.002, 0.002], "prismatic"),
            pair("frame", "bottom-drawer", [0.000, 0.975, 0.014, 0.011], "prismatic"),
            pair("top-drawer", "bottom-drawer", [0.000, 0.969, 0.022, 0.009], "prismatic"),
        ],
        stage: drawers,
    },
    Experiment {
        letter: 'C',
        scene: "tricycle",
        title: "Tricycle",
        summary: "a tricycle rolls along an S; its wheel turns more than once",
        pairs: &[
            pair("background", "top", [0.000, 0.000, 0.125, 0.875], "disconnected"),
            pair("background", "wheel", [0.000, 0.000, 0.008, 0.992], "disconnected"),
            pair("top", "wheel", [0.001, 0.000, 0.999, 0.000], "revolute"),
        ],
        stage: tricycle,
    },
    Experiment {
        letter: 'D',
        scene: "table",
        title: "Table",
        summary: "a table is pushed straight; its top and bottom are one body",
        pairs: &[
            pair("background", "top-table", [0.000, 0.917, 0.000, 0.083], "prismatic"),
            pair("background", "bottom-table", [0.000, 0.995, 0.000, 0.005], "prismatic"),
            pair("top-table", "bottom-table", [0.690, 0.013, 0.135, 0.162], "rigid"),
        ],
        stage: table,
    },
    Experiment {
        letter: 'E',
        scene: "diaper-box",
        title: "Diaper Box",
        summary: "a box is moved over a table while its lid opens",
        pairs: &[
            pair("background", "side", [0.000, 0.000, 0.205, 0.794], "disconnected"),
            pair("background", "top", [0.000, 0.000, 0.070, 0.930], "disconnected"),
            pair("side", "top", [0.000, 0.000, 0.968, 0.032], "revolute"),
        ],
        stage: diaper_box,
    },
    Experiment {
        letter: 'F',
        scene: "elevator",
        title: "Elevator",
        summary: "the two doors of an elevator part",
        pairs: &[
            pair("left-door", "right-door", [0.000, 0.995, 0.005, 0.001], "prismatic"),
            pair("left-door", "background", [0.000, 0.994, 0.000, 0.006], "prismatic"),
            pair("background", "right-door", [0.000, 0.955, 0.000, 0.045], "prismatic"),
        ],
        stage: elevator,
    },
    Experiment {
        letter: 'G',
        scene: "fridge",
        title: "Fridge",
        summary: "the door of a fridge opens, seen with compressed depth",
        pairs: &[
            pair("background", "door1", [0.000, 0.000, 0.278, 0.722], "revolute"),
            pair("background", "door2", [0.000, 0.000, 0.893, 0.107], "revolute"),
            pair("door1", "door2", [0.000, 0.919, 0.081, 0.000], "rigid"),
        ],
        stage: fridge,
    },
    Experiment {
        letter: 'H',
        scene: "sliding-door",
        title: "Sliding Door",
        summary: "the door of a book shelf slides past two clusters at rest",
        pairs: &[
            pair("top-part", "door", [0.000, 0.997, 0.000, 0.003], "prismatic"),
            pair("top-part", "left-part", [1.000, 0.000, 0.000, 0.000], "rigid"),
            pair("door", "left-part", [0.000, 0.997, 0.000, 0.003], "prismatic"),
        ],
        stage: sliding_door,
    },
    Experiment {
        letter: 'I',
        scene: "laptop",
        title: "Laptop",
        summary: "a laptop is moved in an arc while its screen opens",
        pairs: &[
            pair("power-supply", "keyboard", [0.000, 0.000, 0.703, 0.297], "revolute"),
            pair("power-supply", "screen", [0.000, 0.000, 0.204, 0.796], "disconnected"),
            pair("keyboard", "screen", [0.000, 0.000, 0.946, 0.054], "revolute"),
        ],
        stage: laptop,
    },
    Experiment {
        letter: 'J',
        scene: "door",
        title: "Door",
        summary: "a door opens beside a poster",
        pairs: &[pair("poster", "door", [0.000, 0.000, 1.000, 0.000], "revolute")],
        stage: door,
    },
];
