//! What an operator may ask of a running instance, and what is answered: each a line of JSON on the control socket.

use injection::Injection;
use serde::{Deserialize, Serialize};

/// A set-point's kind, as an operator says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SetKind {
    /// Go to an angle: 17deg
    Angle,
    /// Go to an opening from 0 to 1: 0.5
    Opening,
    /// Hold a flow at the measured pressure drop: 40L/min
    Flow,
    /// Turn without end: 60rpm
    Speed,
}

/// What can be asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "request")]
pub enum Request {
    /// Begin to follow set-points.
    Arm,
    /// Stop the valve and hold.
    Disarm,
    /// Leave a fault.
    Reset,
    /// A set-point.
    Set {
        /// What kind.
        kind: SetKind,
        /// Its value in SI, units taken off by the client.
        value: f64,
        /// For a flow: the pressure drop that it is meant at, Pa; `None` for the measured one.
        pressure_drop_pa: Option<f64>,
    },
    /// Stop as soon as the limits of motion allow, and stay armed.
    Hold,
    /// Give a parameter of the controller another value.
    Parameter {
        /// Its name, as messages and records have it.
        name: String,
        /// The value, in the parameter's unit.
        value: f64,
    },
    /// How it is.
    Status,
    /// Put a note into the record.
    Mark {
        /// The note.
        text: String,
    },
    /// Save the last seconds of every process's timing.
    SaveTiming,
    /// Let something go wrong, where that was allowed at the start.
    Inject {
        /// What.
        fault: Injection,
    },
}

/// What became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether it was done.
    pub done: bool,
    /// What happened, or why it was refused.
    pub text: String,
    /// The status, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status: Option<serde_json::Value>,
}

impl Answer {
    /// Done.
    pub fn done(text: impl Into<String>) -> Self {
        Self { done: true, text: text.into(), status: None }
    }

    /// Refused.
    pub fn refused(text: impl Into<String>) -> Self {
        Self { done: false, text: text.into(), status: None }
    }
}
