//! `stepvalve import`: tables from elsewhere (CSV, MAT, NumPy) become a valve-log.

mod clock;
mod mapping;
mod order;
mod recipe;

use crate::files::name;
use crate::pulse::Pulse;
use crate::say::say;
use crate::strangers;
use anyhow::{Context, anyhow, bail, ensure};
use indicatif::ProgressBar;
use log_data::{AngleZero, Log, Run};
use mapping::{Mapping, Zero};
use processes::complain;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};
use table_import::{Columns, CutLine, Separated, Table, collect, columns_of, functions_help};

/// More numbers than this, all runs and channels together, are refused: they take 2 GB of memory.
pub const MAX_NUMBERS: usize = 250_000_000;

/// Files that a title names.
const TITLE_NAMES: usize = 3;

/// What to import, and how.
#[derive(clap::Args)]
#[command(after_long_help = functions_help())]
pub struct Arguments {
    /// Tables, a run each: MAT files (.mat, v5 or v7.3), NumPy arrays (.npy), anything else is text with separators. Of a
    /// matrix the longer side is time, whichever way it lies; its columns are NAME_1, NAME_2, ...
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Take from this file (TOML) all that isn't said here
    #[arg(long, value_name = "RECIPE.toml")]
    recipe: Option<PathBuf>,
    /// Write what was said here and in the recipe as a recipe for the next time
    #[arg(long, value_name = "RECIPE.toml")]
    save_recipe: Option<PathBuf>,
    /// The valve-log to write; else the first file's name with .h5, in this folder
    #[arg(long, value_name = "LOG.h5")]
    out: Option<PathBuf>,
    /// Replace the log, or the recipe, that is there
    #[arg(long)]
    force: bool,
    /// The runs' names, one for each file; else the files' names
    #[arg(long = "run", value_name = "NAME")]
    runs: Vec<String>,
    #[command(flatten)]
    mapping: Mapping,
}

/// Reads every file and writes the log when all are read.
///
/// # Errors
/// [`Failure::Input`] where a file, a map or what comes of them is wrong, naming file, line and column, or the output
/// exists; [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    for file in &arguments.files {
        std::fs::metadata(file).with_context(|| name(file)).map_err(Failure::Input)?;
    }
    let out = out(arguments);
    for file in std::iter::once(&out).chain(&arguments.save_recipe) {
        if file.exists() && !arguments.force {
            return Err(Failure::Input(anyhow!("{} exists: give another name, or --force", name(file))));
        }
    }
    let mapping = match &arguments.recipe {
        Some(file) => arguments.mapping.clone().or(recipe::read(file)?),
        None => arguments.mapping.clone(),
    };
    let log = read_all(arguments, &mapping).map_err(Failure::Input)?;
    log.check().map_err(Failure::input)?;
    run_log::write_log(&out, &log).with_context(|| name(&out))?;
    if let Some(file) = &arguments.save_recipe {
        recipe::write(file, &mapping)?;
    }
    for run in &log.runs {
        let length_s = run.end_s() - run.start_s();
        say(format_args!("{}: {} samples, {length_s:.3} s{}", run.name, run.len(), missing(run)));
    }
    let runs = log.runs.len();
    say(format_args!("{}: {runs} {}", name(&out), if runs == 1 { "run" } else { "runs" }));
    Ok(Outcome::Done)
}

fn out(arguments: &Arguments) -> PathBuf {
    let stem = || arguments.files.first().and_then(|file| file.file_stem()).unwrap_or(OsStr::new("log"));
    arguments.out.clone().unwrap_or_else(|| PathBuf::from(stem()).with_extension("h5"))
}

/// Which channels lack samples, and how many.
fn missing(run: &Run) -> String {
    let mut text = String::new();
    let known =
        log_data::Channel::ALL.iter().filter_map(|channel| Some((channel.name(), run.channel(*channel)?)));
    let further = run.extra.iter().map(|extra| (extra.name.as_str(), extra.values.as_slice()));
    for (name, values) in known.chain(further) {
        let count = values.iter().filter(|value| value.is_nan()).count();
        if count > 0 {
            text.push_str(&format!(", {count} of {name} missing"));
        }
    }
    text
}

