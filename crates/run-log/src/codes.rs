//! What the numbers of a column that carries codes or flags mean, for people who open the file.

use recording::Topic;
use signals::{
    BusPhase, ControllerState, FaultCode, HomingPhase, OperatorKind, OperatorResult, Scheduling,
    SetPointKind, SetPointRefusal, Source, alarm, limiting, validity,
};

/// The meaning of a field's numbers: `0 disarmed, 1 running, ...`; `None` for counts and quantities.
pub(crate) fn meaning(topic: Topic, field: &str) -> Option<String> {
    match (topic, field) {
        (_, "source") => Some(list(Source::ALL, Source::code)),
        (Topic::ControlStatus, "state") => Some(list(ControllerState::ALL, ControllerState::code)),
        (Topic::BusStatus, "phase") => Some(list(BusPhase::ALL, BusPhase::code)),
        (Topic::ControlStatus, "fault") | (Topic::Feedback, "drive_fault") => {
            Some(list(FaultCode::ALL, FaultCode::code))
        }
        (Topic::ControlStatus, "operator_result") => Some(list(OperatorResult::ALL, OperatorResult::code)),
        (Topic::ControlStatus, "homing_phase") => Some(list(HomingPhase::ALL, HomingPhase::code)),
        (Topic::ControlStatus, "limiting") => Some(flags(&limiting::NAMES)),
        (Topic::ControlStatus, "alarms") => Some(flags(&alarm::NAMES)),
        (Topic::Feedback, "validity") => Some(flags(VALIDITY)),
        (Topic::Reference, "set_point_kind") | (Topic::SetPoint, "kind") => {
            Some(list(SetPointKind::ALL, SetPointKind::code))
        }
        (Topic::SetPoint, "value") => Some(format!("unit by kind: {}", units_by_kind())),
        (Topic::Reference, "refusal") => Some(list(SetPointRefusal::ALL, SetPointRefusal::code)),
        (Topic::OperatorCommand, "kind") => Some(list(OperatorKind::ALL, OperatorKind::code)),
        (_, "scheduling") => Some(list(Scheduling::ALL, Scheduling::code)),
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

/// `0 hold 1, 1 angle rad, ...`: a set-point's value has the unit of its kind.
fn units_by_kind() -> String {
    let parts: Vec<_> =
        SetPointKind::ALL.iter().map(|kind| format!("{} {kind} {}", kind.code(), kind.unit())).collect();
    parts.join(", ")
}

fn list<T: Copy + core::fmt::Display>(all: &[T], code: impl Fn(T) -> u64) -> String {
    let parts: Vec<_> = all.iter().map(|value| format!("{} {value}", code(*value))).collect();
    parts.join(", ")
}

fn flags(bits: &[(u64, &str)]) -> String {
    let parts: Vec<_> = bits.iter().map(|(bit, name)| format!("{bit} {name}")).collect();
    format!("sum of: {}", parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_flags_are_spelt_out() {
        let states = meaning(Topic::ControlStatus, "state");
        assert_eq!(
            states.as_deref(),
            Some("0 disarmed, 1 running, 2 quick-stop, 3 fault, 4 arming, 5 homing")
        );
        let sum: u64 = VALIDITY.iter().map(|(bit, _)| bit).sum();
        assert_eq!(sum, validity::END - 1);
        assert_eq!(meaning(Topic::Feedback, "angle_rad"), None);
        let units = meaning(Topic::SetPoint, "value").unwrap();
        assert!(units.contains("1 angle rad") && units.contains("3 flow m^3/s"), "{units}");
    }
}
