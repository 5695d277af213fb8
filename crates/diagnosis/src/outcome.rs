//! What was found, as diagnosis.json holds it.

use serde::Serialize;
use std::collections::BTreeMap;
use valve_model::EffectId;

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// One cause or more accepted; what is left is noise.
    Explained,
    /// Causes accepted, structure left.
    PartlyExplained,
    /// A group of causes would explain it, and these data can't choose; none accepted.
    Ambiguous,
    /// Structure, nothing accepted, no group.
    Unexplained,
    /// Nothing beyond noise.
    NoDiscrepancy,
}

impl Verdict {
    /// As files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
            Self::NoDiscrepancy => "no-discrepancy",
        }
    }
}

/// The residual of the given model, all runs pooled over samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Residual {
    /// `torque` or `angle`.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// What the measurement scatters by itself, RMS.
    pub noise: f64,
    /// Measured less predicted, RMS.
    pub rms: f64,
}

/// A parameter of a cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterFound {
    /// Its value, as in the model file.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
    /// Its unit.
    pub unit: String,
}

/// Parameters by key; a list's entries as `cos[1]`, counted from 1.
pub type Parameters = BTreeMap<String, ParameterFound>;

/// An accepted cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// What speaks for it, and what beside it was looked at.
    pub evidence: BTreeMap<String, Evidence>,
    /// 1 − rms(all causes)/rms(all but this), on held-out runs.
    pub rms_gain: f64,
}

/// Causes that these data can't tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ambiguity {
    /// Which effects.
    pub ids: Vec<EffectId>,
    /// Why.
    pub reason: String,
    /// The one that fitted best, where no cause is accepted and nothing speaks against it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best: Option<BestOfGroup>,
    /// Each of them with its numbers, fitted beside the causes that are no question; none where the search was ended before.
    pub rivals: Vec<RivalFit>,
}

/// One of a group of causes, fitted in place of the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalFit {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// RMS of measured less predicted on held-out runs with it.
    pub rms_after: f64,
    /// What its numbers and those beside it have in common.
    pub covariance: Covariance,
}

/// What fitted best of causes that can't be told apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BestOfGroup {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// RMS of measured less predicted on held-out runs with it, and with the best of the other groups.
    pub rms_after: f64,
}

/// An effect that is there and that the extended model is better without: whoever wants it adds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Offered {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// Why it is kept out.
    pub reason: String,
    /// RMS of measured less predicted on held-out runs with it and all accepted causes.
    pub rms_after: f64,
}

/// A ripple over the angle that is left, as it is in runs that turn far enough.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RippleLeft {
    /// Periods in a turn.
    pub order: usize,
    /// Root of the mean square over runs of its amplitude, in the channel's unit.
    pub amplitude: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Whether its phase is the same in all runs.
    pub in_phase: bool,
}

/// A name and a reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Which effect.
    pub id: EffectId,
    /// Why.
    pub reason: String,
}

/// What the causes are worth on runs that they were not fitted on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// Runs, or blocks "run@t0..t1".
    pub held_out_runs: Vec<String>,
    /// RMS of measured less predicted before.
    pub rms_before: f64,
    /// The same after.
    pub rms_after: f64,
    /// The same two with every sample in parts of what the error model says of it: where an encoder's steps make single samples jump, a plain
    /// RMS is ruled by those.
    pub over_noise_before: f64,
    /// See above.
    pub over_noise_after: f64,
    /// RMS after over before.
    pub ratio: f64,
    /// Its 95 % interval, by drawing runs anew.
    pub ratio_ci95: [f64; 2],
    /// The same in the loop, where it was simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop: Option<ClosedLoopGain>,
}

/// Following errors with the old and the extended belief, the extended model being the truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClosedLoopGain {
    /// With the old belief, rad.
    pub following_error_rms_before_rad: f64,
    /// With the extended one, rad.
    pub following_error_rms_after_rad: f64,
    /// After over before.
    pub ratio: f64,
}

/// What the residual depends on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dependence {
    /// On what: "run", "speed", "angle, order 2", ...
    pub on: String,
    /// Whether the residual was taken with the sign of the direction of motion.
    pub as_friction: bool,
    /// The share of its variance that this explains, chance taken off.
    pub share: f64,
    /// Probability of as much by chance, corrected for the number of tests.
    pub p_value: f64,
}

/// A harmonic of a turn in the residual.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Order {
    /// Periods per turn.
    pub order: usize,
    /// Amplitude of what acts the same both ways, and the probability of as much by chance, corrected for the number of
    /// orders.
    pub both_ways: f64,
    /// See above.
    pub p_both_ways: f64,
    /// The same of what acts against the motion.
    pub against_motion: f64,
    /// See above.
    pub p_against_motion: f64,
}

