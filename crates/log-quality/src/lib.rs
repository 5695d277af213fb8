//! What is wrong with a log itself: wired or converted wrongly, cut off, incomplete. Asked before anything is computed from it.
//!
//! Pure: no file, clock or thread. Samples are judged by themselves (`samples`, `sampling`); units, signs and channels by
//! the model, where there is one: a record that the model contradicts, and agrees with once it is turned or scaled as people
//! mistake them, was mistaken so (`mistakes`). What the model gets wrong about friction is no finding here: a claim needs a
//! contradiction that no friction makes, a factor of more than three or a wrong sign.
#![forbid(unsafe_code)]

mod expected;
mod finding;
mod mistakes;
mod plausible;
mod samples;
mod sampling;
mod scale;
mod windows;

pub use finding::{Finding, Kind, Place, Severity};

use log_data::{Channel, Log};
use valve_model::Model;

const PRESSURE: Channel = Channel::PressureDrop;

/// All that is found, the gravest first. The log has passed [`Log::check`].
pub fn inspect(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let mut found = sampling::inspect(log);
    found.extend(samples::inspect(log));
    found.extend(plausible::inspect(log));
    let constant =
        |finding: &Finding| (finding.kind, finding.severity) == (Kind::ConstantChannel, Severity::Mistake);
    if !found.iter().any(constant) {
        found.extend(mistakes::inspect(log, model));
    }
    // A torque in the pressure's place is no pressure in bar.
    let exchanged = |finding: &Finding| finding.kind == Kind::SwappedChannels && finding.concerns(PRESSURE);
    if found.iter().any(exchanged) {
        found.retain(|finding| exchanged(finding) || !finding.concerns(PRESSURE));
    }
    found.sort_by_key(|finding| finding.severity);
    found
}
