//! When the type of a joint is right.

/// The eight types that can be told apart.
pub const TYPES: [&str; 8] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "spherical", "disconnected"];

/// The four classes in which any method can be scored: rigid, prismatic, revolute, and other for all the rest.
pub fn class(joint: &str) -> &'static str {
    ["rigid", "prismatic", "revolute"].into_iter().find(|class| *class == joint).unwrap_or("other")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_not_rigid_prismatic_or_revolute_is_other() {
        let classes = TYPES.map(class);
        assert_eq!(classes, ["rigid", "prismatic", "revolute", "other", "other", "other", "other", "other"]);
        assert_eq!([class("elliptical"), class("common-centre"), class("")], ["other"; 3]);
    }
}
