//! Reads a valve-log, whoever wrote it, and believes nothing in it unchecked.

use crate::error::Context;
use crate::write::ROOT_ATTRIBUTES;
use crate::{FORMAT, FORMAT_VERSION, RunLogError, h5};
use hdf5::{Dataset, Group, Location};
use log_data::{AngleZero, Attribute, Channel, Extra, Log, Run};
use std::collections::BTreeMap;
use std::path::Path;

/// More runs, or datasets and attributes of one run, than this are refused.
const MAX_MEMBERS: u64 = 10_000;
/// More samples than this, all runs and channels together, are refused: they take 2 GB of memory.
const MAX_SAMPLES: usize = 250_000_000;

/// Reads a valve-log and checks it.
///
/// Groups and datasets that the format does not name are left out, unless they are columns of a run as long as
/// its time: those become [`Extra`]s.
///
/// # Errors
/// [`RunLogError`], which names the file, the place in it, what was found and what was expected.
pub fn read_log(path: &Path) -> Result<Log, RunLogError> {
    let opened = std::fs::File::open(path).context(path, String::new)?;
    drop(opened);
    let file = h5::open(path).context(path, || "not a readable HDF5 file".to_owned())?;
    let mut reader = Reader { path, samples_left: MAX_SAMPLES };
    let log = reader.log(&file)?;
    log.check().map_err(|source| RunLogError::Log { path: path.to_owned(), source })?;
    Ok(log)
}

struct Reader<'a> {
    path: &'a Path,
    samples_left: usize,
}

