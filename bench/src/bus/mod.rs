//! `bench bus`: round trips over our bus beside bare iceoryx2, a Unix socket, a pipe, and a bouncing cache line; and
//! from feedback and from a set-point to step command in the real loop.

mod bare;
mod cache_line;
mod end_to_end;
mod ours;
mod set_point;
mod stream;

use crate::output::{Results, Sheet, us};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::timing::Times;
use anyhow::{Context, Result, bail};
use clap::{Subcommand, ValueEnum};
use realtime::{Wanted, obtain};
use serde_json::json;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// What carries the message there and back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Carrier {
    /// Two counters in two cache lines, between two threads: what the hardware takes
    CacheLine,
    /// iceoryx2 alone: loan, write, send, receive
    Bare,
    /// The loop's own writers and readers: header, CRC, checks
    Ours,
    /// Two pipes
    Pipe,
    /// A Unix socket
    Socket,
}

const CARRIERS: [(Carrier, &str); 5] = [
    (Carrier::CacheLine, "two atomics (cache line)"),
    (Carrier::Bare, "bare iceoryx2"),
    (Carrier::Ours, "the loop's bus"),
    (Carrier::Pipe, "pipe, blocking"),
    (Carrier::Socket, "Unix socket, blocking"),
];

/// Words of the message there, a StepCommand, and of the one back, a Feedback, as all carriers but the first take.
const THERE_WORDS: usize = signals::Message::<signals::StepCommand>::WORDS;
const BACK_WORDS: usize = signals::Message::<signals::Feedback>::WORDS;

/// The other side of a round trip, in a process of its own.
#[derive(Subcommand)]
pub enum Echo {
    /// Answers on the bus of a place
    #[command(hide = true)]
    Echo {
        /// Over what
        carrier: Carrier,
        /// The place's root folder
        root: PathBuf,
    },
}

/// Measures all carriers in turns.
///
/// # Errors
/// Where one can't be set up.
pub fn run(quick: bool) -> Result<Results> {
    let (turns, trips) = if quick { (1, 20_000) } else { (5, 200_000) };
    // Before this thread binds itself to a core.
    let machine = realtime::machine_facts();
    let progress = Progress::new(turns * CARRIERS.len() + 2);
    let mut times = CARRIERS.iter().map(|_| Times::new()).collect::<Result<Vec<_>>>()?;
    for turn in 0..turns {
        for ((carrier, name), times) in CARRIERS.iter().zip(&mut times) {
            progress.next(format!("{name}, turn {}", turn + 1));
            // A pipe takes twenty times as long, and its times settle as fast.
            let trips = if matches!(carrier, Carrier::Pipe | Carrier::Socket) { trips / 10 } else { trips };
            round_trips(*carrier, trips, times).with_context(|| (*name).to_owned())?;
        }
    }
    progress.next("feedback to step command");
    let (end_to_end, end_to_end_data, scheduling) = end_to_end::run(if quick { 1_000 } else { 10_000 })?;
    progress.next("set-point to step command");
    let (set_point, set_point_data) = set_point::run(if quick { 20 } else { 300 })?;
    let data = CARRIERS.iter().zip(&times).map(|((_, name), times)| ((*name).to_owned(), times.json()));
    let round_trip: serde_json::Map<_, _> = data.collect();
    Ok(Results {
        command: "bus",
        quick,
        machine,
        scheduling: format!("round trips: the normal scheduler, cores 0 and 1; the loop: {scheduling}"),
        sheets: vec![table(&times), end_to_end, set_point],
        data: json!({"round_trip": round_trip, "end_to_end": end_to_end_data, "set_point": set_point_data}),
    })
}

fn table(times: &[Times]) -> Sheet {
    let title = format!(
        "Round trip between two cores, µs: {} bytes there, {} back; busy polling but for pipe and socket",
        THERE_WORDS * 8,
        BACK_WORDS * 8
    );
    let header = ["over", "p50", "p99", "p99.9", "max", "p50 / bare iceoryx2's"];
    let mut sheet = Sheet::new("bus-round-trip", title, &header);
    let bare = CARRIERS.iter().zip(times).find(|((carrier, _), _)| *carrier == Carrier::Bare);
    let bare_ns = bare.map_or(1, |(_, times)| times.quantile_ns(0.5)).max(1);
    for ((_, name), times) in CARRIERS.iter().zip(times) {
        let mut row = vec![(*name).to_owned()];
        row.extend(times.percentiles_ns().map(us));
        row.push(format!("{:.2}", times.quantile_ns(0.5) as f64 / bare_ns as f64));
        sheet.row(row);
    }
    sheet
}

/// This side stays on core 0, the other on core 1.
fn round_trips(carrier: Carrier, trips: u64, times: &mut Times) -> Result<()> {
    stay_on(0)?;
    match carrier {
        Carrier::CacheLine => cache_line::run(trips, times),
        Carrier::Bare => bare::run(&Workplace::new()?, trips, times),
        Carrier::Ours => ours::run(&Workplace::new()?, trips, times),
        Carrier::Pipe => stream::pipe(trips, times),
        Carrier::Socket => stream::socket(trips, times),
    }
}

/// The other side's `main`.
///
/// # Errors
/// Where it can't join.
pub fn echo(Echo::Echo { carrier, root }: &Echo) -> Result<()> {
    stay_on(1)?;
    match carrier {
        Carrier::CacheLine => bail!("the cache line bounces within one process"),
        Carrier::Bare => bare::echo(root),
        Carrier::Ours => ours::echo(root),
        Carrier::Pipe | Carrier::Socket => stream::echo(),
    }
}

/// Another process of this program as the other side.
fn other_side(carrier: Carrier, root: &std::path::Path, stdin: Stdio, stdout: Stdio) -> Result<Child> {
    let name = carrier.to_possible_value().context("a carrier's name")?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["echo", name.get_name()]).arg(root).stdin(stdin).stdout(stdout);
    command.spawn().context("the other side")
}

fn stay_on(core: usize) -> Result<()> {
    let (obtained, _) = obtain(&Wanted { priority: None, core: Some(core), lock_memory: false });
    if !obtained.complete() {
        bail!("two cores are needed: {}", obtained.refused.join("; "));
    }
    Ok(())
}
