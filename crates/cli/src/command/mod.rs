//! The commands, one file each.

pub(crate) mod models;
pub(crate) mod reproduce;
pub(crate) mod run;
pub(crate) mod simulate;

use jointscope_models::Catalog;

use crate::failure::Failure;

/// The linked joint models; two of one name are a fault of how the program was put together.
fn catalog() -> Result<Catalog, Failure> {
    Catalog::linked().map_err(Failure::usage)
}
