//! `stepvalve events`: the journal of an instance, of a running one or from its record's folder.

use crate::operator::{Which, find};
use crate::say::say;
use anyhow::{Context, anyhow};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use supervisor::{Entry, Failure, Interruption, Outcome, journal_path, older_journal_path, whereabouts};

/// How often a journal that is followed is looked at.
const LOOK: Duration = Duration::from_millis(100);

/// Which journal, and how much of it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of a record, for an instance that has ended [default: that of the running instance]
    #[arg(value_name = "DIR", conflicts_with = "instance")]
    folder: Option<PathBuf>,
    /// Go on with what happens from now on, until Ctrl-C
    #[arg(long)]
    follow: bool,
    /// Only the last so many
    #[arg(long, value_name = "N", default_value_t = 50)]
    last: usize,
    #[command(flatten)]
    which: Which,
}

/// Prints them, a line each.
///
/// # Errors
/// [`Failure::Input`] where there is no such instance or no journal.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let folder = folder(arguments)?;
    let path = journal_path(&folder);
    let mut file = File::open(&path)
        .map(BufReader::new)
        .with_context(|| format!("{}: no journal", path.display()))
        .map_err(Failure::Input)?;
    let interruption = Interruption::watch()?;
    let mut lines = Vec::new();
    if let Ok(older) = File::open(older_journal_path(&folder)) {
        lines.extend(whole_lines(&mut BufReader::new(older)));
    }
    lines.extend(whole_lines(&mut file));
    for line in lines.iter().skip(lines.len().saturating_sub(arguments.last)) {
        show(line, arguments.which.json);
    }
    if arguments.follow {
        follow(&path, file, arguments.which.json, &interruption);
        return Ok(Outcome::Interrupted);
    }
    Ok(Outcome::Done)
}

/// Prints what is noted from now on, until it is interrupted.
fn follow(path: &Path, mut file: BufReader<File>, json: bool, interruption: &Interruption) {
    while !interruption.wanted() {
        whole_lines(&mut file).iter().for_each(|line| show(line, json));
        // A full file is put aside: then its successor has the name.
        let ours = file.get_ref().metadata().map(|ours| ours.ino());
        let same = std::fs::metadata(path).is_ok_and(|now| ours.is_ok_and(|ours| ours == now.ino()));
        match File::open(path) {
            Ok(successor) if !same => file = BufReader::new(successor),
            _ => std::thread::sleep(LOOK),
        }
    }
}

fn folder(arguments: &Arguments) -> Result<PathBuf, Failure> {
    if let Some(folder) = &arguments.folder {
        return Ok(folder.clone());
    }
    let socket = find(&arguments.which)?;
    let instance = socket.parent().unwrap_or(Path::new("/"));
    let at =
        whereabouts(instance).map_err(|error| anyhow!("the instance is starting or ending: {error:#}"))?;
    Ok(at.record)
}

/// What is there to read, line by line.
fn whole_lines(file: &mut impl BufRead) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    // Each line is written at once.
    while file.read_line(&mut line).is_ok_and(|bytes| bytes > 0) {
        lines.push(std::mem::take(&mut line));
    }
    lines
}

/// A line that a crash cut off is passed over.
fn show(line: &str, json: bool) {
    let Ok(entry) = serde_json::from_str::<Entry>(line) else { return };
    if json { say(line.trim_end()) } else { say(entry) }
}
