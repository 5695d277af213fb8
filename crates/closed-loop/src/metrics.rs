//! What a run came to: following error, pulse rate, torque reserve, lost steps, faults; from its messages, as they come.

use crate::in_process::CycleOutputs;
use signals::{
    ControlStatus, ControllerState, FaultCode, Feedback, HeldFlow, PlantTruth, Reference, SetPointRefusal,
    StepCommand,
};
use std::collections::{BTreeMap, VecDeque};

/// RMS and peak of a quantity.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Root of the mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
}

/// Sums up a quantity sample by sample.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    squares: f64,
    count: u64,
    peak: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        self.squares += value * value;
        self.count += 1;
        self.peak = self.peak.max(value.abs());
    }

    fn spread(self) -> Option<Spread> {
        (self.count > 0).then(|| Spread { rms: (self.squares / self.count as f64).sqrt(), peak: self.peak })
    }
}

/// What becomes known of a cycle piece by piece, as its messages come.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Cycle {
    reference_rad: Option<f64>,
    true_rad: Option<f64>,
    running: Option<bool>,
}

/// Cycles of which something is known and something not yet, beside each other: this is asked in every cycle of a campaign, and a
/// map costs a twentieth of the loop.
#[derive(Debug, Default)]
struct Open {
    /// The first of them.
    first: u64,
    cycles: VecDeque<Cycle>,
}

impl Open {
    /// A cycle that stays incomplete is forgotten when so many have followed it.
    const PATIENCE: u64 = 100_000;

    /// What is known of a cycle; `None` of one that is long past.
    fn at(&mut self, cycle: u64) -> Option<&mut Cycle> {
        if self.cycles.is_empty() || cycle > self.first.saturating_add(2 * Self::PATIENCE) {
            self.cycles.clear();
            self.first = cycle;
        }
        if cycle.saturating_add(Self::PATIENCE) < self.first {
            return None;
        }
        while cycle < self.first {
            self.cycles.push_front(Cycle::default());
            self.first -= 1;
        }
        while cycle - self.first >= Self::PATIENCE {
            self.cycles.pop_front();
            self.first += 1;
        }
        let index = (cycle - self.first) as usize;
        while self.cycles.len() <= index {
            self.cycles.push_back(Cycle::default());
        }
        self.cycles.get_mut(index)
    }

    /// Forgets what nothing is known of at the beginning.
    fn shorten(&mut self) {
        while self.cycles.front() == Some(&Cycle::default()) {
            self.cycles.pop_front();
            self.first += 1;
        }
    }
}

/// Gathers what a run's summary says from its messages, in one pass and in little memory.
#[derive(Debug, Default)]
pub struct Metrics {
    open: Open,
    measured_error: Sum,
    true_error: Sum,
    /// Reference minus true angle in the last cycle in which the controller ran, rad.
    pub final_error_rad: Option<f64>,
    /// Highest pulse rate commanded, Hz.
    pub pulse_rate_peak_hz: f64,
    /// Lowest torque reserve while running, N·m.
    pub torque_reserve_min_nm: Option<f64>,
    /// Cycles in which a limit held the command back.
    pub limiting_cycles: u64,
    /// Alarms raised: bits of [`signals::alarm`].
    pub alarms: u64,
    /// Cycles in which a flow that was to be held was out of reach, or not known for want of a pressure drop.
    pub unheld_flow_cycles: u64,
    /// Commands that the drive did not have in time.
    pub missed_commands: u64,
    /// The largest number of tooth pitches that the rotor was off.
    pub lost_steps: u64,
    /// The controller's first fault.
    pub fault: Option<(FaultCode, u64)>,
    /// The first fault that the drive told of while the controller was not disarmed.
    drive_fault: Option<(FaultCode, u64)>,
    is_armed: bool,
    /// Set-points refused: id and reason.
    pub refused: BTreeMap<u64, SetPointRefusal>,
    /// Cycles of the plant.
    pub cycles: u64,
}

impl Metrics {
    /// Takes note of what a record of a cycle in process would hold.
    pub fn note_cycle(&mut self, outputs: &CycleOutputs) {
        let (cycle, arrived) = (outputs.cycle, &outputs.arrived);
        self.cycles = self.cycles.max(cycle + 1);
        arrived.feedback.iter().for_each(|feedback| self.feedback(cycle, feedback));
        outputs.plant.iter().for_each(|plant| self.truth(cycle, &plant.truth));
        arrived.reference.iter().for_each(|reference| self.reference(cycle + 2, reference));
        arrived.command.iter().for_each(|command| self.command(command));
        arrived.status.iter().for_each(|status| self.status(cycle, status));
    }

    /// Following error as the encoder saw it, rad; `None` if the controller never ran.
    pub fn measured_error(&self) -> Option<Spread> {
        self.measured_error.spread()
    }

    /// Following error of the true angle, rad; `None` where nobody knows it.
    pub fn true_error(&self) -> Option<Spread> {
        self.true_error.spread()
    }

