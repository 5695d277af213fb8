//! A row: what became of a run, in a few hundred bytes.

use closed_loop::{Metrics, Spread};
use serde::{Deserialize, Serialize};
use signals::FaultCode;

/// The longest reason that is kept, in characters: 10,000 rows are to stay below 5 MB even if all fail.
const LONGEST_REASON: usize = 300;

/// What became of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The run's number, from 0.
    pub run: u64,
    /// How it moved; `None` where nobody asked, or it could not be simulated.
    pub motion: Option<MotionMetrics>,
    /// What its diagnosis found; `None` where nobody asked, or it could not be diagnosed.
    pub diagnosed: Option<Diagnosed>,
    /// What went wrong with the run itself. A fault that stopped the valve is none: that is a result.
    pub failure: Option<Failure>,
}

/// What went wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Where.
    pub stage: Stage,
    /// Why, in words.
    pub reason: String,
}

impl Failure {
    /// With its reason in one line of bounded length.
    pub(crate) fn new(stage: Stage, reason: &str) -> Self {
        let line = reason.split_whitespace().collect::<Vec<_>>().join(" ");
        let mut reason: String = line.chars().take(LONGEST_REASON).collect();
        if reason.len() < line.len() {
            reason.push('…');
        }
        Self { stage, reason }
    }
}

/// Where a run failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stage {
    /// The varied texts make no scenario that can be simulated.
    Simulation,
    /// The record can't be diagnosed.
    Diagnosis,
    /// The program itself failed.
    Panic,
}

impl Stage {
    /// As tables write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simulation => "not simulated",
            Self::Diagnosis => "not diagnosed",
            Self::Panic => "panicked",
        }
    }
}

/// How a run moved. NaN is what is not known: the errors of a valve that never ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionMetrics {
    /// RMS of reference minus true angle while running, rad.
    pub error_rms_rad: f64,
    /// Its largest magnitude, rad.
    pub error_peak_rad: f64,
    /// RMS of reference minus measured angle while running, rad.
    pub measured_error_rms_rad: f64,
    /// Its largest magnitude, rad.
    pub measured_error_peak_rad: f64,
    /// Reference minus true angle in the last cycle while running, rad.
    pub final_error_rad: f64,
    /// Lowest torque reserve while running, N·m.
    pub torque_reserve_min_nm: f64,
    /// Highest pulse rate commanded, Hz.
    pub pulse_rate_peak_hz: f64,
    /// Cycles in which a limit held the command back.
    pub limiting_cycles: u64,
    /// Tooth pitches lost, at the worst.
    pub lost_steps: u64,
    /// Alarms raised: bits of [`signals::alarm`].
    pub alarms: u64,
    /// Why the valve was stopped: a [`FaultCode`], 0 for no fault.
    pub fault: u64,
    /// The cycle in which that was found; 0 without a fault.
    pub fault_cycle: u64,
}

impl MotionMetrics {
    /// From what the loop's messages came to.
    pub fn new(metrics: &Metrics) -> Self {
        let unknown = Spread { rms: f64::NAN, peak: f64::NAN };
        let (truth, measured) =
            (metrics.true_error().unwrap_or(unknown), metrics.measured_error().unwrap_or(unknown));
        let (fault, fault_cycle) = metrics.fault.map_or((0, 0), |(fault, cycle)| (fault.code(), cycle));
        Self {
            error_rms_rad: truth.rms,
            error_peak_rad: truth.peak,
            measured_error_rms_rad: measured.rms,
            measured_error_peak_rad: measured.peak,
            final_error_rad: metrics.final_error_rad.unwrap_or(f64::NAN),
            torque_reserve_min_nm: metrics.torque_reserve_min_nm.unwrap_or(f64::NAN),
            pulse_rate_peak_hz: metrics.pulse_rate_peak_hz,
            limiting_cycles: metrics.limiting_cycles,
            lost_steps: metrics.lost_steps,
            alarms: metrics.alarms,
            fault,
            fault_cycle,
        }
    }

    /// The fault by its name; empty without one.
    pub fn fault_name(&self) -> &'static str {
        let fault = FaultCode::from_code(self.fault).filter(|fault| *fault != FaultCode::None);
        fault.map_or("", FaultCode::name)
    }
}

/// What a diagnosis found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosed {
    /// The verdict, as diagnosis.json has it.
    pub verdict: String,
    /// Accepted causes, the most important first.
    pub causes: Vec<String>,
    /// Groups of causes that can't be told apart.
    pub ambiguous: Vec<Vec<String>>,
    /// RMS of measured less predicted angle, rad.
    pub residual_rms_rad: f64,
    /// RMS on held-out parts with what was found over that without.
    pub gain_ratio: f64,
}

impl Row {
    /// Whether the valve was stopped by a fault or lost steps, or the run itself failed.
    pub fn is_bad(&self) -> bool {
        self.failure.is_some()
            || self.motion.as_ref().is_some_and(|motion| motion.fault != 0 || motion.lost_steps > 0)
    }

    /// How bad it is beside others: what could not be simulated, then faults, then lost steps, then the following error; where only a diagnosis
    /// was asked for, the belief's error. Larger is worse.
    pub fn badness(&self) -> (u8, f64) {
        let belief_rad = || self.diagnosed.as_ref().map_or(0.0, |found| found.residual_rms_rad);
        let error_rad = self.motion.as_ref().map_or_else(belief_rad, |motion| motion.error_rms_rad);
        let known = if error_rad.is_nan() { 0.0 } else { error_rad };
        let class = match (&self.failure, &self.motion) {
            (Some(_), None) => 3,
            (_, Some(motion)) if motion.fault != 0 => 2,
            (_, Some(motion)) if motion.lost_steps > 0 => 1,
            _ => 0,
        };
        (class, known)
    }
}
