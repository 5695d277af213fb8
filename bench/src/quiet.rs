//! How quiet the machine is: two idle looks, before a bench and behind it.

use crate::jitter::witness::Witness;
use anyhow::Result;
use std::num::NonZero;
use std::thread::{available_parallelism, sleep};
use std::time::Duration;

/// How long each core is looked at.
const LOOK: Duration = Duration::from_secs(1);

/// How much of its time a core stood still, at the worse of the two looks.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Quiet {
    /// In parts of the time.
    pub stood_still: f64,
}

/// Does something between two looks.
///
/// # Errors
/// What it returns; where the cores can't be looked at.
pub fn beside<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Quiet)> {
    let before = look()?;
    let done = work()?;
    let stood_still = before.max(look()?);
    Ok((done, Quiet { stood_still }))
}

fn look() -> Result<f64> {
    let witnesses: Vec<Witness> =
        (0..available_parallelism().map_or(1, NonZero::get)).map(Witness::on).collect();
    sleep(LOOK);
    let mut worst: f64 = 0.0;
    for witness in witnesses {
        let seen = witness.end()?;
        worst = worst.max(1.0 - seen.on_core_ns as f64 / seen.wall_ns.max(1) as f64);
    }
    Ok(worst)
}
