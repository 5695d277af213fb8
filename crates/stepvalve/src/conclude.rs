//! `stepvalve conclude`, hidden: what the supervisor becomes when the valve stands; tells the user how it ended.

use crate::errand::Errand;
use crate::{run, simulate};
use supervisor::{Conclusion, Failure, Outcome, received};

/// Takes over from the supervisor.
///
/// # Errors
/// As the command that began it tells them.
pub fn conclude() -> Result<Outcome, Failure> {
    let Conclusion { errand, ending } = received()?;
    match postcard::from_bytes(&errand).map_err(anyhow::Error::from)? {
        Errand::Simulate(simulation) => simulate::conclude(&simulation, ending),
        Errand::Run { out, json } => run::conclude(&out, json, ending),
    }
}
