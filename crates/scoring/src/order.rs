//! The order in which joints stand in results.

/// The simple joints first and free motion last; others stand before free motion, by name.
const ORDER: [&str; 9] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "universal", "spherical", "elliptical"];

/// A joint's place.
pub(crate) fn place(name: &str) -> (usize, String) {
    let last = ["disconnected", "free"].contains(&name);
    (ORDER.iter().position(|known| *known == name).unwrap_or(ORDER.len() + usize::from(last)), name.to_owned())
}
