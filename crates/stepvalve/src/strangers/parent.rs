//! The process that has a strange file read, and puts together what comes.

use super::array::Array;
use super::frames::{Head, Receiver, TooMany};
use super::limits::Limits;
use super::request::Kind;
use crate::files::name;
use anyhow::{Context, anyhow, bail};
use log_data::{AngleZero, Channel, Extra, Log, Run};
use nix::sys::signal::Signal;
use std::io::{BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use supervisor::Failure;

/// So much of what the other process complains of is kept.
const COMPLAINT_BYTES: u64 = 64 << 10;

/// The channels of a valve-log, checked; other signals of its runs are left out.
///
/// # Errors
/// [`Failure::Input`]: what is wrong with the file, or what reading it came to.
pub fn log(path: &Path) -> Result<Log, Failure> {
    let named = || name(path);
    let limits = Limits::of_blocks(path).with_context(named).map_err(Failure::Input)?;
    let log = read(Kind::Log, path, &limits, collect_log).map_err(Failure::Input)?;
    log.check().with_context(named).map_err(Failure::Input)?;
    Ok(log)
}

/// The arrays of a MAT file, or of a NumPy one.
///
/// # Errors
/// What is wrong with the file, or what reading it came to.
pub fn arrays(path: &Path, most: usize) -> anyhow::Result<Vec<Array>> {
    let numpy = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy"));
    let kind = if numpy { Kind::Npy } else { Kind::Mat };
    let mut limits = Limits::of_whole(path).with_context(|| name(path))?;
    limits.numbers = limits.numbers.min(most);
    read(kind, path, &limits, collect_arrays)
}

/// Has another process read a file; `collect` takes what it sends.
fn read<T>(
    kind: Kind,
    path: &Path,
    limits: &Limits,
    collect: fn(&mut Receiver<BufReader<ChildStdout>>) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let file = name(path);
    let kind =
        clap::ValueEnum::to_possible_value(&kind).map_or(String::new(), |kind| kind.get_name().to_owned());
    let mut command = myself("read-file");
    command.arg(kind).arg(path).arg(limits.numbers.to_string());
    command.arg(limits.memory_bytes.to_string()).arg(limits.cpu_s.to_string());
    let mut child = command.stdout(Stdio::piped()).spawn().with_context(|| file.clone())?;
    let complaint = complaint(&mut child);
    let Some(stdout) = child.stdout.take() else { bail!("{file}: no pipe") };
    let mut receiver = Receiver::new(BufReader::with_capacity(1 << 18, stdout), limits.numbers);
    let collected = collect(&mut receiver);
    // Whoever still writes finds the pipe closed.
    drop(receiver);
    let status = child.wait().with_context(|| file.clone())?;
    let said = complaint.join().unwrap_or_default();
    match collected {
        Ok(collected) if status.success() => Ok(collected),
        Err(error) if error.is::<TooMany>() => Err(error.context(file)),
        Err(error) if status.success() => Err(error.context(format!("{file}: what its reader sent"))),
        _ => Err(ended(&file, status, said.trim(), limits)),
    }
}

/// Runs a command of this program's own within limits, to its end: one that works on a strange file itself.
///
/// # Errors
/// [`Failure`] as that process had it; [`Failure::Input`] where it was ended by the file.
pub fn watched(path: &Path, command: &str, arguments: &[&Path], limits: &Limits) -> Result<(), Failure> {
    let mut process = myself(command);
    process.args(arguments).arg(limits.memory_bytes.to_string()).arg(limits.cpu_s.to_string());
    let mut child = process.spawn().with_context(|| name(path))?;
    let complaint = complaint(&mut child);
    let status = child.wait().with_context(|| name(path))?;
    let said = complaint.join().unwrap_or_default();
    match status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(Failure::Failed(anyhow!("{}", said.trim()))),
        _ => Err(Failure::Input(ended(&name(path), status, said.trim(), limits))),
    }
}

