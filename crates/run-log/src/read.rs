//! Reads a valve-log, whoever wrote it, and believes nothing in it unchecked.

use crate::blocks::{Blocks, Part};
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

/// What a log consists of, in the order in which it is read.
#[derive(Debug, Clone, PartialEq)]
pub enum LogPart {
    /// What the log says beside its runs: a log without any.
    Log(Log),
    /// A run begins: one without samples. Its columns follow.
    Run(Run),
    /// A column begins; its samples follow.
    Column {
        /// The channel's or signal's name.
        name: String,
        /// Its unit.
        unit: String,
        /// How many samples will follow.
        samples: usize,
    },
    /// Further samples of the column.
    Samples(Vec<f64>),
}

/// Which columns of runs are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// All that are as long as their run's time.
    All,
    /// Those that models know, and those that say whether the motor carries current.
    Channels,
}

/// Reads a valve-log and checks it.
///
/// Groups and datasets that the format does not name are left out, unless they are columns of a run as long as
/// its time: those become [`Extra`]s.
///
/// # Errors
/// [`RunLogError`], which names the file, the place in it, what was found and what was expected.
pub fn read_log(path: &Path) -> Result<Log, RunLogError> {
    let mut log = Log::default();
    let mut column: Option<(String, String, Vec<f64>)> = None;
    read_log_parts(path, Wanted::All, MAX_SAMPLES, &mut |part| -> Result<(), RunLogError> {
        if let LogPart::Samples(more) = part {
            if let Some((.., values)) = &mut column {
                values.extend(more);
            }
            return Ok(());
        }
        put(&mut log, column.take());
        match part {
            LogPart::Log(begun) => log = begun,
            LogPart::Run(run) => log.runs.push(run),
            LogPart::Column { name, unit, samples } => {
                column = Some((name, unit, Vec::with_capacity(samples)))
            }
            LogPart::Samples(_) => {}
        }
        Ok(())
    })?;
    put(&mut log, column);
    log.check().map_err(|source| RunLogError::Log { path: path.to_owned(), source })?;
    Ok(log)
}

/// Signals of a run file that say whether the motor carries its current.
const ENERGISED: [&str; 2] = ["command_energise", "command_current_ratio"];

/// Adds a column to the last run.
fn put(log: &mut Log, column: Option<(String, String, Vec<f64>)>) {
    if let (Some(run), Some((name, unit, values))) = (log.runs.last_mut(), column) {
        match Channel::from_name(&name) {
            Some(channel) => run.set_channel(channel, values),
            None => run.extra.push(Extra { name, unit, values }),
        }
    }
}

/// Reads a valve-log and hands it over part by part: little of it is in memory at a time. At most `most` samples, all runs
/// and columns together. The log as a whole is not checked ([`Log::check`]).
///
/// # Errors
/// [`RunLogError`]; what `each` returns.
pub fn read_log_parts<E: From<RunLogError>>(
    path: &Path,
    wanted: Wanted,
    most: usize,
    each: &mut dyn FnMut(LogPart) -> Result<(), E>,
) -> Result<(), E> {
    let file = open(path)?;
    Reader { path, wanted, most, samples_left: most }.log(&file, each)
}

/// Opens what has to be a valve-log.
///
/// # Errors
/// A file that the system does not open, one that is no HDF5 at all, one that HDF5 can't read.
pub(crate) fn open(path: &Path) -> Result<hdf5::File, RunLogError> {
    if !h5::is_hdf5(path).context(path, String::new)? {
        let record = path.extension().is_some_and(|extension| extension == "mcap");
        let makes = if record { "convert makes of a record" } else { "import makes of a table" };
        return Err(RunLogError::Format {
            path: path.to_owned(),
            place: "the file".to_owned(),
            found: "no HDF5".to_owned(),
            expected: format!("a valve-log, which stepvalve {makes}"),
        });
    }
    h5::open(path).context(path, || "not a readable HDF5 file".to_owned())
}

struct Reader<'a> {
    path: &'a Path,
    wanted: Wanted,
    most: usize,
    samples_left: usize,
}

