//! Measured data against the model: show what it gets wrong, name the cause, extend the model, measure the gain.
//!
//! Pure calculation on runs in memory: no file, clock or thread; the caller lends the threads ([`Workers`]). The
//! stages, each a folder that uses only those before it: `numerics` (least squares, statistics), `log` (runs cut into
//! pieces, noise, excitation), `extend` (candidate effects, hypotheses), `fit`, `show` (what a residual shows), `name`
//! (the search for causes), `measure` (gain and intervals), `unnamed` (laws that no cause has), `conclude` (verdict, reasons, next experiment).
#![forbid(unsafe_code)]

mod alike;
mod asked;
mod begin;
mod conclude;
mod contest;
mod corrected;
mod diagnose;
mod error;
mod extend;
mod few;
mod fit;
#[cfg(test)]
mod fixtures;
mod found;
mod identify;
mod in_place;
mod judge;
mod left_out;
mod log;
mod measure;
mod name;
mod numbers;
mod numerics;
mod options;
mod outcome;
mod pass;
mod show;
mod suspect;
mod unnamed;
mod workers;
mod zeros;

pub use contest::{Choice, Contest, Trial, choose};
pub use diagnose::diagnose;
pub use error::DiagnosisError;
pub use found::{Event, Found, Shown};
pub use identify::{Identification, Identified, identify};
pub use options::Options;
pub use outcome::{
    Ambiguity, Band, BestOfGroup, Cause, ClosedLoopGain, Corrected, Covariance, Dependence, Description,
    Diagnosis, Evidence, Gain, IN_MODEL, Judged, Nearest, Offered, Order, ParameterFound, Parameters,
    Residual, RivalFit, Unnamed, UnnamedGain, UnnamedRule, Verdict, Whiteness,
};
pub use suspect::{Suspect, SuspectParameter};
pub use workers::{OneAfterTheOther, Workers, map};
