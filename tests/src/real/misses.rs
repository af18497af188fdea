//! Why recordings come out as they should not.

/// Every miss of the likelihood models, by the name of its case, and why it happens.
pub const EXPLANATIONS: &[(&str, &str)] = &[];