impl Reader<'_> {
    fn log(&mut self, file: &Group) -> Result<Log, RunLogError> {
        self.format(file)?;
        let text = |name| h5::text_attribute(file, name).context(self.path, || format!("attribute {name}"));
        let angle_zero = text("angle_zero")?.unwrap_or_else(|| AngleZero::Common.name().to_owned());
        let mut log = Log {
            title: text("title")?.unwrap_or_default(),
            provenance: text("provenance")?,
            angle_zero: AngleZero::from_name(&angle_zero).ok_or_else(|| {
                self.format_error(
                    "attribute angle_zero",
                    &format!("{angle_zero:?}"),
                    "\"common\" or \"per-run\"",
                )
            })?,
            attributes: self.attributes(file, &ROOT_ATTRIBUTES)?,
            runs: Vec::new(),
        };
        let runs = file.group("runs").map_err(|_| self.format_error("root", "no group /runs", "one"))?;
        for name in self.members(&runs, "/runs")? {
            // A dataset beside the runs is nobody's business.
            if let Ok(group) = runs.group(&name) {
                log.runs.push(self.run(&group, name)?);
            }
        }
        Ok(log)
    }

    fn format(&self, file: &Group) -> Result<(), RunLogError> {
        let found =
            h5::text_attribute(file, "format").context(self.path, || "attribute format".to_owned())?;
        if found.as_deref() != Some(FORMAT) {
            let found = found.map_or("none".to_owned(), |found| format!("{found:?}"));
            return Err(self.format_error("attribute format", &found, &format!("{FORMAT:?}")));
        }
        let version = file.attr("format_version").and_then(|attribute| h5::number_of(&attribute));
        match version.ok().flatten() {
            Some(version) if version == FORMAT_VERSION as f64 => Ok(()),
            found => {
                let found = found.map_or("none".to_owned(), |found| found.to_string());
                Err(self.format_error("attribute format_version", &found, &FORMAT_VERSION.to_string()))
            }
        }
    }

    fn run(&mut self, group: &Group, name: String) -> Result<Run, RunLogError> {
        let place = format!("/runs/{name}");
        let kind =
            h5::text_attribute(group, "kind").context(self.path, || format!("{place}: attribute kind"))?;
        let attributes = self.attributes(group, &["kind"])?;
        let mut run = Run { name, kind: kind.unwrap_or_default(), attributes, ..Run::default() };
        let members = self.members(group, &place)?;
        for channel in Channel::ALL {
            if members.iter().any(|member| member == channel.name()) {
                run.set_channel(*channel, self.channel(group, &place, *channel)?);
            } else if matches!(channel, Channel::Time | Channel::Angle) {
                return Err(self.format_error(&place, &format!("no dataset {channel}"), "one"));
            }
        }
        for name in members.into_iter().filter(|name| Channel::from_name(name).is_none()) {
            run.extra.extend(self.extra(group, &place, name, run.len())?);
        }
        Ok(run)
    }

    fn channel(&mut self, group: &Group, place: &str, channel: Channel) -> Result<Vec<f64>, RunLogError> {
        let place = format!("{place}/{channel}");
        let dataset =
            group.dataset(channel.name()).context(self.path, || format!("{place} is no dataset"))?;
        if !h5::is_numeric(&dataset) || dataset.ndim() != 1 {
            let kind = if h5::is_numeric(&dataset) { "numbers" } else { "something else" };
            let found = format!("{kind} of {} dimensions", dataset.ndim());
            return Err(self.format_error(&place, &found, "one column of float64"));
        }
        let unit =
            h5::text_attribute(&dataset, "unit").context(self.path, || format!("{place}: attribute unit"))?;
        if unit.as_deref() != Some(channel.unit()) {
            let found = unit.map_or("no unit".to_owned(), |unit| format!("unit {unit:?}"));
            return Err(self.format_error(&place, &found, &format!("unit {:?}", channel.unit())));
        }
        self.values(&dataset, &place)
    }

    fn extra(
        &mut self,
        group: &Group,
        place: &str,
        name: String,
        rows: usize,
    ) -> Result<Option<Extra>, RunLogError> {
        let Ok(dataset) = group.dataset(&name) else { return Ok(None) };
        if !h5::is_numeric(&dataset) || dataset.shape() != [rows] {
            return Ok(None);
        }
        let place = format!("{place}/{name}");
        let unit =
            h5::text_attribute(&dataset, "unit").context(self.path, || format!("{place}: attribute unit"))?;
        let values = self.values(&dataset, &place)?;
        Ok(Some(Extra { name, unit: unit.unwrap_or_else(|| "1".to_owned()), values }))
    }

    fn values(&mut self, dataset: &Dataset, place: &str) -> Result<Vec<f64>, RunLogError> {
        // Before anything is allocated: a file of a few bytes can claim any shape.
        self.samples_left = self.samples_left.checked_sub(dataset.size()).ok_or_else(|| {
            self.format_error(place, "more samples", &format!("at most {MAX_SAMPLES} in a log"))
        })?;
        dataset.read_raw::<f64>().context(self.path, || format!("reading {place}"))
    }

    fn attributes(
        &self,
        place: &Location,
        known: &[&str],
    ) -> Result<BTreeMap<String, Attribute>, RunLogError> {
        let doing = || "reading attributes".to_owned();
        let mut attributes = BTreeMap::new();
        let names = place.attr_names().context(self.path, doing)?;
        for name in
            names.into_iter().filter(|name| !known.contains(&name.as_str())).take(MAX_MEMBERS as usize)
        {
            let attribute = place.attr(&name).context(self.path, doing)?;
            if let Some(text) = h5::text_of(&attribute).context(self.path, doing)? {
                attributes.insert(name, Attribute::Text(text));
            } else if let Some(number) = h5::number_of(&attribute).context(self.path, doing)? {
                attributes.insert(name, Attribute::Number(number));
            }
        }
        Ok(attributes)
    }

    fn members(&self, group: &Group, place: &str) -> Result<Vec<String>, RunLogError> {
        if group.len() > MAX_MEMBERS {
            let found = format!("{} members", group.len());
            return Err(self.format_error(place, &found, &format!("at most {MAX_MEMBERS}")));
        }
        group.member_names().context(self.path, || format!("reading {place}"))
    }

    fn format_error(&self, place: &str, found: &str, expected: &str) -> RunLogError {
        RunLogError::Format {
            path: self.path.to_owned(),
            place: place.to_owned(),
            found: found.to_owned(),
            expected: expected.to_owned(),
        }
    }
}
