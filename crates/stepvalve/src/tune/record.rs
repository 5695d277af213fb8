//! Records of a valve, as logs: folders of runs, run files, segments of a record.

use super::Source;
use crate::diagnose::{fix, logs};
use crate::files::{self, names, segments};
use anyhow::{Context, anyhow};
use config::parse_scenario;
use recording::RecordInfo;
use std::path::{Path, PathBuf};
use study::Fixed;
use supervisor::Failure;

/// What records say, and the belief: the one given, else the one that the first record carries.
///
/// # Errors
/// [`Failure::Input`] where a record can't be read, or no belief is known.
pub(super) fn source(
    records: &[PathBuf],
    belief: Option<&Path>,
    fixes: &[String],
) -> Result<Source, Failure> {
    records.iter().try_for_each(|record| has_an_encoder(record))?;
    let folder = tempfile::tempdir().context("a folder for run files").map_err(Failure::Failed)?;
    let logs: Vec<PathBuf> = records
        .iter()
        .enumerate()
        .map(|(place, record)| run_file(record, folder.path(), place))
        .collect::<Result<_, _>>()?;
    let log = logs::read(&logs, &[])?;
    let Fixed { model: belief, effects: fixed } = match belief {
        Some(file) => fix::read(file, fixes)?,
        None => carried(records, fixes)?,
    };
    Ok(Source { log, belief, fixed, of: names(records) })
}

fn is_segment(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "mcap")
}

/// The run file of a record; segments are converted.
fn run_file(record: &Path, folder: &Path, place: usize) -> Result<PathBuf, Failure> {
    if record.is_dir() {
        if let Ok(run) = files::run_file(record) {
            return Ok(run);
        }
    } else if !is_segment(record) {
        return Ok(record.to_owned());
    }
    let converted = folder.join(format!("record-{place}.h5"));
    let segments = segments(&[record.to_owned()])?;
    run_log::convert(&segments, &converted).map_err(Failure::input)?;
    Ok(converted)
}

/// What the segments of a record, or those beside it, say that they are of.
fn info_of(record: &Path) -> Option<RecordInfo> {
    let here = if record.is_dir() { record } else { record.parent()? };
    let segments =
        if is_segment(record) { vec![record.to_owned()] } else { segments(&[here.to_owned()]).ok()? };
    recording::read_info(segments.first()?).ok()
}

/// Refuses a record whose angle no encoder measured: it is the simulator's own.
fn has_an_encoder(record: &Path) -> Result<(), Failure> {
    let scenario =
        info_of(record).and_then(|info| parse_scenario(&info.texts.scenario, "the record's scenario").ok());
    if scenario.is_some_and(|scenario| !scenario.encoder.fitted) {
        return Err(Failure::Input(anyhow!(
            "{}: no encoder is fitted, so that its angle is the simulator's own, and the command alone says nothing of friction",
            record.display()
        )));
    }
    Ok(())
}

/// The belief that the first record with segments carries.
fn carried(records: &[PathBuf], fixes: &[String]) -> Result<Fixed, Failure> {
    let Some(info) = records.iter().find_map(|record| info_of(record)) else {
        return Err(Failure::Input(anyhow!(
            "{}: no record (.mcap) that carries a belief is beside it: give --belief MODEL.toml",
            names(records)
        )));
    };
    study::fixed(&info.texts.belief, "the record's belief", fixes).map_err(Failure::Input)
}
