//! How quiet the machine is: a look before a bench and one behind it, while nothing of ours runs.

use crate::jitter::witness::Witness;
use anyhow::Result;
use std::fmt;
use std::num::NonZero;
use std::thread::{available_parallelism, sleep};
use std::time::Duration;

/// How long each core is looked at.
const LOOK: Duration = Duration::from_secs(1);

/// How much of its time a core was taken, by another program or by the hypervisor, at the worse of the two looks.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Quiet {
    /// In parts of the time.
    pub taken: f64,
}

impl fmt::Display for Quiet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} %", 100.0 * self.taken)
    }
}

/// Does something between two looks.
///
/// # Errors
/// What it returns; where the cores can't be looked at.
pub fn beside<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Quiet)> {
    let before = look()?;
    let done = work()?;
    let taken = before.max(look()?);
    Ok((done, Quiet { taken }))
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
