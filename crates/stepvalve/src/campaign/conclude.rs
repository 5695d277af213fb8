//! The end of a campaign: table, page, and what is said of both.

use super::keep::worst;
use super::page;
use super::row_file::{PAGE, TABLE};
use crate::files::name;
use crate::say::say;
use ::campaign::{Campaign, Column, Row, Values, columns};
use anyhow::Context;
use run_log::{TableColumn, TableFile, TableValues, write_table};
use std::path::Path;
use supervisor::Failure;

/// Writes `campaign.h5` and `campaign.html` of all rows, which are in the order of their runs.
///
/// # Errors
/// Where writing fails.
pub fn conclude(campaign: &Campaign, rows: &[Row], folder: &Path) -> Result<(), Failure> {
    write(campaign, rows, &folder.join(TABLE))?;
    let path = folder.join(PAGE);
    whole_file::write(&path, page::page(campaign, rows).to_html()).with_context(|| name(&path))?;
    say(format_args!("{}: {}", campaign.plan().name, page::headline(rows)));
    for row in worst(rows, 1) {
        say(format_args!("worst: run {}, {}", row.run, page::how_bad(row)));
    }
    say(format_args!("{}, with {TABLE}", name(&path)));
    Ok(())
}

fn write(campaign: &Campaign, rows: &[Row], path: &Path) -> Result<(), Failure> {
    let columns = columns(campaign, rows);
    let mut texts = vec![("plan".to_owned(), "text", campaign.source().text.as_str())];
    for (base, number) in campaign.bases().zip(1..) {
        let group = format!("scenario-{number}");
        for (name, source) in [("scenario", &base.scenario), ("truth", &base.truth), ("belief", &base.belief)]
        {
            texts.push((group.clone(), name, source.text.as_str()));
        }
    }
    let table = TableFile {
        format: "stepvalve-campaign-table",
        format_version: 1,
        attributes: vec![
            ("title", &campaign.plan().name),
            ("provenance", "stepvalve campaign"),
            ("program_version", env!("CARGO_PKG_VERSION")),
        ],
        texts,
        group: "rows",
        columns: columns.iter().map(column).collect(),
    };
    Ok(write_table(path, &table).map_err(anyhow::Error::from)?)
}

fn column(column: &Column) -> TableColumn<'_> {
    let values = match &column.values {
        Values::Numbers(values) => TableValues::Numbers(values),
        Values::Counts(values) => TableValues::Counts(values),
        Values::Texts(values) => TableValues::Texts(values.iter().map(String::as_str).collect()),
    };
    TableColumn { name: &column.name, unit: &column.unit, values }
}
