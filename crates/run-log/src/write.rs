//! Writes a valve-log.

use crate::error::Context;
use crate::{FORMAT, FORMAT_VERSION, RunLogError, atomic, h5};
use hdf5::{Group, Result as H5Result};
use log_data::{Attribute, Channel, Log, Run};
use std::collections::BTreeMap;
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
    atomic::create(path, |file| write_each(file, path, log, |_, _| Ok(())))
}

/// What is still to come of a run when its other channels are written.
#[derive(Debug, Clone, PartialEq)]
pub struct Late {
    /// Which channel.
    pub channel: Channel,
    /// Its samples, in its unit.
    pub values: Vec<f64>,
    /// Facts to be added to the run's.
    pub attributes: BTreeMap<String, Attribute>,
}

/// The same for a log of which one channel of every run is still being made: `late` waits for that of the run with this
/// index. The runs are written in order, each up to there at once. The log was checked with that channel in place.
///
/// # Errors
/// What `late` returns; [`RunLogError::Io`], [`RunLogError::Hdf5`]. Nothing is left of the file then.
pub fn write_log_with_late<E: From<RunLogError>>(
    path: &Path,
    log: &Log,
    mut late: impl FnMut(usize) -> Result<Late, E>,
) -> Result<(), E> {
    atomic::create(path, |file| {
        write_each(file, path, log, |index, group| {
            let Late { channel, values, attributes } = late(index)?;
            let put = || {
                put_attributes(group, &attributes)?;
                h5::put_column(group, channel.name(), channel.unit(), &values)
            };
            put().context(path, || format!("writing the run's {channel}"))?;
            Ok(())
        })
    })
}

/// Writes root and runs; `finish` adds to each run's group what its run does not hold.
fn write_each<E: From<RunLogError>>(
    file: &hdf5::File,
    path: &Path,
    log: &Log,
    mut finish: impl FnMut(usize, &Group) -> Result<(), E>,
) -> Result<(), E> {
    root(file, &log.title).context(path, || "writing the root's attributes".to_owned())?;
    further(file, log).context(path, || "writing the root's attributes".to_owned())?;
    let runs = file.create_group("runs").context(path, || "writing /runs".to_owned())?;
    for (index, run) in log.runs.iter().enumerate() {
        let group = write_run(&runs, run).context(path, || format!("writing run {}", run.name))?;
        finish(index, &group)?;
    }
    Ok(())
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

fn write_run(runs: &Group, run: &Run) -> H5Result<Group> {
    let group = runs.create_group(&run.name)?;
    h5::put_text(&group, "kind", &run.kind)?;
    put_attributes(&group, &run.attributes)?;
    for channel in Channel::ALL {
        // One that was taken out is not there.
        if let Some(values) = run.channel(*channel).filter(|values| values.len() == run.len()) {
            h5::put_column(&group, channel.name(), channel.unit(), values)?;
        }
    }
    for extra in &run.extra {
        h5::put_column(&group, &extra.name, &extra.unit, &extra.values)?;
    }
    Ok(group)
}

fn put_attributes(group: &Group, attributes: &BTreeMap<String, Attribute>) -> H5Result<()> {
    let further = attributes.iter().filter(|(name, _)| *name != "kind");
    further.into_iter().try_for_each(|(name, value)| h5::put_attribute(group, name, value))
}
