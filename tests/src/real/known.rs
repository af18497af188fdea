//! What is known of the recordings.

use super::cases::{Content, Group, Truth};

/// A folder of recordings of one body each against the world.
pub(super) struct Folder {
    pub(super) name: &'static str,
    /// What its files show, unless stated for one.
    pub(super) truth: Truth,
    /// Files that show something else.
    pub(super) except: &'static [(&'static str, Truth)],
    /// How the truth is known, and what makes the recordings hard.
    pub(super) remark: &'static str,
}

/// A file whose pairs are named one by one.
pub(super) struct File {
    pub(super) name: &'static str,
    /// What pairs are called, where they are, and what they show.
    pub(super) pairs: &'static [(&'static str, Content, Truth)],
    pub(super) remark: &'static str,
}

const RIGID: Truth = Truth::Joint("rigid");
const PRISMATIC: Truth = Truth::Joint("prismatic");
const REVOLUTE: Truth = Truth::Joint("revolute");
const SPHERICAL: Truth = Truth::Joint("spherical");
const PLANAR: Truth = Truth::Joint("planar");
const DISCONNECTED: Truth = Truth::Joint("disconnected");

pub(super) const FOLDERS: [Folder; 10] = [
    Folder {
        name: "tum_kitchen_pose6d",
        truth: REVOLUTE,
        except: &[("M2U00394.log", PRISMATIC), ("M2U00407.log", PRISMATIC)],
        remark: "checkerboards on kitchen doors and drawers; truth by fits to the positions; the tracker's orientation jumps by 5 to 86 degrees in all files but 410",
    },
    Folder {
        name: "tum_points/cabinet_one",
        truth: REVOLUTE,
        except: &[],
        remark: "truth by name; the radius varies by a fifth",
    },
    Folder {
        name: "tum_points/cabinet_two",
        truth: Truth::Undecidable,
        except: &[],
        remark: "as near to a line as to a circle",
    },
    Folder {
        name: "tum_points/drawer_one",
        truth: PRISMATIC,
        except: &[],
        remark: "truth by name; in 004 the hook slips by 17 mm",
    },
    Folder { name: "tum_points/iros_dishwasher", truth: REVOLUTE, except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_drawer", truth: PRISMATIC, except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_left_door", truth: REVOLUTE, except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_right_door", truth: REVOLUTE, except: &[], remark: "truth by name" },
    Folder { name: "tum_points/microwave", truth: REVOLUTE, except: &[], remark: "truth by name" },
    Folder { name: "tum_points/sliding_cabinet", truth: PRISMATIC, except: &[], remark: "truth by name" },
];

const CHAIR: Group = ("chair", &["WheelchairL:*"]);
const WHEEL: Group = ("wheel", &["SWL:*"]);
const CHAIR_ARM: Group = ("arm", &["ArmL:*"]);
const CHAIR_FOREARM: Group = ("forearm", &["ForearmL:*"]);

const PELVIS: Group = ("pelvis", &["LPSIS", "RPSIS", "LASIS", "RASIS"]);
const THIGH: Group = ("thigh", &["RTHI1", "RTHI2", "RTHI3", "RGT", "RLFE", "RMFE"]);
const SHANK: Group = ("shank", &["RLEG1", "RLEG2", "RLEG3", "RLM", "RSPH"]);

const BOX: Group = ("box", &["boite:*"]);
const BOX_A: Group = ("box A", &["boite:gauche_ext", "boite:droite_ext", "boite:avant_gauche", "boite:arriere_droit"]);
const BOX_B: Group = ("box B", &["boite:gauche_int", "boite:droite_int", "boite:avant_droit", "boite:arriere_gauche"]);
const BOX_LINE: Group = ("line", &["boite:gauche_ext", "boite:gauche_int", "boite:droite_int", "boite:droite_ext"]);
const BOX_OTHERS: Group =
    ("others", &["boite:avant_gauche", "boite:avant_droit", "boite:arriere_droit", "boite:arriere_gauche"]);
const FOREARM: Group = ("forearm", &["Daphnee:LARMm", "Daphnee:LARMl", "Daphnee:LARM_elb", "Daphnee:LARM_ant"]);
const UPPER_ARM: Group = (
    "upper arm",
    &["Daphnee:ARMl", "Daphnee:ARMm", "Daphnee:ARMp_up", "Daphnee:ARMp_do", "Daphnee:EPICl", "Daphnee:EPICm"],
);

const HAND: Group = ("hand", &["hand_*"]);
const BACK: Group = ("back", &["back_*"]);
const PILLOW: Group = ("pillow", &["pillow_*"]);

pub(super) const FILES: &[File] = &[
    File {
        name: "tum_rect_tracker/door.txt",
        pairs: &[("", Content::PoseText, REVOLUTE)],
        remark: "a rectangle detector on a door; truth by name; very noisy, steps of 17 mm",
    },
    File {
        name: "tum_rect_tracker/tracking-1.log",
        pairs: &[("", Content::PoseText, Truth::Unknown)],
        remark: "32 points of the same detector",
    },
    File {
        name: "hrl_pr2_door/ikea_cabinet_2.pkl",
        pairs: &[("", Content::PickledPoints("ee_list"), REVOLUTE)],
        remark: "a robot's gripper pulls a cabinet door; truth by the program that recorded it, which ends at 92.7 degrees",
    },
    File {
        name: "kineticstoolkit/kinematics_basket_sprint.c3d",
        pairs: &[
            ("chair-wheel", Content::Markers(&[CHAIR, WHEEL]), REVOLUTE),
            ("arm-forearm", Content::Markers(&[CHAIR_ARM, CHAIR_FOREARM]), Truth::Unknown),
        ],
        remark: "a wheelchair's instrumented wheel, many turns; truth by its mechanics; 39 % of the samples are missing and markers are confused in some frames; the elbow is shown only",
    },
    File {
        name: "biobuddy/right_knee.c3d",
        pairs: &[
            ("thigh-shank", Content::Markers(&[THIGH, SHANK]), REVOLUTE),
            ("pelvis-thigh", Content::Markers(&[PELVIS, THIGH]), Truth::Unknown),
        ],
        remark: "a knee bent for calibration: nearly a hinge (1.7 mm, 2.5 degrees), markers on skin; the hip is shown only",
    },
    File {
        name: "pyomeca/markers_analogs.c3d",
        pairs: &[
            ("box A-box B", Content::Markers(&[BOX_A, BOX_B]), RIGID),
            ("box-forearm", Content::Markers(&[BOX, FOREARM]), DISCONNECTED),
            ("line-forearm", Content::Markers(&[BOX_LINE, FOREARM]), Truth::Not("revolute")),
            ("line-others", Content::Markers(&[BOX_LINE, BOX_OTHERS]), Truth::Not("revolute")),
            ("forearm-upper arm", Content::Markers(&[FOREARM, UPPER_ARM]), Truth::Unknown),
        ],
        remark: "a person carries a box; its markers, halved, are rigid to 0.15 mm; four of them (`line`) lie on one line, and taken as a body of their own make a false revolute joint about it; the elbow is shown only",
    },
    File {
        name: "hand_embodiment/recording.tsv",
        pairs: &[
            ("hand-back", Content::Markers(&[HAND, BACK]), DISCONNECTED),
            ("hand-pillow", Content::Markers(&[HAND, PILLOW]), DISCONNECTED),
            ("back-pillow", Content::Markers(&[BACK, PILLOW]), DISCONNECTED),
            ("pillow", Content::Markers(&[PILLOW]), Truth::Unknown),
        ],
        remark: "a person grasps a pillow that lies on a table nearly still; truth by what is shown",
    },
    File {
        name: "lias_trolley/motion_capture_dynamic_exp_fast.csv",
        pairs: &[("", Content::Trolley, PLANAR)],
        remark: "a trolley driven over a floor (2.2 mm, 0.5 degrees); one jump of 0.2 m, 173 repeated frames",
    },
    File {
        name: "ndi_pivot/data.mat",
        pairs: &[("", Content::Mat("pointerData"), SPHERICAL)],
        remark: "a pointer turned about its resting tip for calibration (0.4 mm)",
    },
    File {
        name: "plus_tracker/WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha",
        pairs: &[
            ("Reference-Stylus", Content::Mha(&["Reference", "Stylus"]), RIGID),
            ("Reference-Probe", Content::Mha(&["Reference", "Probe"]), Truth::Unknown),
            ("Probe", Content::Mha(&["Probe"]), Truth::Unknown),
        ],
        remark: "two clamped tools, rigid by measurement (0.08 mm, 0.1 degrees), and a probe moved by hand, roughly up and down",
    },
    File {
        name: "champ_artags/artic_data.txt",
        pairs: &[
            ("list 2", Content::PickledPoses(2), Truth::Unknown),
            ("list 3", Content::PickledPoses(3), Truth::Unknown),
        ],
        remark: "poses of tags relative to each other while a robot handles an object whose joint changes; list 3 is the inverse of list 2: turns of 158 degrees about one axis, 6 mm and 2 degrees from it",
    },
    File {
        name: "opensim/walking5.c3d",
        pairs: &[
            ("left knee", Content::Markers(&[("thigh", &["LTH?"]), ("shank", &["LTB?"])]), Truth::Unknown),
            ("right knee", Content::Markers(&[("thigh", &["RTH?"]), ("shank", &["RTB?"])]), Truth::Unknown),
        ],
        remark: "walking; markers on skin, 45 % missing",
    },
    File {
        name: "kineticstoolkit/c3d_test_suite/pc_real.c3d",
        pairs: &[("right knee", Content::Markers(&[("thigh", &["RTH?"]), ("shank", &["RSK?"])]), Truth::Unknown)],
        remark: "walking; 89 frames, the same in six encodings",
    },
    File {
        name: "kineticstoolkit/c3d_test_suite/Eb015pi.c3d",
        pairs: &[("right knee", Content::Markers(&[("thigh", &["RTH?"]), ("shank", &["RSK?"])]), Truth::Unknown)],
        remark: "walking; markers on plates",
    },
];
