//! What the numbers of a field that carries codes or flags mean: as constants in schemas, as text in run files.

use crate::Topic;
use signals::{
    BusPhase, ControllerState, FaultCode, HeldFlow, HomingPhase, OperatorKind, OperatorResult, Scheduling,
    SetPointKind, SetPointRefusal, Source, alarm, limiting, validity,
};

/// A field's codes, each with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Codes {
    /// One of them.
    Values(Vec<(u64, &'static str)>),
    /// The sum of some.
    Flags(Vec<(u64, &'static str)>),
}

impl Codes {
    /// All of them with their names.
    pub fn all(&self) -> &[(u64, &'static str)] {
        match self {
            Self::Values(all) | Self::Flags(all) => all,
        }
    }
}

/// As text: `0 disarmed, 1 running, ...`, or `sum of: 1 encoder, 2 homed, ...`.
impl core::fmt::Display for Codes {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if matches!(self, Self::Flags(_)) {
            f.write_str("sum of: ")?;
        }
        for (index, (code, name)) in self.all().iter().enumerate() {
            write!(f, "{}{code} {name}", if index > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

/// `Values` of an enumeration of the messages.
macro_rules! values {
    ($of:ident) => {
        Some(Codes::Values($of::ALL.iter().map(|value| (value.code(), value.name())).collect()))
    };
}

/// What a field's numbers mean; `None` for counts and quantities.
pub fn codes(topic: Topic, field: &str) -> Option<Codes> {
    match (topic, field) {
        (_, "source") => values!(Source),
        (Topic::ControlStatus, "state") => values!(ControllerState),
        (Topic::BusStatus, "phase") => values!(BusPhase),
        (Topic::ControlStatus, "fault") | (Topic::Feedback, "drive_fault") => values!(FaultCode),
        (Topic::ControlStatus, "operator_result") => values!(OperatorResult),
        (Topic::ControlStatus, "homing_phase") => values!(HomingPhase),
        (Topic::ControlStatus, "limiting") => Some(Codes::Flags(limiting::NAMES.to_vec())),
        (Topic::ControlStatus, "alarms") => Some(Codes::Flags(alarm::NAMES.to_vec())),
        (Topic::Feedback, "validity") => Some(Codes::Flags(VALIDITY.to_vec())),
        (Topic::Reference, "set_point_kind") | (Topic::SetPoint, "kind") => values!(SetPointKind),
        (Topic::Reference, "refusal") => values!(SetPointRefusal),
        (Topic::Reference, "held_flow") => values!(HeldFlow),
        (Topic::OperatorCommand, "kind") => values!(OperatorKind),
        (_, "scheduling") => values!(Scheduling),
        _ => None,
    }
}

const VALIDITY: &[(u64, &str)] = &[
    (validity::ENCODER, "encoder"),
    (validity::HOMED, "homed"),
    (validity::PRESSURE, "pressure"),
    (validity::TEMPERATURE, "temperature"),
    (validity::ENERGISED, "energised"),
    (validity::STANDSTILL, "standstill"),
    (validity::LIMITED, "limited"),
    (validity::STOPPED_ITSELF, "stopped itself"),
    (validity::COMMAND_MISSED, "command missed"),
    (validity::HOME_SWITCH, "home switch"),
    (validity::INDEX, "index"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_flags_are_spelt_out() {
        let text = |topic, field| codes(topic, field).map(|codes| codes.to_string());
        assert_eq!(
            text(Topic::ControlStatus, "state").as_deref(),
            Some("0 disarmed, 1 running, 2 quick-stop, 3 fault, 4 arming, 5 homing")
        );
        assert!(text(Topic::Feedback, "validity").unwrap().starts_with("sum of: 1 encoder, 2 homed"));
        let sum: u64 = VALIDITY.iter().map(|(bit, _)| bit).sum();
        assert_eq!(sum, validity::END - 1);
        assert_eq!(text(Topic::Feedback, "angle_rad"), None);
    }
}
