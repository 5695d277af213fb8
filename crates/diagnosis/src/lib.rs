//! Measured data against the model: show what it gets wrong, name the cause, extend the model, measure the gain.
//!
//! Pure calculation on runs in memory: no file, clock or thread; who calls lends the threads ([`Workers`]). The way:
//! runs are cut into pieces whose motion is smoothed once; the noise is estimated; rival causes (the effects of
//! valve-model) are screened by the sensitivities of the prediction, fitted through the model, compared on runs that
//! they were not fitted on, and accepted one after the other; what is left is tested for structure.
#![forbid(unsafe_code)]

mod campaign;
mod candidate;
mod causes;
mod diagnose;
mod driven;
mod error;
mod errors;
mod excitation;
mod facts;
mod findings;
mod fine;
mod fit;
#[cfg(test)]
mod fixtures;
mod forms;
mod found;
mod gain;
mod geared;
mod gram;
mod holds;
mod hypothesis;
mod judgement;
mod line;
mod linear;
mod loss;
mod measure;
mod missed;
mod next;
mod noise;
mod observe;
mod options;
mod outcome;
mod pair;
mod past;
mod pattern;
mod piece;
mod prune;
mod reasons;
mod refine;
mod ripple;
mod rivals;
mod round;
mod screen;
mod select;
mod selection;
mod show;
mod simplify;
mod spectrum;
mod start;
mod statistics;
mod table;
mod threshold;
mod tone;
mod tried;
mod twins;
mod whiteness;
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
