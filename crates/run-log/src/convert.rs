//! A record of the loop becomes `run.h5`.

use crate::error::Context;
use crate::messages::Messages;
use crate::{RunLogError, atomic, runs, tables, write};
use recording::{Report, read_record};
use std::path::Path;

/// What a conversion made.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Rows of each run, in their order: one run for each start of the instance. A row is a cycle.
    pub cycles: Vec<u64>,
    /// What reading the record showed: info, gaps, damage.
    pub report: Report,
}

/// Turns a record, its segments in order, into a run file: a valve-log with `/messages`, `/timing`, `/gaps`, the
/// texts it was run from and the facts of the machine beside its runs.
///
/// The same record gives the same bytes: nothing in the file tells when it was written. Memory: a block of
/// each topic's rows while reading, then a few columns.
///
/// # Errors
/// [`RunLogError`]; no file, or the one that was there before, is then left.
pub fn convert<P: AsRef<Path>>(segments: &[P], out: &Path) -> Result<Summary, RunLogError> {
    atomic::create(out, |file| {
        let doing = |what: &'static str| move || format!("writing {what}");
        let mut messages = Messages::new(file).context(out, doing("/messages"))?;
        let mut added = Ok(());
        let report = read_record(segments, |message| {
            if added.is_ok() {
                added = messages.add(message);
            }
        })?;
        added.and_then(|()| messages.finish()).context(out, doing("/messages"))?;
        let spans = runs::write(file, &report.info).context(out, doing("/runs"))?;
        if spans.is_empty() {
            let path = segments.first().map(|path| path.as_ref().to_owned()).unwrap_or_default();
            return Err(RunLogError::NoCycles { path });
        }
        write::root(file, &report.info.title).context(out, doing("the root's attributes"))?;
        tables::root(file, &report).context(out, doing("the root's attributes"))?;
        tables::origin(file, &report.info).context(out, doing("the scenario and the models"))?;
        tables::timing(file, &report).context(out, doing("/timing"))?;
        tables::gaps(file, &report.gaps).context(out, doing("/gaps"))?;
        tables::notes(file, &report).context(out, doing("/notes"))?;
        Ok(Summary { cycles: spans.iter().map(|span| span.rows() as u64).collect(), report })
    })
}
