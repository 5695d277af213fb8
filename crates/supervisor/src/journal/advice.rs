//! What a fault means, and what to do about it.

use signals::{FaultCode, alarm};

/// What really stopped the valve: where the controller says that the drive did, what the drive says.
pub fn reason(fault: FaultCode, drive_fault: FaultCode) -> FaultCode {
    if fault == FaultCode::Drive && drive_fault != FaultCode::None { drive_fault } else { fault }
}

/// What it means and what to do, in a sentence each; empty for no fault.
pub fn advice(fault: FaultCode) -> &'static str {
    match fault {
        FaultCode::None => "",
        FaultCode::FeedbackSilent => {
            "the controller heard nothing of the valve: its process, its bus or the machine stalled; the list of processes in `stepvalve status` says who is late or silent"
        }
        FaultCode::ReferenceSilent => {
            "the controller heard nothing of the trajectory generator: its process or the machine stalled; the list of processes in `stepvalve status` says who is late or silent"
        }
        FaultCode::CommandSilent => {
            "the drive heard nothing of the controller and stopped the valve by itself: the controller or the machine stalled; `stepvalve doctor` measures for how long this machine does, and silence_cycles is what the scenario allows"
        }
        FaultCode::FollowingError => {
            "the valve did not follow: look for a jam, a load beyond the motor's torque, or limits of motion that ask too much"
        }
        FaultCode::Drive => {
            "the drive stopped the valve by itself: it heard no commands for too long, or it has a fault of its own, which its display tells"
        }
        FaultCode::LostSteps => {
            "the encoder says that the rotor is at another tooth: the torque asked was more than the motor has, or the encoder's count jumped (look at its cable and shield); home the valve before you trust its angle"
        }
        FaultCode::ReferenceLimit => {
            "the reference left the scenario's limits of motion: a defect of the trajectory generator, or a message that was altered"
        }
        FaultCode::CommandMismatch => {
            "the drive does not do what it is told: check its wiring and its settings"
        }
        FaultCode::BusLost => "no good reply on the drive's bus: check cable and power of the drive",
        FaultCode::DriveLeftOperation => {
            "the drive ended its operation, or did not begin it: look at its display; `stepvalve status` has its status word, which ends in 0x27 with bit 12 set while it follows, and its mode, 8"
        }
        FaultCode::NotSynchronised => {
            "the cycle and the bus's clock drift apart: `stepvalve doctor` looks at the machine"
        }
        FaultCode::NotEnergised => {
            "the drive did not energise the motor in time: check its power and its enable input; on a bus `stepvalve status` has its status word, which ends in 0x27 with bit 12 set once it follows, and its mode, 8"
        }
        FaultCode::Homing => {
            "no mark, or no steady alignment, was found: check the switch, the stop or the index, and the speeds in [homing]"
        }
        FaultCode::AngleLimit => {
            "the valve left the scenario's limits of angle: check its zero before it moves again"
        }
        FaultCode::NeverRests => {
            "the pulses have stopped, but the encoder still moves: look for a load that drives the valve, or a noisy encoder"
        }
    }
}

/// What an alarm means and what to do, by its name; empty where there is none of that name.
pub fn advice_on_alarm(name: &str) -> &'static str {
    let bit = alarm::NAMES.iter().find(|(_, of)| *of == name).map_or(0, |(bit, _)| *bit);
    match bit {
        alarm::OSCILLATION | alarm::OBSERVER_OFF => {
            "the belief's inertia or stiffness is not the valve's, or its encoder is loose: `stepvalve tune` measures them; arming anew tries the observer again"
        }
        alarm::OBSERVER_SATURATED => {
            "the valve takes another torque than believed, for longer than a reversal takes: look for a load or a jam, or let `stepvalve tune` measure it"
        }
        alarm::COMMANDS_LOST => {
            "more than a third of them were late or lost: the machine or the bus stalled; `stepvalve doctor` measures it; arming anew tries the observer again"
        }
        alarm::LOAD_BELOW_BELIEF => {
            "the believed friction is too high, a load helps the motion, or the angle is wrong by whole steps: `stepvalve tune` measures the friction"
        }
        alarm::LOAD_ABOVE_BELIEF => {
            "the believed friction is too low, a load is against the motion, or the encoder has play: `stepvalve tune` measures the friction"
        }
        alarm::INERTIA => {
            "the believed inertia is off, or the encoder does not turn as the valve does: `stepvalve tune` measures it"
        }
        alarm::NO_BENEFIT => {
            "the belief is far from the valve: `stepvalve tune` measures it; `stepvalve set parameter` or arming anew tries the compensation again"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_alarm_has_one() {
        for (_, name) in alarm::NAMES {
            assert!(!advice_on_alarm(name).is_empty(), "{name}");
        }
        assert!(advice_on_alarm("").is_empty());
    }

    #[test]
    fn every_fault_has_one() {
        for fault in FaultCode::ALL {
            assert_eq!(advice(*fault).is_empty(), *fault == FaultCode::None, "{fault}");
        }
    }
}
