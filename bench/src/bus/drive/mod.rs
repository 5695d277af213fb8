//! `bench bus --drive`: the bridge's frames over a pair of virtual interfaces to the simulated drive: the round trip beside a bare
//! echo, the bus's clock, and a cable that is pulled.

mod cable;
mod clock;
mod echo;
mod ride;
mod round_trip;

use crate::output::{Results, Sheet};
use crate::progress::Progress;
use anyhow::{Context, Result};
use realtime::{Obtained, Wanted, obtain};
use serde_json::json;
use subdevice::lay_cable;

pub(super) use echo::echo;

/// Where the loop is: as in the shipped scenario of a drive.
const CORE: usize = 1;
const PRIORITY: u8 = 80;

/// Measures all of it. The interfaces are made in the present network namespace.
///
/// # Errors
/// Where no interfaces can be made, or the simulated drive is not brought up.
pub(super) fn run(quick: bool) -> Result<Results> {
    let machine = realtime::machine_facts();
    lay_cable().context(
        "expected a network namespace of its own: as root `unshare -n bench bus --drive`, as anybody `unshare -Urn bench bus --drive`",
    )?;
    let (obtained, _awake) =
        obtain(&Wanted { core: Some(CORE), priority: Some(PRIORITY), lock_memory: true });
    let progress = Progress::new(0);
    let (trips, trips_data) = round_trip::run(quick, &progress)?;
    let (clock, clock_data) = clock::run(quick, &progress)?;
    let (cable, cable_data) = cable::run(quick, &progress)?;
    let sheets: Vec<Sheet> = vec![trips, clock, cable];
    Ok(Results {
        command: "bus-drive",
        quick,
        machine,
        scheduling: scheduling(&obtained),
        sheets,
        data: json!({"round_trip": trips_data, "clock": clock_data, "cable": cable_data}),
    })
}

fn scheduling(obtained: &Obtained) -> String {
    let priority = obtained.priority.map_or("the normal scheduler".to_owned(), |p| format!("SCHED_FIFO {p}"));
    let core = obtained.core.map_or("any core".to_owned(), |core| format!("core {core}"));
    let memory = if obtained.memory_locked { "memory locked" } else { "memory not locked" };
    format!(
        "bridge: {priority}, {core}, {memory}; echo and drive: SCHED_FIFO 90 where granted, on the same core"
    )
}
