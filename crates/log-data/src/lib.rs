//! Measured runs in memory: channels with fixed units, and the checks that every log must pass.
//!
//! A [`Log`] is what a rig record or a run of the loop is as numbers: runs on one clock, each a table of
//! samples. It knows no file; `run-log` reads and writes it. A missing sample is NaN; time is never missing.
#![forbid(unsafe_code)]

mod channel;
mod check;
mod energised;
mod gaps;
mod known;
mod log;
mod quantile;

pub use channel::Channel;
pub use check::LogError;
pub use energised::cut_to_energised;
pub use gaps::{bridged, bridged_run};
pub use known::{MOST_MISSING, cut_to_known, lacking};
pub use log::{AngleZero, Attribute, Extra, Log, Run};
pub use quantile::{median, quantile};
