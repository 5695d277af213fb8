//! What is wrong with a log itself: wired or converted wrongly, cut off, incomplete. Asked before anything is computed from it.
//!
//! Pure: no file, clock or thread. Samples are judged by themselves (`samples`, `sampling`); units, signs and channels by
//! the model, where there is one: a record that the model contradicts, and agrees with once it is turned or scaled as people
//! mistake them, was mistaken so (`mistakes`). What the model gets wrong about friction is no finding here: a claim needs a
//! contradiction that no friction makes, a factor of more than three or a wrong sign.
#![forbid(unsafe_code)]

mod bandwidth;
mod drift;
mod expected;
mod finding;
mod mistakes;
mod plausible;
mod samples;
mod sampling;
mod scale;
mod windows;

pub use finding::{Finding, Kind, Place, Severity};
pub use samples::without_wild;

use log_data::{Channel, Log};
use valve_model::Model;

/// The channels of the motion whose unit this log and model can't tell: the model agrees with degrees or milliseconds as well.
pub fn untold(log: &Log, model: &Model) -> Vec<Channel> {
    mistakes::untold(&without_wild(log.clone()), model)
}

/// All that is found, the gravest first. The log has passed [`Log::check`].
pub fn inspect(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let mut found = sampling::inspect(log);
    found.extend(samples::inspect(log));
    found.extend(plausible::inspect(log));
    // What no motion makes.
    let constant = |finding: &Finding| {
        finding.severity == Severity::Mistake
            && matches!(finding.kind, Kind::ConstantChannel | Kind::WrongAngle)
    };
    let measured = without_wild(log.clone());
    let mistaken = mistakes::inspect(&measured, model);
    // Of a channel that is none nothing else can be told, but that another has taken its place.
    let all = !found.iter().any(constant);
    if !mistaken.iter().any(|finding| finding.severity == Severity::Mistake) {
        found.extend(drift::inspect(&measured, model));
    }
    found.extend(bandwidth::inspect(log));
    found.extend(mistaken.into_iter().filter(|finding| all || finding.kind == Kind::SwappedChannels));
    // A torque in the pressure's place is no pressure in bar, and an angle in the torque's has no rail.
    let exchanged = |finding: &&Finding| finding.kind == Kind::SwappedChannels;
    if let Some(channels) = found.iter().find(exchanged).map(|finding| finding.place.channels.clone()) {
        let concerned = |finding: &Finding| finding.place.channels.iter().any(|of| channels.contains(of));
        found.retain(|finding| {
            exchanged(&finding) || finding.severity == Severity::Note || !concerned(finding)
        });
    }
    found.sort_by_key(|finding| finding.severity);
    found
}
