//! What of the loop is worth a line: the differences between one look at it and the next.

use super::advice::{advice, advice_on_alarm, reason};
use super::entry::EventKind;
use crate::request::Request;
use signals::{ControllerState, FaultCode, HeldFlow, alarm};

/// What the supervisor sees at one look.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    /// The controller's state.
    pub(crate) state: ControllerState,
    /// Why it stopped the valve.
    pub(crate) fault: FaultCode,
    /// Why the plant side did.
    pub(crate) drive_fault: FaultCode,
    /// When, in cycles.
    pub(crate) fault_cycle: u64,
    /// Its alarms.
    pub(crate) alarms: u64,
    /// Whether a flow that is to be held is.
    pub(crate) held_flow: HeldFlow,
    /// Processes of the loop that say nothing.
    pub(crate) silent: Vec<&'static str>,
    /// Whether the disk takes the record.
    pub(crate) recorded: bool,
}

/// Remembers the last look.
#[derive(Debug, Default)]
pub(crate) struct Transitions {
    before: Option<Seen>,
}

/// States that an order leads to, which its answer tells of.
fn expected(order: Option<&Request>) -> &'static [ControllerState] {
    use ControllerState::{Arming, Disarmed, Homing, QuickStop, Running};
    match order {
        Some(Request::Arm) => &[Arming, Running],
        Some(Request::Home) => &[Arming, Homing],
        Some(Request::Disarm) => &[QuickStop, Disarmed],
        Some(Request::Reset) => &[Disarmed],
        _ => &[],
    }
}

impl Transitions {
    /// Who was silent at the last look.
    pub(crate) fn silent(&self) -> Vec<&'static str> {
        self.before.as_ref().map_or_else(Vec::new, |before| before.silent.clone())
    }

    /// What is new since the last look; `order` is being carried out meanwhile.
    pub(crate) fn look(&mut self, seen: Seen, order: Option<&Request>) -> Vec<(EventKind, String)> {
        let Some(before) = self.before.replace(seen.clone()) else { return Vec::new() };
        let mut news = Vec::new();
        if seen.fault != before.fault && seen.fault != FaultCode::None {
            let (fault, cycle, reason) = (seen.fault, seen.fault_cycle, reason(seen.fault, seen.drive_fault));
            let named = if reason == fault { fault.to_string() } else { format!("{fault} ({reason})") };
            news.push((EventKind::Fault, format!("{named}, found in cycle {cycle}: {}", advice(reason))));
        }
        if seen.state != before.state && !expected(order).contains(&seen.state) {
            news.extend(state_words(&seen).map(|words| (EventKind::State, words.to_owned())));
        }
        let raised = alarm::names(seen.alarms & !before.alarms);
        news.extend(raised.map(|name| (EventKind::Alarm, format!("{name}: {}", advice_on_alarm(name)))));
        let held = held_flow_words(before.held_flow, seen.held_flow);
        news.extend(held.map(|words| (EventKind::Alarm, words.to_owned())));
        let fell_silent = seen.silent.iter().filter(|name| !before.silent.contains(name));
        news.extend(fell_silent.map(|name| (EventKind::Process, format!("{name} is silent"))));
        let back = before.silent.iter().filter(|name| !seen.silent.contains(name));
        news.extend(back.map(|name| (EventKind::Process, format!("{name} is heard again"))));
        if seen.recorded != before.recorded {
            let words = if seen.recorded {
                "the disk takes the record again"
            } else {
                "THE DISK DOES NOT TAKE THE RECORD"
            };
            news.push((EventKind::Record, words.to_owned()));
        }
        news
    }
}

/// What became of the flow that is to be held, where it is new.
fn held_flow_words(before: HeldFlow, now: HeldFlow) -> Option<&'static str> {
    match now {
        _ if now == before => None,
        HeldFlow::None => None,
        HeldFlow::Held if before == HeldFlow::None => None,
        HeldFlow::Held => Some("the flow is held again"),
        HeldFlow::OutOfReach => Some(
            "the flow is out of reach: no angle within the limits of motion gives it at the present pressure drop; the valve stands as near as they let it come, and follows again once it can",
        ),
        HeldFlow::NoPressure => Some(
            "the flow is not held: the pressure drop is not measured any more; the valve stays where it is until it is",
        ),
    }
}

