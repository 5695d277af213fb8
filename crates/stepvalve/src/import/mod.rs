//! `stepvalve import`: tables from elsewhere (CSV, MAT) become a valve-log.

mod mat;

pub use mat::{ReadMat, read_mat};

use crate::files::name;
use crate::say::say;
use anyhow::{Context, anyhow};
use indicatif::ProgressBar;
use log_data::{AngleZero, Log, Run};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};
use table_import::{Format, Header, Limits, Map, Rows, Separated, Separator, Table, collect};

/// More numbers than this, all runs and channels together, are refused: they take 2 GB of memory.
pub const MAX_NUMBERS: usize = 250_000_000;

/// What to import, and how.
#[derive(clap::Args)]
pub struct Arguments {
    /// Tables, a run each: MAT files (.mat, v5 or v7.3), anything else is text with separators
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// What a channel is made of: time='t*0.001', angle='c5/12.5', `'motor_current[A]'=i_q`. Columns by their names, or c1
    /// to cN, or {any name}; row counts from 0. Channels: time s, angle rad, angle_command rad, torque N*m,
    /// pressure_drop Pa, flow m^3/s, oil_temperature degC; others need their unit in brackets
    #[arg(long = "map", required = true, value_name = "CHANNEL=EXPRESSION")]
    maps: Vec<Map>,
    /// The valve-log to write
    #[arg(long, value_name = "LOG.h5")]
    out: PathBuf,
    /// The runs' names, one for each file; else the files' names
    #[arg(long = "run", value_name = "NAME")]
    runs: Vec<String>,
    /// What was done: constant-velocity, sine, ...; one for all files, or one for each
    #[arg(long = "kind", value_name = "KIND")]
    kinds: Vec<String>,
    /// What the log is, in a line
    #[arg(long)]
    title: Option<String>,
    /// Whether the runs share the angle's zero
    #[arg(long, value_enum, default_value = "common")]
    angle_zero: Zero,
    /// Put the runs on one clock: each begins so many seconds after the one before it ended
    #[arg(long, value_name = "SECONDS")]
    gap: Option<f64>,
    /// Only these rows of each file, counted from 1: 1..5000, 5001..
    #[arg(long, value_name = "FIRST..LAST")]
    rows: Option<Rows>,
    /// What stands between the numbers of a line
    #[arg(long, value_enum, default_value = "auto")]
    separator: Separator,
    /// Whether the first line holds names
    #[arg(long, value_enum, default_value = "auto")]
    header: Header,
    /// 1,5 is one and a half
    #[arg(long)]
    decimal_comma: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Zero {
    Common,
    PerRun,
}

/// Reads every file and writes the log when all are read.
///
/// # Errors
/// [`Failure::Input`] where a file, a map or what comes of them is wrong, naming file, line and column, or the output
/// exists; [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    if out.exists() {
        return Err(Failure::Input(anyhow!("{} exists: give --out another name", name(out))));
    }
    let log = read_all(arguments).map_err(Failure::Input)?;
    log.check().map_err(Failure::input)?;
    run_log::write_log(out, &log).with_context(|| name(out))?;
    for run in &log.runs {
        let length_s = run.end_s() - run.start_s();
        say(format_args!("{}: {} samples, {length_s:.3} s", run.name, run.len()));
    }
    say(format_args!("{}: {} runs", name(out), log.runs.len()));
    Ok(Outcome::Done)
}

fn read_all(arguments: &Arguments) -> anyhow::Result<Log> {
    check_counts(arguments)?;
    let mut log = Log {
        title: arguments.title.clone().unwrap_or_else(|| "Imported".to_owned()),
        provenance: Some(provenance(arguments)),
        angle_zero: match arguments.angle_zero {
            Zero::Common => AngleZero::Common,
            Zero::PerRun => AngleZero::PerRun,
        },
        ..Log::default()
    };
    let progress = ProgressBar::new(arguments.files.len() as u64);
    let mut numbers_left = MAX_NUMBERS;
    for (index, file) in arguments.files.iter().enumerate() {
        let mut run = Run { name: run_name(arguments, index, file), ..Run::default() };
        let kind = arguments.kinds.get(index).or_else(|| arguments.kinds.first());
        run.kind = kind.cloned().unwrap_or_default();
        let mut table = open(arguments, file, numbers_left)?;
        let limits = Limits { rows: arguments.rows, numbers: numbers_left };
        collect(table.as_mut(), &arguments.maps, &limits, &mut run).with_context(|| name(file))?;
        numbers_left = numbers_left.saturating_sub(run.len() * arguments.maps.len());
        place_on_clock(&mut run, log.runs.last(), arguments.gap);
        log.runs.push(run);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(log)
}

fn check_counts(arguments: &Arguments) -> anyhow::Result<()> {
    let files = arguments.files.len();
    let (runs, kinds) = (arguments.runs.len(), arguments.kinds.len());
    if runs != 0 && runs != files {
        return Err(anyhow!("--run: {runs} given, expected {files}, one for each file"));
    }
    if kinds > 1 && kinds != files {
        return Err(anyhow!("--kind: {kinds} given, expected one for all or {files}, one for each file"));
    }
    for needed in ["time", "angle"] {
        if !arguments.maps.iter().any(|map| map.target() == needed) {
            return Err(anyhow!("no --map {needed}=..., expected one: every run has it"));
        }
    }
    for (index, map) in arguments.maps.iter().enumerate() {
        if arguments.maps.iter().skip(index + 1).any(|other| other.target() == map.target()) {
            return Err(anyhow!("--map {}: given twice, expected once", map.target()));
        }
    }
    match arguments.gap {
        Some(gap_s) if !(gap_s.is_finite() && gap_s > 0.0) => {
            Err(anyhow!("--gap {gap_s}: expected a time above zero, s"))
        }
        _ => Ok(()),
    }
}

fn provenance(arguments: &Arguments) -> String {
    let files: Vec<String> = arguments.files.iter().map(|file| name(file)).collect();
    let maps: Vec<String> = arguments.maps.iter().map(ToString::to_string).collect();
    format!("stepvalve import of {}; {}", files.join(", "), maps.join(", "))
}

fn run_name(arguments: &Arguments, index: usize, file: &Path) -> String {
    let stem = || file.file_stem().unwrap_or(OsStr::new("run")).to_string_lossy().into_owned();
    arguments.runs.get(index).cloned().unwrap_or_else(stem)
}

fn open(arguments: &Arguments, file: &Path, numbers_left: usize) -> anyhow::Result<Box<dyn Table>> {
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mat")) {
        return Ok(Box::new(mat::open(file, numbers_left)?));
    }
    let format = Format {
        separator: arguments.separator,
        header: arguments.header,
        decimal_comma: arguments.decimal_comma,
    };
    Ok(Box::new(Separated::open(file, format)?))
}

/// Moves a run behind the one before it, where a gap is wanted.
fn place_on_clock(run: &mut Run, before: Option<&Run>, gap_s: Option<f64>) {
    if let (Some(before), Some(gap_s)) = (before, gap_s) {
        let shift_s = before.end_s() + gap_s - run.start_s();
        run.time_s.iter_mut().for_each(|time| *time += shift_s);
    }
}
