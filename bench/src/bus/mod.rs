//! `bench bus`: round trips over our bus beside bare iceoryx2, a Unix socket, a pipe, and a bouncing cache line; and
//! from feedback and from a set-point to step command in the real loop.

mod bare;
mod cache_line;
mod drive;
mod end_to_end;
mod ours;
mod parts;
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
use signal_bus::Place;
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

/// What to measure.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// The bus of a drive in place of the loop's own: round trip beside a bare echo, clock, a pulled cable; in a network
    /// namespace (`unshare -n`, or `unshare -Urn`); --docs docs/drive.md
    #[arg(long)]
    pub drive: bool,
}

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
    /// Sends frames back on the far interface
    #[command(hide = true)]
    EchoFrames,
}

/// Measures all carriers in turns, or the bus of a drive.
///
/// # Errors
/// Where one can't be set up.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    if arguments.drive { drive::run(quick) } else { carriers(quick) }
}

fn carriers(quick: bool) -> Result<Results> {
    let (turns, trips) = if quick { (1, 20_000) } else { (5, 200_000) };
    // Before this thread binds itself to a core.
    let machine = realtime::machine_facts();
    let progress = Progress::new(turns * CARRIERS.len() + 2);
    let mut round_trip = CARRIERS.map(|_| RoundTrip { by_turn: Vec::new() });
    for turn in 0..turns {
        for ((carrier, name), found) in CARRIERS.iter().zip(&mut round_trip) {
            progress.next(format!("{name}, turn {}", turn + 1));
            // A pipe takes twenty times as long, and its times settle as fast.
            let trips = if matches!(carrier, Carrier::Pipe | Carrier::Socket) { trips / 10 } else { trips };
            let mut times = Times::new()?;
            round_trips(*carrier, trips, &mut times).with_context(|| (*name).to_owned())?;
            found.by_turn.push(times);
        }
    }
    let (parts, parts_data) = parts::run(if quick { 100_000 } else { 2_000_000 })?;
    progress.next("feedback to step command");
    let (end_to_end, end_to_end_data, scheduling) = end_to_end::run(if quick { 1_000 } else { 10_000 })?;
    progress.next("set-point to step command");
    let (set_point, set_point_data) = set_point::run(if quick { 20 } else { 300 })?;
    let table = table(&round_trip)?;
    let trips = CARRIERS.iter().zip(&round_trip);
    let trips = trips.map(|((_, name), found)| Ok(((*name).to_owned(), found.all()?.json())));
    let trips = trips.collect::<Result<serde_json::Map<_, _>>>()?;
    Ok(Results {
        command: "bus",
        quick,
        machine,
        scheduling: format!("round trips: the normal scheduler, cores 0 and 1; the loop: {scheduling}"),
        sheets: vec![table, parts, end_to_end, set_point],
        data: json!({
            "round_trip": trips, "parts": parts_data, "end_to_end": end_to_end_data, "set_point": set_point_data,
        }),
    })
}

/// What one carrier took, turn by turn.
struct RoundTrip {
    by_turn: Vec<Times>,
}

impl RoundTrip {
    fn all(&self) -> Result<Times> {
        let mut all = Times::new()?;
        self.by_turn.iter().for_each(|times| all.add_times(times));
        Ok(all)
    }

    /// Median over the turns of this one's p50 over the other's in the same turn, with the least and the largest: a core
    /// that is slower for a while is so for both.
    fn ratio_to(&self, other: &Self) -> String {
        let p50 = |times: &Times| times.quantile_ns(0.5).max(1) as f64;
        let mut ratios: Vec<f64> =
            self.by_turn.iter().zip(&other.by_turn).map(|(own, other)| p50(own) / p50(other)).collect();
        ratios.sort_by(f64::total_cmp);
        let at = |index: usize| ratios.get(index).copied().unwrap_or(f64::NAN);
        let last = ratios.len().saturating_sub(1);
        format!("{:.2} ({:.2} to {:.2})", at(last / 2), at(0), at(last))
    }
}

fn table(round_trip: &[RoundTrip]) -> Result<Sheet> {
    let title = format!(
        "Round trip between two cores, µs: {} bytes there, {} back; busy polling but for pipe and socket",
        THERE_WORDS * 8,
        BACK_WORDS * 8
    );
    let header = ["over", "p50", "p99", "p99.9", "max", "p50 / bare iceoryx2's, by turn"];
    let mut sheet = Sheet::new("bus-round-trip", title, &header);
    let bare = CARRIERS.iter().zip(round_trip).find(|((carrier, _), _)| *carrier == Carrier::Bare);
    let (_, bare) = bare.context("bare iceoryx2")?;
    for ((_, name), found) in CARRIERS.iter().zip(round_trip) {
        let mut row = vec![(*name).to_owned()];
        row.extend(found.all()?.percentiles_ns().map(us));
        row.push(found.ratio_to(bare));
        sheet.row(row);
    }
    Ok(sheet)
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
pub fn echo(echo: &Echo) -> Result<()> {
    let Echo::Echo { carrier, root } = echo else { return drive::echo() };
    stay_on(1)?;
    match carrier {
        Carrier::CacheLine => bail!("the cache line bounces within one process"),
        Carrier::Bare => bare::echo(root),
        Carrier::Ours => ours::echo(root),
        Carrier::Pipe | Carrier::Socket => stream::echo(),
    }
}

/// Where both sides of a round trip meet, by the folder that is given to the other one.
fn place(root: &std::path::Path) -> Place {
    let bytes = root.as_os_str().as_encoded_bytes();
    let hash = bytes.iter().fold(0_u64, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(*byte)));
    Place { root: root.to_owned(), prefix: format!("stepvalve_bench_{hash:016x}_") }
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
