//! How a program ends: done, stopped by a fault, interrupted; or a failure with its exit code.

use signals::Source;
use std::fmt;
use std::process::ExitCode;
use thiserror::Error;

/// A command that did its work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 3: a fault stopped the valve.
    Fault,
    /// Exit code 130: interrupted after a clean stop.
    Interrupted,
}

/// A process that died before it was ready: that is its fault, not the user's.
#[derive(Debug, Error)]
#[error("{0} ended before it was ready")]
pub struct DiedAtStart(pub Source);

/// A device that is not the one it should be: wrong input, and nothing runs.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Refused(pub String);

/// A command that could not.
#[derive(Debug)]
pub enum Failure {
    /// Exit code 2: what was asked for makes no sense. Nothing was started, nothing written.
    Input(anyhow::Error),
    /// Exit code 1.
    Failed(anyhow::Error),
}

impl Failure {
    /// Wrong input.
    pub fn input(error: impl Into<anyhow::Error>) -> Self {
        Self::Input(error.into())
    }

    /// The exit code.
    pub fn code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Failed(_) => ExitCode::FAILURE,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Input(error) | Self::Failed(error)) = self;
        f.write_str(&once(error))
    }
}

/// Everything that is not said to be wrong input is a failure.
impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        if error.is::<Refused>() { Self::Input(error) } else { Self::Failed(error) }
    }
}

/// An error and its causes, without a cause that the text before it ends with: many errors say their cause themselves.
fn once(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |text, cause| match cause.to_string() {
        cause if text.is_empty() => cause,
        cause if text.ends_with(&cause) => text,
        cause => format!("{text}: {cause}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_that_the_error_says_itself_is_told_once() {
        let cause = anyhow::anyhow!("no section [motor]");
        let error = cause.context("run a: no section [motor]").context("log.h5");
        assert_eq!(Failure::Input(error).to_string(), "log.h5: run a: no section [motor]");
        let error = anyhow::anyhow!("too short").context("run a");
        assert_eq!(Failure::Failed(error).to_string(), "run a: too short");
    }
}
