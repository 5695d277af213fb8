//! Writes a valve-log.

use crate::error::Context;
use crate::{FORMAT, FORMAT_VERSION, RunLogError, atomic, h5};
use hdf5::{Group, Result as H5Result};
use log_data::{Channel, Log, Run};
use std::path::Path;

/// The root's attributes that the format itself defines.
pub(crate) const ROOT_ATTRIBUTES: [&str; 5] =
    ["format", "format_version", "title", "provenance", "angle_zero"];

/// Writes a log, checked first. The file appears under its name when it is whole; one that was there is replaced.
///
/// # Errors
/// [`RunLogError::Log`] where the log breaks a rule; [`RunLogError::Io`] and [`RunLogError::Hdf5`].
pub fn write_log(path: &Path, log: &Log) -> Result<(), RunLogError> {
    log.check().map_err(|source| RunLogError::Log { path: path.to_owned(), source })?;
    if let Some(name) = log.attributes.keys().find(|name| ROOT_ATTRIBUTES.contains(&name.as_str())) {
        return Err(RunLogError::Format {
            path: path.to_owned(),
            place: "root".to_owned(),
            found: format!("a further attribute named {name}"),
            expected: "a name that the format does not use".to_owned(),
        });
    }
    atomic::create(path, |file| {
        root(file, &log.title).context(path, || "writing the root's attributes".to_owned())?;
        further(file, log).context(path, || "writing the root's attributes".to_owned())?;
        let runs = file.create_group("runs").context(path, || "writing /runs".to_owned())?;
        for run in &log.runs {
            write_run(&runs, run).context(path, || format!("writing run {}", run.name))?;
        }
        Ok(())
    })
}

/// What every valve-log begins with.
pub(crate) fn root(file: &Group, title: &str) -> H5Result<()> {
    h5::put_text(file, "format", FORMAT)?;
    h5::put_number(file, "format_version", FORMAT_VERSION)?;
    h5::put_text(file, "title", title)
}

fn further(file: &Group, log: &Log) -> H5Result<()> {
    if let Some(provenance) = &log.provenance {
        h5::put_text(file, "provenance", provenance)?;
    }
    h5::put_text(file, "angle_zero", log.angle_zero.name())?;
    log.attributes.iter().try_for_each(|(name, value)| h5::put_attribute(file, name, value))
}

fn write_run(runs: &Group, run: &Run) -> H5Result<()> {
    let group = runs.create_group(&run.name)?;
    h5::put_text(&group, "kind", &run.kind)?;
    for (name, value) in run.attributes.iter().filter(|(name, _)| *name != "kind") {
        h5::put_attribute(&group, name, value)?;
    }
    for channel in Channel::ALL {
        if let Some(values) = run.channel(*channel) {
            h5::put_column(&group, channel.name(), channel.unit(), values)?;
        }
    }
    for extra in &run.extra {
        h5::put_column(&group, &extra.name, &extra.unit, &extra.values)?;
    }
    Ok(())
}