    /// Takes note of Feedback.
    pub fn feedback(&mut self, cycle: u64, feedback: &Feedback) {
        self.cycles = self.cycles.max(cycle + 1);
        let fault = FaultCode::from_code(feedback.drive_fault).unwrap_or(FaultCode::None);
        // A drive that nobody commands any more stops by itself: at the end of a run that is no fault.
        if self.is_armed && fault != FaultCode::None {
            self.drive_fault.get_or_insert((fault, cycle));
        }
    }

    /// What stopped the valve, and in which cycle: the controller's fault, or the drive's where that stopped by itself.
    pub fn stopped_by(&self) -> Option<(FaultCode, u64)> {
        match (self.fault, self.drive_fault) {
            (None | Some((FaultCode::Drive, _)), Some(drive)) => Some(drive),
            (fault, _) => fault,
        }
    }

    /// Takes note of Reference.
    pub fn reference(&mut self, cycle: u64, reference: &Reference) {
        self.refusal(reference);
        let unheld = [HeldFlow::OutOfReach, HeldFlow::NoPressure].map(HeldFlow::code);
        self.unheld_flow_cycles += u64::from(unheld.contains(&reference.held_flow));
        self.know(cycle, |of| of.reference_rad = Some(reference.angle_rad));
    }

    /// Takes note of StepCommand.
    pub fn command(&mut self, command: &StepCommand) {
        self.pulse_rate_peak_hz = self.pulse_rate_peak_hz.max(command.pulse_rate_hz.abs());
    }

    fn refusal(&mut self, reference: &Reference) {
        let refusal = SetPointRefusal::from_code(reference.refusal).unwrap_or(SetPointRefusal::None);
        if refusal != SetPointRefusal::None {
            self.refused.insert(reference.refused_id, refusal);
        }
    }

    /// Takes note of PlantTruth.
    pub fn truth(&mut self, cycle: u64, truth: &PlantTruth) {
        self.lost_steps = self.lost_steps.max(truth.lost_teeth.unsigned_abs());
        self.know(cycle, |of| of.true_rad = Some(truth.angle_rad));
    }

    /// Takes note of ControlStatus.
    pub fn status(&mut self, cycle: u64, status: &ControlStatus) {
        let running = status.state == ControllerState::Running.code();
        self.is_armed = status.state != ControllerState::Disarmed.code();
        if running {
            self.measured_error.add(status.following_error_rad);
            let lowest = self.torque_reserve_min_nm.unwrap_or(f64::INFINITY);
            self.torque_reserve_min_nm = Some(lowest.min(status.torque_reserve_nm));
            self.limiting_cycles += u64::from(status.limiting != 0);
            self.alarms |= status.alarms;
            self.missed_commands = self.missed_commands.max(status.missed_commands);
        }
        let fault = FaultCode::from_code(status.fault).unwrap_or(FaultCode::None);
        if fault != FaultCode::None {
            self.fault.get_or_insert((fault, status.fault_cycle));
        }
        self.know(cycle, |of| of.running = Some(running));
    }

    /// Takes note of a piece of a cycle; one of which all is known is counted and forgotten.
    fn know(&mut self, cycle: u64, note: impl FnOnce(&mut Cycle)) {
        let Some(of) = self.open.at(cycle) else { return };
        note(of);
        let Cycle { reference_rad: Some(reference), true_rad: Some(angle), running: Some(running) } = *of
        else {
            return;
        };
        *of = Cycle::default();
        self.open.shorten();
        if running {
            self.true_error.add(reference - angle);
            self.final_error_rad = Some(reference - angle);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn metrics(order: impl Iterator<Item = (u64, usize)>) -> Metrics {
        let mut metrics = Metrics::default();
        for (cycle, piece) in order {
            metrics.know(cycle, |of| match piece {
                0 => of.reference_rad = Some(cycle as f64),
                1 => of.true_rad = Some(0.0),
                _ => of.running = Some(true),
            });
        }
        metrics
    }

    #[test]
    fn pieces_may_come_in_any_order() {
        let forwards = metrics((0..100).flat_map(|cycle| (0..3).map(move |piece| (cycle, piece))));
        let by_piece = metrics((0..3).flat_map(|piece| (0..100).rev().map(move |cycle| (cycle, piece))));
        for metrics in [&forwards, &by_piece] {
            assert_eq!(metrics.true_error().unwrap().peak, 99.0);
            assert_eq!(metrics.true_error.count, 100);
            assert!(metrics.open.cycles.is_empty());
        }
        assert_eq!((forwards.final_error_rad, by_piece.final_error_rad), (Some(99.0), Some(0.0)));
    }

    #[test]
    fn a_generation_begins_anew_and_gaps_are_forgotten() {
        let all = |cycle: u64| (0..3).map(move |piece| (cycle, piece));
        let far = 10_000_000;
        let order = (50..60).chain([far]).chain(5..10).chain(far + 1..far + 3).flat_map(all);
        // Cycle 20 stays incomplete; those far back come too late for the last of all.
        let metrics = metrics([(20, 0)].into_iter().chain(order));
        assert_eq!(metrics.true_error.count, 10 + 1 + 5 + 2);
        assert!(metrics.open.cycles.is_empty());
    }
}
