//! The end of a campaign: table, page, and what is said of both.

use super::keep::worst;
use super::page;
use super::row_file::{PAGE, TABLE};
use crate::files::name;
use crate::say::say;
use ::campaign::{Campaign, Column, Row, Values, columns};
use anyhow::{Context, anyhow};
use run_log::{TableColumn, TableFile, TableValues, write_table};
use std::path::Path;
use supervisor::Failure;

/// Writes `campaign.h5` and `campaign.html` of all rows, which are in the order of their runs, and were made by this version of the program.
///
/// # Errors
/// Where writing fails.
pub fn conclude(campaign: &Campaign, version: &str, rows: &[Row], folder: &Path) -> Result<(), Failure> {
    write((campaign, version), rows, &folder.join(TABLE))?;
    let path = folder.join(PAGE);
    whole_file::write(&path, page::page(campaign, version, rows).to_html()).with_context(|| name(&path))?;
    say(format_args!("{}: {}", campaign.plan().name, page::headline(rows)));
    for row in worst(rows.iter(), 1) {
        say(format_args!("worst: run {}, {}", row.run, page::how_bad(row)));
    }
    say(format_args!("{}, with {TABLE}", name(&path)));
    Ok(())
}

/// Refuses rows of which more failed than the plan allows.
///
/// # Errors
/// [`Failure::Failed`].
pub fn refuse_failures(campaign: &Campaign, rows: &[Row], path: &Path) -> Result<(), Failure> {
    let failed: Vec<(u64, &::campaign::Failure)> =
        rows.iter().filter_map(|row| Some((row.run, row.failure.as_ref()?))).collect();
    match failed.last() {
        Some(last) if failed.len() as u64 > campaign.failures_allowed() => {
            Err(too_many(campaign, failed.len() as u64, *last, path))
        }
        _ => Ok(()),
    }
}

/// The failure of a campaign of which too many runs failed.
pub fn too_many(
    campaign: &Campaign,
    failed: u64,
    (run, failure): (u64, &::campaign::Failure),
    path: &Path,
) -> Failure {
    Failure::Failed(anyhow!(
        "found {failed} runs that failed, expected at most {} (failure_limit); run {run} {}: {}. The rows are in {}",
        campaign.failures_allowed(),
        failure.stage.name(),
        failure.reason,
        name(path)
    ))
}

/// Whatever the limit: a campaign of which no run could be made is no result.
///
/// # Errors
/// [`Failure::Failed`].
pub fn refuse_all_failed(campaign: &Campaign, rows: &[Row], folder: &Path) -> Result<(), Failure> {
    let Some(failure) = rows.first().and_then(|row| row.failure.as_ref()) else { return Ok(()) };
    if rows.iter().any(|row| row.failure.is_none()) {
        return Ok(());
    }
    Err(Failure::Failed(anyhow!(
        "{}: found that all {} runs failed, expected some that don't; the first {}: {}",
        name(&folder.join(PAGE)),
        campaign.runs(),
        failure.stage.name(),
        failure.reason
    )))
}

fn write((campaign, version): (&Campaign, &str), rows: &[Row], path: &Path) -> Result<(), Failure> {
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
            ("program_version", version),
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
