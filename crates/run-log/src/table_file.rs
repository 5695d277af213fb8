//! A table that is no run: columns with units, texts that it was made of, and attributes.

use crate::error::Context;
use crate::{RunLogError, atomic, h5};
use std::path::Path;

/// What a table's file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableFile<'t> {
    /// Root attribute `format`.
    pub format: &'t str,
    /// Root attribute `format_version`.
    pub format_version: i64,
    /// Further texts as root attributes: name and text, each below 64 kB.
    pub attributes: Vec<(&'t str, &'t str)>,
    /// Texts as datasets, in groups: group, name and text.
    pub texts: Vec<(String, &'t str, &'t str)>,
    /// The group of the columns.
    pub group: &'t str,
    /// Its columns.
    pub columns: Vec<TableColumn<'t>>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct TableColumn<'t> {
    /// Its name.
    pub name: &'t str,
    /// Its unit; none of a text.
    pub unit: &'t str,
    /// Its values.
    pub values: TableValues<'t>,
}

/// A column's values, one a row.
#[derive(Debug, Clone, PartialEq)]
pub enum TableValues<'t> {
    /// Numbers, NaN where missing.
    Numbers(&'t [f64]),
    /// Counts.
    Counts(&'t [u64]),
    /// Texts.
    Texts(Vec<&'t str>),
}

/// Writes a table. The file appears under its name when it is whole; one that was there is replaced.
///
/// # Errors
/// [`RunLogError::Io`] and [`RunLogError::Hdf5`].
pub fn write_table(path: &Path, table: &TableFile<'_>) -> Result<(), RunLogError> {
    atomic::create(path, |file| fill(file, table).context(path, || "writing the table".to_owned()))
}

fn fill(file: &hdf5::File, table: &TableFile<'_>) -> hdf5::Result<()> {
    h5::put_text(file, "format", table.format)?;
    h5::put_number(file, "format_version", table.format_version)?;
    table.attributes.iter().try_for_each(|(name, text)| h5::put_text(file, name, text))?;
    for (group, name, text) in &table.texts {
        let place = file.group(group).or_else(|_| file.create_group(group))?;
        h5::put_text_dataset(&place, name, text)?;
    }
    let group = file.create_group(table.group)?;
    for TableColumn { name, unit, values } in &table.columns {
        match values {
            TableValues::Numbers(values) => drop(h5::put_column(&group, name, unit, values)?),
            TableValues::Counts(values) => drop(h5::put_column(&group, name, unit, values)?),
            TableValues::Texts(values) => h5::put_texts(&group, name, values)?,
        }
    }
    Ok(())
}