impl Reader<'_> {
    fn log<E: From<RunLogError>>(
        &mut self,
        file: &Group,
        each: &mut dyn FnMut(LogPart) -> Result<(), E>,
    ) -> Result<(), E> {
        each(LogPart::Log(self.root(file)?))?;
        let runs = file.group("runs").map_err(|_| self.format_error("root", "no group /runs", "one"))?;
        for name in self.members(&runs, "/runs")? {
            // A dataset beside the runs is nobody's business.
            if let Ok(group) = runs.group(&name) {
                self.run(&group, name, each)?;
            }
        }
        Ok(())
    }

    fn root(&self, file: &Group) -> Result<Log, RunLogError> {
        self.format(file)?;
        let text = |name| h5::text_attribute(file, name).context(self.path, || format!("attribute {name}"));
        let angle_zero = text("angle_zero")?.unwrap_or_else(|| AngleZero::Common.name().to_owned());
        Ok(Log {
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
        })
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

    fn run<E: From<RunLogError>>(
        &mut self,
        group: &Group,
        name: String,
        each: &mut dyn FnMut(LogPart) -> Result<(), E>,
    ) -> Result<(), E> {
        let place = format!("/runs/{name}");
        let kind =
            h5::text_attribute(group, "kind").context(self.path, || format!("{place}: attribute kind"))?;
        let attributes = self.attributes(group, &["kind"])?;
        each(LogPart::Run(Run { name, kind: kind.unwrap_or_default(), attributes, ..Run::default() }))?;
        let members = self.members(group, &place)?;
        let mut rows = 0;
        for channel in Channel::ALL {
            if members.iter().any(|member| member == channel.name()) {
                let dataset = self.channel(group, &place, *channel)?;
                if *channel == Channel::Time {
                    rows = dataset.size();
                }
                self.column(&dataset, (&place, channel.name()), channel.unit(), each)?;
            } else if matches!(channel, Channel::Time | Channel::Angle) {
                return Err(self.format_error(&place, &format!("no dataset {channel}"), "one").into());
            }
        }
        let further = members.into_iter().filter(|name| Channel::from_name(name).is_none());
        let wanted = |name: &String| self.wanted == Wanted::All || ENERGISED.contains(&name.as_str());
        for name in further.filter(wanted).collect::<Vec<_>>() {
            if let Some((dataset, unit)) = self.extra(group, &place, &name, rows)? {
                self.column(&dataset, (&place, &name), &unit, each)?;
            }
        }
        Ok(())
    }

    fn channel(&self, group: &Group, place: &str, channel: Channel) -> Result<Dataset, RunLogError> {
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
        Ok(dataset)
    }

    /// A column that models don't know, and its unit; `None` where it is none.
    fn extra(
        &self,
        group: &Group,
        place: &str,
        name: &str,
        rows: usize,
    ) -> Result<Option<(Dataset, String)>, RunLogError> {
        let Ok(dataset) = group.dataset(name) else { return Ok(None) };
        if !h5::is_numeric(&dataset) || dataset.shape() != [rows] {
            return Ok(None);
        }
        let unit = h5::text_attribute(&dataset, "unit")
            .context(self.path, || format!("{place}/{name}: attribute unit"))?;
        Ok(Some((dataset, unit.unwrap_or_else(|| "1".to_owned()))))
    }

    fn column<E: From<RunLogError>>(
        &mut self,
        dataset: &Dataset,
        (run, name): (&str, &str),
        unit: &str,
        each: &mut dyn FnMut(LogPart) -> Result<(), E>,
    ) -> Result<(), E> {
        let (place, samples) = (format!("{run}/{name}"), dataset.size());
        // Before anything is allocated: a file of a few bytes can claim any shape.
        self.samples_left = self.samples_left.checked_sub(samples).ok_or_else(|| {
            self.format_error(&place, "more samples", &format!("at most {} in a log", self.most))
        })?;
        each(LogPart::Column { name: name.to_owned(), unit: unit.to_owned(), samples })?;
        let mut blocks = Blocks::new(vec![Part::Rows(dataset.clone())]);
        while let Some(block) = blocks.read().context(self.path, || format!("reading {place}"))? {
            each(LogPart::Samples(block))?;
        }
        Ok(())
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
