//! Why recordings come out as they should not.

/// Every miss of the likelihood models, by the name of its case, and why it happens.
pub const EXPLANATIONS: &[(&str, &str)] = &[
    (
        "tum_points/drawer_one/004.log",
        "the hook slips while it pulls: its path leaves the line by 17 mm, 3.7 % of the travel, in one smooth bow, which \
         is nearer to an arc than to the play of a slide; nothing is determined",
    ),
    (
        "tum_rect_tracker/door.txt",
        "the rectangle's pose is wrong by several degrees and jumps by 17 mm from frame to frame; both have to be \
         explained as motion, and no joint of one freedom does; nothing is determined",
    ),
];
