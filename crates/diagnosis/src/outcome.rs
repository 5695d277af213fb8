//! The result, as diagnosis.json holds it.

use serde::Serialize;
use std::collections::BTreeMap;
use valve_model::EffectId;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// One cause or more accepted; the residual is noise.
    Explained,
    /// One cause or more accepted, but the residual is not noise, or a group is ambiguous beside them.
    PartlyExplained,
    /// No cause accepted: a group of causes would explain the residual, but these data can't tell them apart.
    Ambiguous,
    /// The residual is not noise, no cause is accepted, and no group is ambiguous.
    Unexplained,
    /// The residual is noise without any cause.
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
    /// Noise of the measurement, RMS.
    pub noise: f64,
    /// Measured minus predicted, RMS.
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
    /// The evidence for it, and how it was fitted.
    pub evidence: BTreeMap<String, Evidence>,
    /// 1 − rms(all causes)/rms(all but this), on held-out runs, without laws that have no name.
    pub rms_gain: f64,
}

/// Causes that these data can't tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ambiguity {
    /// Which effects.
    pub ids: Vec<EffectId>,
    /// Why.
    pub reason: String,
    /// The one that fitted best, if no cause is accepted and there is no objection to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best: Option<BestOfGroup>,
    /// Each of them with its parameters, fitted in place of the others beside the remaining causes; empty if the search was ended before.
    pub rivals: Vec<RivalFit>,
}

/// One of a group of causes, fitted in place of the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalFit {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// RMS of measured minus predicted on held-out runs with it.
    pub rms_after: f64,
    /// The covariance of its parameters and of those fitted beside it.
    pub covariance: Covariance,
}

/// The one that fitted best of causes that can't be told apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BestOfGroup {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// RMS of measured minus predicted on held-out runs with it, and with the best of the other groups.
    pub rms_after: f64,
}

/// An effect that was found but is kept out of the extended model; users may add it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Offered {
    /// Which effect.
    pub id: EffectId,
    /// Its parameters.
    pub parameters: Parameters,
    /// Why it is kept out.
    pub reason: String,
    /// RMS of measured minus predicted on held-out runs with it and all accepted causes.
    pub rms_after: f64,
}

/// A ripple over the angle in the residual, taken from runs with enough turns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RippleLeft {
    /// Periods in a turn.
    pub order: usize,
    /// The root mean square over runs of its amplitude, in the channel's unit.
    pub amplitude: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Whether its phase is the same in all runs.
    pub in_phase: bool,
}

/// An effect and a reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Which effect.
    pub id: EffectId,
    /// Why.
    pub reason: String,
}

/// The gain of the causes in the error on runs that they were not fitted on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// Runs, or blocks "run@t0..t1".
    pub held_out_runs: Vec<String>,
    /// RMS of measured minus predicted with the given model.
    pub rms_before: f64,
    /// The same with the extended model.
    pub rms_after: f64,
    /// The first of these two with every residual divided by its standard deviation from the error model: where an encoder's
    /// steps make single samples jump, those dominate a plain RMS.
    pub over_noise_before: f64,
    /// The second of them, likewise.
    pub over_noise_after: f64,
    /// RMS after over before.
    pub ratio: f64,
    /// Its 95 % interval, by a bootstrap over runs.
    pub ratio_ci95: [f64; 2],
    /// The same in the closed loop, if it was simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop: Option<ClosedLoopGain>,
    /// What laws without a name bring; none without such laws.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unnamed: Option<UnnamedGain>,
}

/// The gain of laws without a name in the error on held-out runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnnamedGain {
    /// RMS of measured minus predicted with the accepted causes alone; with the given model where there are none.
    pub rms_before: f64,
    /// The same with the laws: that of the extended model.
    pub rms_after: f64,
    /// After over before.
    pub ratio: f64,
    /// Its 95 % interval, by a bootstrap over runs.
    pub ratio_ci95: [f64; 2],
}

/// A law that no cause of the list has, found in the residual; a formula or a table of the extended model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unnamed {
    /// Its name in the extended model.
    pub id: EffectId,
    /// `torque`, `level` or `viscous`.
    pub acts_on: String,
    /// The quantities that it depends on, the one that alone explains most first.
    pub depends_on: Vec<String>,
    /// The cause of the list that acts on the same by the same quantities, in another form.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<EffectId>,
    /// What it is.
    #[serde(flatten)]
    pub rule: UnnamedRule,
    /// A formula's parameters.
    pub parameters: Parameters,
    /// Laws that do as well in its place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rivals: Vec<Unnamed>,
}

/// How such a law goes.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum UnnamedRule {
    /// A formula.
    Formula {
        /// In the quantities and the parameters.
        expression: String,
    },
    /// A table, linear between its knots and on outside them.
    Table {
        /// Over what.
        over: Vec<String>,
        /// For each quantity its knots.
        knots: Vec<Vec<f64>>,
        /// The values there.
        values: Vec<f64>,
    },
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
    /// The share of its variance that this explains, less what chance explains.
    pub share: f64,
    /// The p-value, corrected for the number of tests.
    pub p_value: f64,
}

