//! Recipes: how a kind of table is imported, kept in a file, so that the next record needs one word.

use super::mapping::Mapping;
use crate::files::{self, name};
use anyhow::{Context, anyhow};
use std::path::Path;
use supervisor::Failure;

const FORMAT: &str = "stepvalve-recipe";
const FORMAT_VERSION: i64 = 1;

/// Reads a recipe.
///
/// # Errors
/// [`Failure::Input`] where it can't be read, or with file, line and column where it is wrong.
pub(super) fn read(file: &Path) -> Result<Mapping, Failure> {
    let text = files::read(file)?;
    let mapping: Mapping = toml::from_str(&text).map_err(|error| {
        let (line, column) = position(&text, error.span().map_or(0, |span| span.start));
        Failure::Input(anyhow!("{}:{line}:{column}: {}", name(file), error.message()))
    })?;
    let (format, version) = (mapping.format.as_deref(), mapping.format_version);
    if (format, version) != (Some(FORMAT), Some(FORMAT_VERSION)) {
        let found = format!("format {} {}", format.unwrap_or("none"), version.unwrap_or_default());
        let expected = format!("format = \"{FORMAT}\" and format_version = {FORMAT_VERSION}");
        return Err(Failure::Input(anyhow!("{}: found {found}, expected {expected}", name(file))));
    }
    Ok(mapping)
}

/// Writes a recipe, whole or not at all.
///
/// # Errors
/// [`Failure::Failed`] where the system refuses.
pub(super) fn write(file: &Path, mapping: &Mapping) -> Result<(), Failure> {
    let mapping =
        Mapping { format: Some(FORMAT.to_owned()), format_version: Some(FORMAT_VERSION), ..mapping.clone() };
    let text = toml::to_string(&mapping).context("the recipe")?;
    Ok(whole_file::write(file, text).with_context(|| name(file))?)
}

/// Line and column of a byte, both from 1.
fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}
