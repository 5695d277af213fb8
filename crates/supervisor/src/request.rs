//! What an operator may ask of a running instance, and what is answered: each a line of JSON on the control socket.

use injection::Injection;
use serde::{Deserialize, Serialize};
use signals::SetPointKind;

/// A request with its deadline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ask {
    /// What is asked.
    #[serde(flatten)]
    pub(crate) request: Request,
    /// Until when the client waits, on CLOCK_MONOTONIC, ns; without, it waits for as long as it takes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) until_ns: Option<u64>,
}

/// What can be asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "request")]
pub enum Request {
    /// Begin to follow set-points.
    Arm,
    /// Find the angle's zero.
    Home,
    /// Stop the valve; then without current, or holding, as the scenario says.
    Disarm,
    /// Leave a fault.
    Reset,
    /// A set-point.
    Set {
        /// What kind: an angle, an opening, a flow or a speed.
        #[serde(with = "kind_by_name")]
        kind: SetPointKind,
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

impl Request {
    /// The command that asks for it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Home => "home",
            Self::Disarm => "disarm",
            Self::Reset => "reset",
            Self::Set { .. } => "set",
            Self::Hold => "set hold",
            Self::Parameter { .. } => "set parameter",
            Self::Status => "status",
            Self::Mark { .. } => "mark",
            Self::SaveTiming => "save-timing",
            Self::Inject { .. } => "inject",
        }
    }
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

/// A set-point's kind in JSON: by the name that records have for it.
mod kind_by_name {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};
    use signals::SetPointKind;

    const KINDS: [SetPointKind; 4] =
        [SetPointKind::Angle, SetPointKind::Opening, SetPointKind::Flow, SetPointKind::Speed];

    pub fn serialize<S: Serializer>(kind: &SetPointKind, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(kind.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<SetPointKind, D::Error> {
        let name = String::deserialize(deserializer)?;
        let expected =
            || D::Error::custom(format!("kind \"{name}\", expected angle, opening, flow or speed"));
        KINDS.into_iter().find(|kind| kind.name() == name).ok_or_else(expected)
    }
}
