//! Tables of numbers to runs of a log.

use anyhow::{Context, Result, bail};
use log_data::Run;
use matfile::{MatFile, NumericData};
use std::path::Path;

/// A run whose clock begins after the last one's end.
pub fn placed(mut run: Run, runs: &[Run]) -> Run {
    /// Between two runs, s.
    const GAP_S: f64 = 60.0;
    run.shift(runs.last().map_or(0.0, |last| last.end_s() + GAP_S) - run.start_s());
    run
}

/// The columns of a text table: lines that hold anything but numbers are left out.
pub fn columns(path: &Path, separator: char) -> Result<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let row = |line: &str| line.split(separator).map(|cell| cell.trim().parse().ok()).collect();
    let rows: Vec<Vec<f64>> = text.lines().filter_map(row).collect();
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 || rows.iter().any(|row| row.len() != width) {
        bail!("{}: expected rows of {width} numbers", path.display());
    }
    Ok((0..width).map(|column| rows.iter().filter_map(|row| row.get(column)).copied().collect()).collect())
}

/// A MAT file's array of that name (v5), column by column.
pub fn array(path: &Path, name: &str) -> Result<Vec<f64>> {
    let context = || path.display().to_string();
    let file = std::fs::File::open(path).with_context(context)?;
    let mat = MatFile::parse(file).map_err(|error| anyhow::anyhow!("{}: {error:?}", path.display()))?;
    let array = mat.find_by_name(name).with_context(|| format!("{}: no array {name}", path.display()))?;
    match array.data() {
        NumericData::Double { real, .. } => Ok(real.clone()),
        other => bail!("{}: {name} is {other:?}, expected doubles", path.display()),
    }
}

/// The files of a folder in the order of their names.
pub fn files(folder: &Path, ending: &str) -> Result<Vec<std::path::PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|found| found == ending));
    files.sort();
    Ok(files)
}

/// A file's name without its ending.
pub fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}
