//! Following error of one scenario at a chosen compensation, in one thread, and what limited it.

use crate::in_process::InProcess;
use crate::wiring::{Parts, WiringError, wire};
use config::{Compensation, Scenario, usual_damping};
use signals::{ControllerState, FaultCode};
use std::collections::VecDeque;
use valve_model::Model;

/// How the controller works against friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level {
    /// What it feeds forward.
    pub feed_forward: Compensation,
    /// Whether an encoder is fitted and its observer at work.
    pub encoder: bool,
}

impl Level {
    /// Nothing at all.
    pub const NONE: Self = Self { feed_forward: Compensation::None, encoder: false };
    /// The belief's law alone.
    pub const FULL: Self = Self { feed_forward: Compensation::Full, encoder: false };
    /// The belief's law and the observer.
    pub const OBSERVED: Self = Self { feed_forward: Compensation::Full, encoder: true };
}

/// After this time at rest the reference has settled, and so should the command, s.
const RESTED_S: f64 = 0.3;

/// What a run came to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Outcome {
    /// RMS of reference minus true angle while running, rad.
    pub rms_rad: f64,
    /// Its largest magnitude, rad.
    pub peak_rad: f64,
    /// Cycles in which a limit held the command back.
    pub limiting_cycles: u64,
    /// Tooth pitches that the rotor was off at the end of the run.
    pub lost_teeth: i64,
    /// What stopped the valve.
    pub fault: Option<FaultCode>,
    /// Alarms raised: bits of [`signals::alarm`].
    pub alarms: u64,
    /// Cycles with pulses although the reference has rested for 0.3 s.
    pub restless_cycles: u64,
    /// How often the pulses changed direction in one such rest, at most: a correction makes one, hunting never ends.
    pub reversals_at_rest: u64,
    /// Cycles while running.
    pub cycles: u64,
}

/// Runs a scenario with a level in place of its own.
///
/// # Errors
/// A model that the scenario can't be wired with.
pub fn measure(
    scenario: &Scenario,
    truth: &Model,
    belief: &Model,
    level: Level,
) -> Result<Outcome, WiringError> {
    Ok(measure_parts(&wire_level(scenario, truth, belief, level)?))
}

/// Wires a scenario with a level in place of its own.
///
/// # Errors
/// A model that the scenario can't be wired with.
pub fn wire_level(
    scenario: &Scenario,
    truth: &Model,
    belief: &Model,
    level: Level,
) -> Result<Parts, WiringError> {
    let mut scenario = scenario.clone();
    scenario.compensation = level.feed_forward;
    scenario.encoder.fitted = level.encoder;
    scenario.control.observer = level.encoder;
    scenario.control.damping = usual_damping(level.encoder, &scenario.encoder, scenario.period_ns);
    wire(&scenario, truth, belief)
}

/// Runs what is wired. The spool's angle is the encoder's without its noise: where the encoder's zero is not the motor's,
/// that is the one that counts.
pub fn measure_parts(parts: &Parts) -> Outcome {
    let mut outcome = Outcome::default();
    let mut rest = Rest::default();
    // Reference k was sent in cycle k−2.
    let mut sent = VecDeque::from([None, None]);
    let mut squares = 0.0;
    for cycle in InProcess::new(parts) {
        sent.push_back(Some(cycle.reference.angle_rad));
        let wanted_rad = sent.pop_front().flatten();
        let (status, truth) = (&cycle.status, &cycle.plant.truth);
        let fault = FaultCode::from_code(status.fault).filter(|fault| *fault != FaultCode::None);
        outcome.fault = outcome.fault.or(fault);
        if status.state != ControllerState::Running.code() {
            continue;
        }
        let Some(wanted_rad) = wanted_rad else { continue };
        let error_rad = wanted_rad - (truth.angle_rad + truth.encoder_zero_rad);
        squares += error_rad * error_rad;
        outcome.cycles += 1;
        outcome.peak_rad = outcome.peak_rad.max(error_rad.abs());
        outcome.limiting_cycles += u64::from(status.limiting != 0);
        outcome.alarms |= status.alarms;
        rest.note(parts.timeline.period_s(), cycle.reference.moving == 1, truth.pulses, &mut outcome);
        outcome.lost_teeth = truth.lost_teeth;
    }
    outcome.rms_rad = (squares / outcome.cycles.max(1) as f64).sqrt();
    outcome
}

/// How long the reference has rested, s, the direction of the last pulses there, and how often it changed.
#[derive(Default)]
struct Rest {
    rested_s: f64,
    direction: i64,
    reversals: u64,
}

impl Rest {
    fn note(&mut self, period_s: f64, moving: bool, pulses: i64, outcome: &mut Outcome) {
        if moving {
            *self = Self::default();
            return;
        }
        self.rested_s += period_s;
        if self.rested_s <= RESTED_S || pulses == 0 {
            return;
        }
        outcome.restless_cycles += 1;
        self.reversals += u64::from(pulses.signum() == -self.direction);
        self.direction = pulses.signum();
        outcome.reversals_at_rest = outcome.reversals_at_rest.max(self.reversals);
    }
}