/// This program once more: as it runs, even where its file was replaced meanwhile.
fn myself(command: &str) -> Command {
    let mut process = Command::new("/proc/self/exe");
    // A file can name filters to be loaded from elsewhere: none are.
    process.arg(command).env("HDF5_PLUGIN_PRELOAD", "::").stdin(Stdio::null()).stderr(Stdio::piped());
    process
}

/// Keeps what a process complains of, and lets it complain without an end.
fn complaint(child: &mut Child) -> std::thread::JoinHandle<String> {
    let stderr = child.stderr.take();
    std::thread::spawn(move || {
        let mut said = Vec::new();
        if let Some(mut stderr) = stderr {
            let _ = stderr.by_ref().take(COMPLAINT_BYTES).read_to_end(&mut said);
            let _ = std::io::copy(&mut stderr, &mut std::io::sink());
        }
        String::from_utf8_lossy(&said).into_owned()
    })
}

/// What the end of a process says about the file that it read.
fn ended(file: &str, status: ExitStatus, said: &str, limits: &Limits) -> anyhow::Error {
    let signal = status.signal().and_then(|signal| Signal::try_from(signal).ok());
    // Rust's allocator, or the error that a parser prints when it unpacks too much.
    if ["memory allocation of", "OutOfMemory"].iter().any(|text| said.contains(text)) {
        let most = limits.memory_bytes >> 20;
        return anyhow!(
            "{file}: reading it takes more than {most} MB of memory, expected a file that unpacks to less"
        );
    }
    if status.code() == Some(2) {
        return if said.starts_with(file) { anyhow!("{said}") } else { anyhow!("{file}: {said}") };
    }
    match signal {
        Some(Signal::SIGXCPU | Signal::SIGALRM | Signal::SIGKILL) => {
            let most = limits.cpu_s;
            anyhow!(
                "{file}: reading it takes more than {most} s, expected less of a file of this size; it is damaged"
            )
        }
        Some(signal) => {
            anyhow!("{file}: damaged: its reader crashed ({}), expected a whole file", signal.as_str())
        }
        None => anyhow!("{file}: its reader failed ({status}): {said}"),
    }
}

fn collect_log(receiver: &mut Receiver<BufReader<ChildStdout>>) -> anyhow::Result<Log> {
    let mut log = Log::default();
    loop {
        match receiver.head()? {
            Head::Log { title, provenance, angle_zero, attributes } => {
                (log.title, log.provenance) = (title, provenance);
                log.angle_zero = AngleZero::from_name(&angle_zero).unwrap_or_default();
                log.attributes = attributes.into_iter().map(|(name, fact)| (name, fact.into())).collect();
            }
            Head::Run { name, kind, attributes } => {
                let attributes = attributes.into_iter().map(|(name, fact)| (name, fact.into())).collect();
                log.runs.push(Run { name, kind, attributes, ..Run::default() });
            }
            Head::Channel { name, numbers } => {
                let values = receiver.numbers(numbers)?;
                match (log.runs.last_mut(), Channel::from_name(&name)) {
                    (Some(run), Some(channel)) => run.set_channel(channel, values),
                    (Some(run), None) => run.extra.push(Extra { name, unit: "1".to_owned(), values }),
                    (None, _) => {}
                }
            }
            Head::Array { .. } => bail!("an array in a log"),
            Head::End => return Ok(log),
        }
    }
}

fn collect_arrays(receiver: &mut Receiver<BufReader<ChildStdout>>) -> anyhow::Result<Vec<Array>> {
    let mut arrays = Vec::new();
    loop {
        match receiver.head()? {
            Head::Array { name, shape, numbers } => {
                arrays.push(Array { name, shape, numbers: receiver.numbers(numbers)? });
            }
            Head::End => return Ok(arrays),
            _ => bail!("a log among arrays"),
        }
    }
}
