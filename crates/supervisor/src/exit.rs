//! How a program ends: done, stopped by a fault, interrupted; or a failure with its exit code.

use crate::generation::Refused;
use std::fmt;
use std::process::ExitCode;

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
        write!(f, "{error:#}")
    }
}

/// Everything that is not said to be wrong input is a failure.
impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        if error.is::<Refused>() { Self::Input(error) } else { Self::Failed(error) }
    }
}