/// A state that was entered, where it is worth a line: those that a fault passes through are not.
fn state_words(seen: &Seen) -> Option<&'static str> {
    match seen.state {
        ControllerState::Disarmed => Some("disarmed: the valve stands"),
        ControllerState::Running => Some("running"),
        ControllerState::QuickStop if seen.fault == FaultCode::None => Some("stopping"),
        ControllerState::Fault if seen.fault == FaultCode::FeedbackSilent => Some(
            "the command stands; whether the valve does is not known, since nothing is heard of it; `stepvalve reset` leaves the fault once it is",
        ),
        ControllerState::Fault => Some("the valve stands; `stepvalve reset` leaves the fault, disarmed"),
        ControllerState::QuickStop | ControllerState::Arming | ControllerState::Homing => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen() -> Seen {
        Seen {
            state: ControllerState::Running,
            fault: FaultCode::None,
            drive_fault: FaultCode::None,
            fault_cycle: 0,
            alarms: 0,
            held_flow: HeldFlow::None,
            silent: Vec::new(),
            recorded: true,
        }
    }

    fn disarmed() -> Seen {
        Seen { state: ControllerState::Disarmed, ..seen() }
    }

    fn news(before: Seen, after: Seen, order: Option<&Request>) -> Vec<EventKind> {
        let mut transitions = Transitions::default();
        assert!(transitions.look(before, None).is_empty(), "the first look tells nothing new");
        transitions.look(after, order).into_iter().map(|(kind, _)| kind).collect()
    }

    /// A generation ends while a process is silent: who died is not heard again.
    #[test]
    fn what_was_said_of_silence_can_be_left_as_it_is() {
        let mut transitions = Transitions::default();
        assert!(transitions.silent().is_empty());
        let silent = Seen { silent: vec!["step-controller"], ..seen() };
        transitions.look(seen(), None);
        transitions.look(silent, None);
        let ending = Seen { silent: transitions.silent(), ..seen() };
        assert!(transitions.look(ending, None).is_empty());
    }

    #[test]
    fn what_is_worth_a_line() {
        let stopping = Seen { state: ControllerState::QuickStop, ..seen() };
        let faulty = Seen { fault: FaultCode::Drive, ..stopping.clone() };
        let fault = Seen { state: ControllerState::Fault, ..faulty.clone() };
        let silent = Seen { silent: vec!["step-controller"], ..seen() };
        let alarmed = Seen { alarms: alarm::OSCILLATION, ..seen() };
        let unrecorded = Seen { recorded: false, ..seen() };
        let [holds, far, blind] = [HeldFlow::Held, HeldFlow::OutOfReach, HeldFlow::NoPressure]
            .map(|held_flow| Seen { held_flow, ..seen() });
        use EventKind::{Alarm, Fault, Process, Record, State};
        let table: [(Seen, Seen, Option<Request>, &[EventKind]); 21] = [
            (seen(), seen(), None, &[]),
            (disarmed(), seen(), Some(Request::Arm), &[]),
            (disarmed(), seen(), None, &[State]),
            (seen(), stopping.clone(), Some(Request::Disarm), &[]),
            (seen(), stopping.clone(), None, &[State]),
            (stopping, disarmed(), Some(Request::Disarm), &[]),
            (seen(), faulty.clone(), None, &[Fault]),
            (seen(), faulty.clone(), Some(Request::Disarm), &[Fault]),
            (faulty, fault.clone(), None, &[State]),
            (fault, disarmed(), Some(Request::Reset), &[]),
            (seen(), silent.clone(), None, &[Process]),
            (silent, seen(), None, &[Process]),
            (seen(), alarmed, None, &[Alarm]),
            (seen(), unrecorded, None, &[Record]),
            (seen(), holds.clone(), None, &[]),
            (holds.clone(), far.clone(), None, &[Alarm]),
            (far.clone(), far.clone(), None, &[]),
            (far.clone(), blind.clone(), None, &[Alarm]),
            (far.clone(), holds.clone(), None, &[Alarm]),
            (blind, holds, None, &[Alarm]),
            // Another set-point is followed.
            (far, seen(), None, &[]),
        ];
        for (before, after, order, expected) in table {
            let told = news(before.clone(), after.clone(), order.as_ref());
            assert_eq!(told, expected, "{before:?} to {after:?} at {order:?}");
        }
    }
}
