//! All joint models that a program knows.

use std::collections::BTreeMap;

use crate::JointModelPlugin;

/// The joint models that are linked into a program, sorted by name.
#[derive(Debug, Clone)]
pub struct Catalog(BTreeMap<&'static str, &'static JointModelPlugin>);

/// Why the linked models form no catalog.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogError {
    /// Two models have one name.
    #[error(
        "two joint models are named `{name}`: one from {first}, one from {second}; rename one, or link only one of the crates"
    )]
    Duplicate {
        /// The name.
        name: String,
        /// Crate and version of one.
        first: String,
        /// Crate and version of the other.
        second: String,
    },
}

impl Catalog {
    /// Every model that is linked into this program.
    ///
    /// # Errors
    /// [`CatalogError::Duplicate`].
    pub fn linked() -> Result<Self, CatalogError> {
        Self::of(inventory::iter::<JointModelPlugin>)
    }

    /// A catalog of chosen models.
    ///
    /// # Errors
    /// [`CatalogError::Duplicate`].
    pub fn of(plugins: impl IntoIterator<Item = &'static JointModelPlugin>) -> Result<Self, CatalogError> {
        let mut catalog = BTreeMap::new();
        for plugin in plugins {
            if let Some(other) = catalog.insert(plugin.name, plugin) {
                // Link order is arbitrary; the message is not.
                let mut origins = [other, plugin].map(|p| format!("{} {}", p.origin.package, p.origin.version));
                origins.sort();
                let [first, second] = origins;
                return Err(CatalogError::Duplicate { name: plugin.name.into(), first, second });
            }
        }
        Ok(Self(catalog))
    }

    /// The model of a name.
    pub fn get(&self, name: &str) -> Option<&'static JointModelPlugin> {
        self.0.get(name).copied()
    }

    /// All names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.keys().copied()
    }

    /// All models, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = &'static JointModelPlugin> {
        self.0.values().copied()
    }
}
