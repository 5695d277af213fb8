//! Following error of one scenario at a chosen compensation, in one thread, and what limited it.

use crate::in_process::InProcess;
use crate::wiring::{WiringError, wire};
use config::{Compensation, Damping, Scenario};
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
    let mut scenario = scenario.clone();
    scenario.compensation = level.feed_forward;
    scenario.encoder.fitted = level.encoder;
    scenario.control.observer = level.encoder;
    let damps = level.encoder && scenario.period_ns <= config::LONGEST_DAMPING_PERIOD_NS;
    scenario.control.damping = if damps { Damping::Active } else { Damping::None };
    let parts = wire(&scenario, truth, belief)?;
    let mut outcome = Outcome::default();
    // Reference k was sent in cycle k−2.
    let mut sent = VecDeque::from([None, None]);
    let (mut squares, mut resting_s) = (0.0, 0.0);
    for cycle in InProcess::new(&parts) {
        sent.push_back(Some(cycle.reference.angle_rad));
        let wanted_rad = sent.pop_front().flatten();
        let status = &cycle.status;
        let fault = FaultCode::from_code(status.fault).filter(|fault| *fault != FaultCode::None);
        outcome.fault = outcome.fault.or(fault);
        if status.state != ControllerState::Running.code() {
            continue;
        }
        let Some(wanted_rad) = wanted_rad else { continue };
        let error_rad = wanted_rad - cycle.plant.truth.angle_rad;
        squares += error_rad * error_rad;
        outcome.cycles += 1;
        outcome.peak_rad = outcome.peak_rad.max(error_rad.abs());
        outcome.limiting_cycles += u64::from(status.limiting != 0);
        outcome.alarms |= status.alarms;
        resting_s = if cycle.reference.moving == 1 { 0.0 } else { resting_s + scenario.period_s() };
        let restless = resting_s > RESTED_S && cycle.command.pulse_rate_hz != 0.0;
        outcome.restless_cycles += u64::from(restless);
        outcome.lost_teeth = cycle.plant.truth.lost_teeth;
    }
    outcome.rms_rad = (squares / outcome.cycles.max(1) as f64).sqrt();
    Ok(outcome)
}
