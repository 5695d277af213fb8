//! What the caller of a diagnosis may choose.

use crate::suspect::Suspect;
use valve_model::EffectId;

/// What can be chosen.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Decides which runs are held out, and the bootstrap's draws: the same seed gives the same answer.
    pub seed: u64,
    /// The measured channel's noise where it is known, RMS in its unit, above zero; without, it is estimated from the log.
    pub noise: Option<f64>,
    /// How well the model's parameters are known: the relative standard deviation of each (of the torque's zero relative to
    /// T_c); 0 if they are exact.
    pub tolerance: f64,
    /// Effects that are known exactly, as the model has them: neither causes nor corrections.
    pub fixed: Vec<EffectId>,
    /// Laws that the user suspects: rivals of the list's causes.
    pub suspects: Vec<Suspect>,
}
