//! The model of a diagnosis, with the numbers that the caller knows exactly.

use crate::files::{self, name};
use std::path::Path;
use study::Fixed;
use supervisor::Failure;

/// Reads a model, sets numbers that are known exactly, and says which effects are no question then.
///
/// # Errors
/// [`Failure::Input`] where the model can't be read, has no such number, or not with such a value.
pub fn read(file: &Path, fixes: &[String]) -> Result<Fixed, Failure> {
    study::fixed(&files::read(file)?, &name(file), fixes).map_err(Failure::Input)
}