fn read_all(arguments: &Arguments, mapping: &Mapping) -> anyhow::Result<Log> {
    check_counts(arguments, mapping)?;
    if mapping.map.is_empty()
        && let Some(file) = arguments.files.first()
    {
        let columns = open(mapping, file, MAX_NUMBERS)?.names().join(", ");
        let skip = if mapping.skip.is_none() {
            " (not those of your table? lines before it are left out with --skip auto)"
        } else {
            ""
        };
        bail!(
            "no --map: expected --map time=..., --map angle=... and what else was measured; {} has the columns {columns}{skip}",
            name(file)
        );
    }
    mapping.check()?;
    let files: Vec<(usize, &PathBuf)> = in_order(&arguments.files, mapping).collect();
    let mut log = Log {
        title: mapping.title.clone().unwrap_or_else(|| title(files.iter().map(|(_, file)| *file))),
        provenance: Some(provenance(arguments, mapping)),
        angle_zero: match mapping.angle_zero {
            Some(Zero::PerRun) => AngleZero::PerRun,
            _ => AngleZero::Common,
        },
        ..Log::default()
    };
    let progress = ProgressBar::new(files.len() as u64);
    let (read, all) = (progress.clone(), files.len());
    let _pulse = Pulse::new(move || format!("{} of {all} files read", read.position()));
    let mut numbers_left = MAX_NUMBERS;
    // Lines of a name, a time and a value are sorted into columns before, all of them.
    let told = mapping.missing.iter().filter(|_| mapping.interleaved.is_none());
    let mut unsaid: Vec<(usize, &String)> = told.enumerate().collect();
    for (index, file) in files {
        let mut run = Run { name: run_name(arguments, index, file), ..Run::default() };
        let kind = mapping.kinds.get(index).or_else(|| mapping.kinds.first());
        run.kind = kind.cloned().unwrap_or_default();
        let mut table = open(mapping, file, numbers_left)?;
        collect(table.as_mut(), &mapping.map, &mapping.selection(numbers_left), &mut run)
            .with_context(|| name(file))?;
        note_cut(file, table.cut());
        unsaid.retain(|(place, _)| !table.says_missing(*place));
        numbers_left = numbers_left.saturating_sub(run.len() * mapping.map.len());
        clock::follow(&mut run, log.runs.last(), mapping.gap);
        log.runs.push(run);
        progress.inc(1);
    }
    progress.finish_and_clear();
    for (_, text) in unsaid {
        complain(format_args!(
            "note: --missing {text}: no cell of the columns that were read says so; it is compared with what stands in the file, before any unit"
        ));
    }
    clock::begin_with_a_day(&mut log);
    Ok(log)
}

/// The files with their places among those given, in the order of their runs.
fn in_order<'a>(files: &'a [PathBuf], mapping: &Mapping) -> impl Iterator<Item = (usize, &'a PathBuf)> {
    let order = match mapping.gap {
        Some(_) => order::by_numbers(files),
        None => (0..files.len()).collect(),
    };
    order::told(files, &order).into_iter().for_each(say);
    order.into_iter().filter_map(|index| Some((index, files.get(index)?)))
}

/// A title by the files' names.
fn title<'a>(files: impl ExactSizeIterator<Item = &'a PathBuf>) -> String {
    let name = |file: &PathBuf| file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let more = files.len().saturating_sub(TITLE_NAMES);
    let names: Vec<String> = files.take(TITLE_NAMES).map(name).collect();
    match more {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

fn check_counts(arguments: &Arguments, mapping: &Mapping) -> anyhow::Result<()> {
    let files = arguments.files.len();
    let (runs, kinds) = (arguments.runs.len(), mapping.kinds.len());
    ensure!(runs == 0 || runs == files, "--run: {runs} given, expected {files}, one for each file");
    ensure!(
        kinds <= 1 || kinds == files,
        "--kind: {kinds} given, expected one for all or {files}, one for each file"
    );
    Ok(())
}

fn provenance(arguments: &Arguments, mapping: &Mapping) -> String {
    let files: Vec<String> = arguments.files.iter().map(|file| name(file)).collect();
    let maps: Vec<String> = mapping.map.iter().map(ToString::to_string).collect();
    format!("stepvalve import of {}; {}", files.join(", "), maps.join(", "))
}

/// As given, else the file's name; behind its folder's where another file has the same name.
fn run_name(arguments: &Arguments, index: usize, file: &Path) -> String {
    if let Some(name) = arguments.runs.get(index) {
        return name.clone();
    }
    let text = |part: Option<&OsStr>| part.unwrap_or(OsStr::new("run")).to_string_lossy().into_owned();
    let stem = text(file.file_stem());
    let alone = arguments.files.iter().filter(|other| other.file_stem() == file.file_stem()).count() == 1;
    match file.parent().and_then(Path::file_name) {
        Some(folder) if !alone => format!("{}-{stem}", text(Some(folder))),
        _ => stem,
    }
}

fn open(mapping: &Mapping, file: &Path, numbers_left: usize) -> anyhow::Result<Box<dyn Table>> {
    let ends_in =
        |known: &str| file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(known));
    if ends_in("mat") || ends_in("npy") {
        return Ok(Box::new(arrays(file, numbers_left)?));
    }
    let mut text = Separated::open(file, &mapping.format())?;
    match &mapping.interleaved {
        Some(interleaved) => {
            let sorted = interleaved.sorted(&mut text, numbers_left).with_context(|| name(file))?;
            note_cut(file, text.cut());
            Ok(Box::new(sorted))
        }
        None => Ok(Box::new(text)),
    }
}

/// Says that a file was cut off: its last row is no row.
fn note_cut(file: &Path, cut: Option<&CutLine>) {
    if let Some(CutLine { line, cell }) = cut {
        complain(format_args!(
            "note: {}:{line}: the file ends within a number ({cell:?}, shorter than in all rows before): this row is left out",
            name(file)
        ));
    }
}

/// A file's arrays as columns.
fn arrays(file: &Path, numbers_left: usize) -> anyhow::Result<Columns> {
    let arrays = strangers::arrays(file, numbers_left)?;
    let columns = arrays.into_iter().filter_map(|array| columns_of(&array.name, &array.shape, array.numbers));
    Columns::new(columns.flatten().collect()).with_context(|| name(file))
}
