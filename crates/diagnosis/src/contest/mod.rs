//! Explanations that a log can't tell apart, and what an experiment would say of them.
//!
//! An experiment's worth is the expected log Bayes factor between two rivals: with the one true, half the squared distance of
//! the other's prediction, in standard deviations of the measurement, once the other's numbers have gone as far towards it as
//! the log at hand lets them (Box and Hill, Technometrics 9, 1967; the linear case). Experiments add up, so that the normal
//! equations of each are enough to plan with.

mod choice;
mod evidence;

use crate::extend::hypothesis::Hypothesis;
use nalgebra::DMatrix;
use valve_model::Model;

pub use choice::{Choice, Trial, choose};

/// One of the explanations, fitted to the log at hand.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contender {
    /// What it is called: an effect's name, or a law's formula.
    pub label: String,
    pub hypothesis: Hypothesis,
    /// Of the hypothesis' free numbers.
    pub covariance: DMatrix<f64>,
}

/// Explanations that a log can't tell apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    given: Model,
    contenders: Vec<Contender>,
    /// Standard deviation of a sample that counts as independent of the others, N·m or rad.
    deviation: f64,
    /// Standard deviation of the torque's zero from run to run, N·m.
    zero_nm: f64,
    /// How far the contact has travelled before the next experiment, rad.
    distance_rad: f64,
    /// Independent samples of the log at hand.
    samples: f64,
}

impl Contest {
    /// `None` with fewer than two contenders.
    pub(crate) fn new(
        given: &Model,
        contenders: Vec<Contender>,
        (deviation, zero_nm): (f64, f64),
        (distance_rad, samples): (f64, f64),
    ) -> Option<Self> {
        (contenders.len() > 1).then(|| Self {
            given: given.clone(),
            contenders,
            deviation,
            zero_nm,
            distance_rad,
            samples,
        })
    }

    /// Whom it is between.
    pub fn labels(&self) -> Vec<&str> {
        self.contenders.iter().map(|contender| contender.label.as_str()).collect()
    }

    /// The same measured with `part` of the noise: whether a better sensor would decide it.
    #[must_use]
    pub fn with_noise(&self, part: f64) -> Self {
        Self { deviation: part * self.deviation, ..self.clone() }
    }
}