/// What the test says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Whiteness {
    /// How many samples back were looked at.
    pub lags: usize,
    /// Ljung and Box's Q, about as large as `lags` for white noise.
    pub statistic: f64,
    /// Probability of as much by chance.
    pub p_value: f64,
    /// The share of the error's square that the samples before foretell.
    pub foretold: f64,
    /// Whether it is noise that no sample foretells: by chance, or by less than 2 %.
    pub white: bool,
}

/// A band of frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// From this frequency, Hz.
    pub from_hz: f64,
    /// To this one.
    pub to_hz: f64,
    /// RMS of the error in the band.
    pub rms: f64,
    /// What the measurement's noise has there.
    pub noise: f64,
    /// Probability that noise alone is as large, corrected for the number of bands.
    pub p_value: f64,
}

/// A residual by what it shows beside its dependences.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// RMS in parts of the noise, sample by sample.
    pub rms_over_noise: f64,
    /// Whether it is white.
    pub whiteness: Whiteness,
    /// By frequency, in the channel's unit.
    pub bands: Vec<Band>,
    /// By order of the angle, in the channel's unit.
    pub orders: Vec<Order>,
}

/// All that goes into diagnosis.json.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// "stepvalve-diagnosis"
    pub format: String,
    /// 1
    pub format_version: u32,
    /// The answer in a word.
    pub verdict: Verdict,
    /// What the given model gets wrong, in size.
    pub residual: Vec<Residual>,
    /// Accepted causes, most important first.
    pub causes: Vec<Cause>,
    /// Causes that can't be told apart.
    pub ambiguous: Vec<Ambiguity>,
    /// Causes tried and refused.
    pub rejected: Vec<Judged>,
    /// Causes that these data can't show.
    pub untestable: Vec<Judged>,
    /// What it is worth.
    pub gain: Gain,
    /// What to measure next.
    pub next_experiment: String,
    /// Whether the search was ended before it came to its end: what isn't named may be there all the same.
    pub search_ended: bool,
    /// What the residual depends on before, most first.
    pub structure_before: Vec<Dependence>,
    /// What is left depends on.
    pub structure_after: Vec<Dependence>,
    /// The residual of the given model by frequency and order of the angle.
    pub description_before: Description,
    /// What is left, the same way.
    pub description_after: Description,
    /// Numbers of the model that are corrected within their tolerance: no causes.
    pub within_tolerance: Vec<Corrected>,
    /// What the given causes' and corrections' numbers have in common.
    pub covariance: Covariance,
    /// Where nothing is accepted: what removes the largest part all the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<Nearest>,
    /// What differs from run to run by itself.
    pub nuisances: Vec<String>,
    /// Effects that are there, but not in the extended model.
    pub offered: Vec<Offered>,
    /// Ripples over the angle that are left.
    pub ripples: Vec<RippleLeft>,
    /// What the runs show that is no cause, in words.
    pub observations: Vec<String>,
}

/// A number of the model that is corrected within its tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corrected {
    /// The effect that the same change would be.
    pub id: EffectId,
    /// "factor", or "offset_nm".
    pub key: String,
    /// Whether the tolerance keeps it from going further.
    pub at_bound: bool,
    /// By how much.
    #[serde(flatten)]
    pub found: ParameterFound,
}

impl Corrected {
    /// Whether it is of what the transducer reads, which is no part of the machine.
    pub fn is_of_transducer(&self) -> bool {
        matches!(self.id, EffectId::TorqueGain | EffectId::TorqueOffset)
    }
}

/// The covariance of all numbers that were fitted, in the units of the model file.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Covariance {
    /// "id.key" of each; a correction as "within_tolerance.id.key", the encoder's zero as "angle_zero_rad".
    pub of: Vec<String>,
    /// Row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Causes that fit best and leave too much to be accepted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nearest {
    /// Their names.
    pub ids: Vec<EffectId>,
    /// The numbers of each.
    pub parameters: BTreeMap<EffectId, Parameters>,
    /// The part of the mean square beyond noise that they remove together, on runs that they were not fitted on.
    pub removes: f64,
    /// What most of what they leave depends on; none where nothing that was recorded stands out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaves_by: Option<String>,
}

/// A piece of evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Evidence {
    /// A number.
    Number(f64),
    /// Words.
    Text(String),
    /// Names with numbers.
    Numbers(BTreeMap<String, f64>),
}
