//! The process that reads a strange file.

use super::array::Array;
use super::frames::{Head, send, send_numbers};
use super::request::{Kind, ReadFile};
use super::{mat, npy};
use anyhow::{Context, anyhow};
use run_log::{LogPart, RunLogError, Wanted, read_log_parts};
use std::io::{BufWriter, Stdout, Write};
use std::path::Path;
use supervisor::{Failure, Outcome};

/// Reads a file and sends its parts to stdout.
///
/// # Errors
/// [`Failure::Input`] where the file can't be read.
pub fn read_file(arguments: &ReadFile) -> Result<Outcome, Failure> {
    let (file, limits) = (&arguments.file, arguments.limits());
    limits.enforce()?;
    let mut out = BufWriter::with_capacity(1 << 18, std::io::stdout());
    match arguments.kind {
        Kind::Log => send_log(file, limits.numbers, &mut out)?,
        Kind::Mat => mat::arrays(file, limits.numbers, &mut |array| send_array(array, &mut out))
            .map_err(Failure::Input)?,
        Kind::Npy => npy::arrays(file, limits.numbers, &mut |array| send_array(array, &mut out))
            .map_err(Failure::Input)?,
    }
    send(&mut out, &Head::End)?;
    out.flush().context("stdout")?;
    Ok(Outcome::Done)
}

fn send_array(array: Array, out: &mut BufWriter<Stdout>) -> anyhow::Result<()> {
    let Array { name, shape, numbers } = array;
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
