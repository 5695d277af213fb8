//! Measured data against the model: show what it gets wrong, name the cause, extend the model, measure the gain.
//!
//! Pure calculation on runs in memory: no file, clock or thread; who calls lends the threads ([`Workers`]). The way:
//! runs are cut into pieces whose motion is smoothed once; the noise is estimated; rival causes (the effects of
//! valve-model) are screened by the sensitivities of the prediction, fitted through the model, compared on runs that
//! they were not fitted on, and accepted one after the other; what is left is tested for structure.
#![forbid(unsafe_code)]

mod conclude;
mod diagnose;
mod error;
mod extend;
mod fit;
#[cfg(test)]
mod fixtures;
mod found;
mod log;
mod measure;
mod name;
mod numerics;
mod options;
mod outcome;
mod show;
mod workers;

pub use diagnose::diagnose;
pub use error::DiagnosisError;
pub use found::{Event, Found, Shown};
pub use options::Options;
pub use outcome::{
    Ambiguity, Band, BestOfGroup, Cause, ClosedLoopGain, Dependence, Description, Diagnosis, Evidence, Gain,
    Judged, Order, ParameterFound, Parameters, Residual, Verdict, Whiteness,
};
pub use workers::{OneAfterTheOther, Workers};