/// A harmonic of a turn in the residual.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Order {
    /// Periods per turn.
    pub order: usize,
    /// Amplitude of the part that acts the same in both directions.
    pub both_ways: f64,
    /// Its p-value, corrected for the number of orders.
    pub p_both_ways: f64,
    /// Amplitude of the part that acts against the motion.
    pub against_motion: f64,
    /// Its p-value, likewise.
    pub p_against_motion: f64,
}

/// The result of the test for whiteness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Whiteness {
    /// Number of lags tested.
    pub lags: usize,
    /// Ljung and Box's Q, about as large as `lags` for white noise.
    pub statistic: f64,
    /// The p-value.
    pub p_value: f64,
    /// The share of the residual's variance that is predictable from the preceding samples.
    pub foretold: f64,
    /// True if the residual counts as white: the test is not significant, or less than 2 % is predictable.
    pub white: bool,
}

/// A band of frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// From this frequency, Hz.
    pub from_hz: f64,
    /// To this one.
    pub to_hz: f64,
    /// RMS of the residual in the band.
    pub rms: f64,
    /// RMS of the measurement's noise in the band.
    pub noise: f64,
    /// Probability that noise alone is as large, corrected for the number of bands.
    pub p_value: f64,
}

/// A residual by size, whiteness, frequency and order of the angle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// RMS of the residual divided by the standard deviation of each sample.
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
    /// The verdict.
    pub verdict: Verdict,
    /// The size of the given model's residual.
    pub residual: Vec<Residual>,
    /// Accepted causes, most important first.
    pub causes: Vec<Cause>,
    /// Causes that can't be told apart.
    pub ambiguous: Vec<Ambiguity>,
    /// Laws that no cause of the list has, in the extended model. They explain nothing; causes that stood in for them are withdrawn.
    pub unnamed: Vec<Unnamed>,
    /// Causes that were tried and rejected.
    pub rejected: Vec<Judged>,
    /// Causes that these data can't show.
    pub untestable: Vec<Judged>,
    /// The gain in held-out error.
    pub gain: Gain,
    /// What to measure next.
    pub next_experiment: String,
    /// Whether the search was ended early with something left to explain: causes that are not named may exist all the same.
    pub search_ended: bool,
    /// What the residual of the given model depends on, largest share first.
    pub structure_before: Vec<Dependence>,
    /// What the residual after the accepted causes depends on.
    pub structure_after: Vec<Dependence>,
    /// The residual of the given model by frequency and order of the angle.
    pub description_before: Description,
    /// The residual after the accepted causes, likewise.
    pub description_after: Description,
    /// Parameters of the model that are corrected within their tolerance; they are no causes.
    pub within_tolerance: Vec<Corrected>,
    /// The covariance of the parameters of causes and corrections.
    pub covariance: Covariance,
    /// Doubtful causes that remove the largest part of the excess over noise, if none is accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<Nearest>,
    /// Nuisances, in words: what differs from run to run or disturbs the measurement, without being a cause.
    pub nuisances: Vec<String>,
    /// Effects that were found, but are not in the extended model.
    pub offered: Vec<Offered>,
    /// Ripples over the angle in the residual.
    pub ripples: Vec<RippleLeft>,
    /// Observations on the runs that are no cause, in words.
    pub observations: Vec<String>,
}

/// A parameter of the model that is corrected within its tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corrected {
    /// The effect that makes the same change.
    pub id: EffectId,
    /// "factor", or "offset_nm".
    pub key: String,
    /// Whether it is at the bound of its tolerance.
    pub at_bound: bool,
    /// Its value and uncertainty.
    #[serde(flatten)]
    pub found: ParameterFound,
}

impl Corrected {
    /// Whether it corrects what the transducer reads, and not the machine.
    pub fn is_of_transducer(&self) -> bool {
        self.id.is_of_transducer()
    }
}

/// The covariance of all parameters that were fitted, in the units of the model file.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Covariance {
    /// "id.key" of each; a correction as "within_tolerance.id.key", the encoder's zero as "angle_zero_rad".
    pub of: Vec<String>,
    /// Row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Causes that fit best, but leave too large a residual to be accepted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nearest {
    /// Their names.
    pub ids: Vec<EffectId>,
    /// The parameters of each.
    pub parameters: BTreeMap<EffectId, Parameters>,
    /// The share of the excess over noise that they remove together, on runs that they were not fitted on.
    pub removes: f64,
    /// The covariate that explains most of their residual; none if no recorded one is significant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaves_by: Option<String>,
}

/// The evidence that the given model has a cause already, with these numbers: the ones found are in their place, not beside them.
pub const IN_MODEL: &str = "in_model";

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
