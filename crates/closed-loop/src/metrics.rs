//! What a run came to: following error, pulse rate, torque reserve, lost steps, faults; from its messages, as they come.

use crate::in_process::CycleOutputs;
use signals::{
    ControlStatus, ControllerState, FaultCode, PlantTruth, Reference, SetPointRefusal, StepCommand,
};
use std::collections::BTreeMap;

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
#[derive(Debug, Clone, Copy, Default)]
struct Cycle {
    reference_rad: Option<f64>,
    true_rad: Option<f64>,
    running: Option<bool>,
}

/// Gathers what a run's summary says from its messages, in one pass and in little memory.
#[derive(Debug, Default)]
pub struct Metrics {
    open: BTreeMap<u64, Cycle>,
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
    /// Commands that the drive did not have in time.
    pub missed_commands: u64,
    /// The largest number of tooth pitches that the rotor was off.
    pub lost_steps: u64,
    /// The first fault.
    pub fault: Option<(FaultCode, u64)>,
    /// Set-points refused: id and reason.
    pub refused: BTreeMap<u64, SetPointRefusal>,
    /// Cycles of the plant.
    pub cycles: u64,
}

impl Metrics {
    /// Takes note of what a record of a cycle in process would hold.
    pub fn note_cycle(&mut self, outputs: &CycleOutputs) {
        let (cycle, arrived) = (outputs.cycle, &outputs.arrived);
        self.feedback(cycle);
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
    pub fn feedback(&mut self, cycle: u64) {
        self.cycles = self.cycles.max(cycle + 1);
    }

    /// Takes note of Reference.
    pub fn reference(&mut self, cycle: u64, reference: &Reference) {
        self.refusal(reference);
        self.open.entry(cycle).or_default().reference_rad = Some(reference.angle_rad);
        self.close(cycle);
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
        self.open.entry(cycle).or_default().true_rad = Some(truth.angle_rad);
        self.close(cycle);
    }

    /// Takes note of ControlStatus.
    pub fn status(&mut self, cycle: u64, status: &ControlStatus) {
        let running = status.state == ControllerState::Running.code();
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
        self.open.entry(cycle).or_default().running = Some(running);
        self.close(cycle);
    }

    /// A cycle of which all is known is counted and forgotten; so is one that stays incomplete for long.
    fn close(&mut self, cycle: u64) {
        if let Some(Cycle { reference_rad: Some(reference), true_rad: Some(angle), running: Some(running) }) =
            self.open.get(&cycle).copied()
        {
            self.open.remove(&cycle);
            if running {
                self.true_error.add(reference - angle);
                self.final_error_rad = Some(reference - angle);
            }
        }
        const PATIENCE: usize = 100_000;
        if self.open.len() > PATIENCE {
            self.open.pop_first();
        }
    }
}
