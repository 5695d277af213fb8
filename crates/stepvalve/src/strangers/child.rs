//! The process that reads a strange file.

use super::frames::{Head, send, send_numbers};
use super::limits::Limits;
use super::{mat, npy};
use anyhow::{Context, anyhow};
use run_log::{LogPart, RunLogError, Wanted, read_log_parts};
use std::io::{BufWriter, Stdout, Write};
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};

/// Reads a file for another process.
#[derive(clap::Args)]
pub struct ReadFile {
    /// What it is
    #[arg(value_enum)]
    kind: Kind,
    /// The file
    file: PathBuf,
    /// The most numbers
    numbers: usize,
    /// The most memory, bytes
    memory_bytes: u64,
    /// The most time on a processor, s
    cpu_s: u64,
}

/// What a file is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Kind {
    Log,
    Mat,
    Npy,
}

/// Reads a file and sends its parts to stdout.
///
/// # Errors
/// [`Failure::Input`] where the file can't be read.
pub fn read_file(arguments: &ReadFile) -> Result<Outcome, Failure> {
    let ReadFile { kind, file, numbers, memory_bytes, cpu_s } = arguments;
    Limits { numbers: *numbers, memory_bytes: *memory_bytes, cpu_s: *cpu_s }.enforce()?;
    let mut out = BufWriter::with_capacity(1 << 18, std::io::stdout());
    match kind {
        Kind::Log => send_log(file, *numbers, &mut out)?,
        Kind::Mat => {
            mat::arrays(file, *numbers, &mut |array| send_array(array, &mut out)).map_err(Failure::Input)?
        }
        Kind::Npy => {
            npy::arrays(file, *numbers, &mut |array| send_array(array, &mut out)).map_err(Failure::Input)?
        }
    }
    send(&mut out, &Head::End)?;
    out.flush().context("stdout")?;
    Ok(Outcome::Done)
}

fn send_array(array: super::Array, out: &mut BufWriter<Stdout>) -> anyhow::Result<()> {
    let super::Array { name, shape, numbers } = array;
    send(out, &Head::Array { name, shape, numbers: numbers.len() as u64 })?;
    send_numbers(out, &numbers)
}

fn send_log(file: &Path, most: usize, out: &mut BufWriter<Stdout>) -> Result<(), Failure> {
    read_log_parts(file, Wanted::Channels, most, &mut |part| -> Result<(), Sending> {
        let sent = match part {
            LogPart::Log(log) => send(
                out,
                &Head::Log {
                    title: log.title,
                    provenance: log.provenance,
                    angle_zero: log.angle_zero.name().to_owned(),
                    attributes: log.attributes.into_iter().map(|(name, of)| (name, of.into())).collect(),
                },
            ),
            LogPart::Run(run) => {
                let attributes = run.attributes.into_iter().map(|(name, of)| (name, of.into())).collect();
                send(out, &Head::Run { name: run.name, kind: run.kind, attributes })
            }
            LogPart::Column { name, samples, .. } => {
                send(out, &Head::Channel { name, numbers: samples as u64 })
            }
            LogPart::Samples(values) => send_numbers(out, &values),
        };
        sent.map_err(Sending::Pipe)
    })
    .map_err(|error| match error {
        Sending::File(error) => Failure::input(error),
        Sending::Pipe(error) => Failure::Failed(anyhow!("{error:#}")),
    })
}

/// Why a log was not sent whole.
enum Sending {
    File(RunLogError),
    Pipe(anyhow::Error),
}

impl From<RunLogError> for Sending {
    fn from(error: RunLogError) -> Self {
        Self::File(error)
    }
}
