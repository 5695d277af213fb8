//! `bench goals`: where each figure stands against its goal and its peer, on one page, with what holds back the ones that miss it.

use crate::output::{Results, Sheet, digits};
use crate::programs::LOOP;
use anyhow::{Context, Result};
use report::{Block, Page, Section};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// A figure and what it is to be.
struct Goal {
    what: &'static str,
    wanted: Wanted,
    unit: &'static str,
    peer: &'static str,
    /// Which bench it is of.
    of: &'static str,
    found: fn(&Value) -> Option<Found>,
    /// Why it misses, where it does.
    held_back: &'static str,
}

/// A figure.
struct Found {
    value: f64,
    /// How far the peer's own turns lie apart: within that, a ratio is met too.
    band: Option<f64>,
}

#[derive(Clone, Copy)]
enum Wanted {
    AtMost(f64),
    AtLeast(f64),
}

impl Wanted {
    fn is_met(self, found: &Found) -> bool {
        match self {
            Self::AtMost(most) => found.value <= most.max(found.band.unwrap_or(most)),
            Self::AtLeast(least) => found.value >= least,
        }
    }

    fn shown(self) -> String {
        match self {
            Self::AtMost(most) => format!("≤ {most}"),
            Self::AtLeast(least) => format!("≥ {least}"),
        }
    }
}

const CYCLICTEST: &str = "cyclictest, same core, priorities and offsets";
const WAKING: &str =
    "an address space a process, and the machine's own stalls; `early` pays before the deadline";
const COLD: &str = "memory that has left the caches in the millisecond between two cycles; `early` warms it";

const GOALS: &[Goal] = &[
    wake_up("wake-up p99 over cyclictest's, idle, 1 ms", |data| wake_ratio(data, 1_000_000)),
    wake_up("the same, 500 µs", |data| wake_ratio(data, 500_000)),
    wake_up("the same, 250 µs", |data| wake_ratio(data, 250_000)),
    wake_up("with `early`, idle, 1 ms", |data| early_ratio(data, 1_000_000)),
    wake_up("the same, 500 µs", |data| early_ratio(data, 500_000)),
    wake_up("the same, 250 µs", |data| early_ratio(data, 250_000)),
    chain("the chain's execution p50, idle, 1 ms", 8.0, |data| {
        chain_us(loop_at(data, "idle")?, "chain_p50_ns")
    }),
    chain("its p99", 20.0, |data| chain_us(loop_at(data, "idle")?, "chain_p99_ns")),
    chain("with `early`, p50", 8.0, |data| chain_us(loop_at(data, "idle")?.get("early")?, "chain_p50_ns")),
    chain("its p99", 20.0, |data| chain_us(loop_at(data, "idle")?.get("early")?, "chain_p99_ns")),
    chain("under cpu load, p99", 20.0, |data| chain_us(loop_at(data, "cpu")?, "chain_p99_ns")),
    chain("with `early`, p99", 20.0, |data| chain_us(loop_at(data, "cpu")?.get("early")?, "chain_p99_ns")),
    Goal {
        what: "bus round trip over bare iceoryx2's, p50",
        wanted: Wanted::AtMost(1.2),
        unit: "times",
        peer: "bare iceoryx2, same message",
        of: "bus",
        found: bus_ratio,
        held_back: "stamps, seals and checks: a clock read and two CRC-32C a message, every field's range",
    },
    speed("lockstep, unrecorded", 300.0, |data| lockstep(data, false), SWITCHES),
    speed("lockstep, recorded", 200.0, |data| lockstep(data, true), SWITCHES),
    speed(
        "the whole command, recorded, with run.h5",
        120.0,
        whole_command,
        "run.h5 is made when the run is over",
    ),
    speed(
        "in process, one thread",
        1200.0,
        in_process,
        "the valve's integrator, more than half of each cycle",
    ),
    speed("in process, two cores", 2400.0, two_cores, "the same"),
    Goal {
        what: "diagnosis of 217,000 torques",
        wanted: Wanted::AtMost(4.0),
        unit: "s",
        peer: "none",
        of: "diagnosis-speed",
        found: |data| diagnosed(data, |samples| (150_000.0..1_000_000.0).contains(&samples), "wall_s"),
        held_back: "a simulation for each sensitivity of each candidate",
    },
    Goal {
        what: "diagnosis of 10 million torques",
        wanted: Wanted::AtMost(20.0),
        unit: "s",
        peer: "none",
        of: "diagnosis-speed",
        found: |data| diagnosed(data, |samples| samples > 5e6, "wall_s"),
        held_back: "reading, inspecting and predicting every sample",
    },
    Goal {
        what: "its memory",
        wanted: Wanted::AtMost(1000.0),
        unit: "MB",
        peer: "none",
        of: "diagnosis-speed",
        found: |data| diagnosed(data, |samples| samples > 5e6, "memory_mb"),
        held_back: "the log and its predictions in memory",
    },
    Goal {
        what: "resident memory, the largest real-time process",
        wanted: Wanted::AtMost(12.0),
        unit: "MB",
        peer: "none",
        of: "sim",
        found: memory_mb,
        held_back: "programs locked whole, and the pools of the messages that it maps",
    },
];

const SWITCHES: &str = "two switches between processes a cycle";

const fn wake_up(what: &'static str, found: fn(&Value) -> Option<Found>) -> Goal {
    let wanted = Wanted::AtMost(1.1);
    Goal { what, wanted, unit: "times", peer: CYCLICTEST, of: "jitter", found, held_back: WAKING }
}

const fn chain(what: &'static str, most_us: f64, found: fn(&Value) -> Option<Found>) -> Goal {
    let wanted = Wanted::AtMost(most_us);
    Goal { what, wanted, unit: "µs", peer: "none", of: "jitter", found, held_back: COLD }
}

const fn speed(
    what: &'static str,
    least: f64,
    found: fn(&Value) -> Option<Found>,
    held_back: &'static str,
) -> Goal {
    let wanted = Wanted::AtLeast(least);
    Goal { what, wanted, unit: "times real time", peer: "none", of: "sim", found, held_back }
}

fn plain(value: f64) -> Option<Found> {
    value.is_finite().then_some(Found { value, band: None })
}

fn number(value: &Value, path: &str) -> Option<f64> {
    value.pointer(path)?.as_f64()
}

/// What `bench jitter` has of a load, at 1 ms.
fn loop_at<'d>(data: &'d Value, load: &str) -> Option<&'d Value> {
    measured(data, load, 1_000_000)
}

fn measured<'d>(data: &'d Value, load: &str, period_ns: u64) -> Option<&'d Value> {
    let all = data.get("loop")?.as_array()?;
    all.iter().find(|of| of["load"] == load && of["period_ns"] == period_ns)
}

/// The worst of the three processes.
fn wake_ratio(data: &Value, period_ns: u64) -> Option<Found> {
    worst_ratio(data, period_ns, |of| of.get("processes"))
}

fn early_ratio(data: &Value, period_ns: u64) -> Option<Found> {
    worst_ratio(data, period_ns, |of| of.pointer("/early/processes"))
}

fn worst_ratio(data: &Value, period_ns: u64, ours: impl Fn(&Value) -> Option<&Value>) -> Option<Found> {
    let measured = measured(data, "idle", period_ns)?;
    let peers = measured.get("processes")?.as_object()?;
    let ratio = |(name, peer): (&String, &Value)| {
        let own = number(ours(measured)?.get(name)?, "/wake_up/p99_ns")?;
        let theirs = number(peer, "/cyclictest/p99_ns")?;
        Some(Found { value: own / theirs.max(1.0), band: number(peer, "/cyclictest_band/p99") })
    };
    let all: Option<Vec<Found>> = peers.iter().map(ratio).collect();
    all?.into_iter().max_by(|one, other| one.value.total_cmp(&other.value))
}

fn chain_us(of: &Value, key: &str) -> Option<Found> {
    plain(of.get(key)?.as_f64()? / 1e3)
}

fn bus_ratio(data: &Value) -> Option<Found> {
    let p50 = |name: &str| data.get("round_trip")?.get(name)?.get("p50_ns")?.as_f64();
    plain(p50("the loop's bus")? / p50("bare iceoryx2")?)
}

/// The longest of the runs, recorded or not.
fn longest(data: &Value, is_recorded: bool) -> Option<&Value> {
    let runs = data.get("lockstep")?.as_array()?;
    let of = runs.iter().filter(|run| run["recorded"] == is_recorded);
    of.max_by_key(|run| run["cycles"].as_u64())
}

fn lockstep(data: &Value, is_recorded: bool) -> Option<Found> {
    plain(longest(data, is_recorded)?.get("times_real_time")?.as_f64()?)
}

fn whole_command(data: &Value) -> Option<Found> {
    let run = longest(data, true)?;
    plain(run.get("cycles")?.as_f64()? * 1e-3 / run.get("command_s")?.as_f64()?)
}

fn in_process(data: &Value) -> Option<Found> {
    plain(data.get("in_process")?.as_array()?.last()?.get("times_real_time")?.as_f64()?)
}

fn two_cores(data: &Value) -> Option<Found> {
    let all = data.get("campaign")?.as_array()?.iter().filter(|of| of["threads"] == 2);
    all.filter_map(|of| of.get("times_real_time")?.as_f64()).reduce(f64::max).and_then(plain)
}

fn memory_mb(data: &Value) -> Option<Found> {
    let of = |name: &&str| number(data, &format!("/memory/{name}/vm_rss_kb"));
    LOOP.iter().filter_map(of).reduce(f64::max).and_then(|kb| plain(kb / 1e3))
}

fn diagnosed(data: &Value, is_meant: impl Fn(f64) -> bool, key: &str) -> Option<Found> {
    let all = data.as_array()?;
    let of = all.iter().find(|of| of["left_out"] == "all" && of["samples"].as_f64().is_some_and(&is_meant));
    plain(of?.get(key)?.as_f64()?)
}

/// What a bench left behind.
#[derive(Deserialize)]
pub struct Kept {
    quick: bool,
    tables: Vec<Sheet>,
    data: Value,
}

/// What the benches found that there are goals for, by their commands.
#[derive(Default)]
pub struct All(BTreeMap<&'static str, Kept>);

impl All {
    /// From the JSON files of a folder; a bench that left none was not measured.
    ///
    /// # Errors
    /// A file that no bench wrote.
    pub fn read(folder: &Path) -> Result<Self> {
        let mut all = Self::default();
        for goal in GOALS {
            let path = folder.join(format!("{}.json", goal.of));
            if all.0.contains_key(goal.of) || !path.exists() {
                continue;
            }
            let context = || path.display().to_string();
            let text = std::fs::read_to_string(&path).with_context(context)?;
            all.0.insert(goal.of, serde_json::from_str(&text).with_context(context)?);
        }
        Ok(all)
    }

    /// Where each figure stands.
    pub fn standing(&self) -> Results {
        let title = "Where each figure stands against its goal";
        let mut sheet =
            Sheet::new("goals", title, &["figure", "goal", "found", "beside", "", "held back by"]);
        let mut data = Vec::new();
        for goal in GOALS {
            let found = self.0.get(goal.of).and_then(|kept| (goal.found)(&kept.data));
            let (shown, state, why) = match &found {
                None => ("not measured".to_owned(), "–", ""),
                Some(found) if goal.wanted.is_met(found) => (shown(goal, found), "met", ""),
                Some(found) => (shown(goal, found), "MISSED", goal.held_back),
            };
            let cells = [goal.what, &goal.wanted.shown(), &shown, goal.peer, state, why];
            sheet.row(cells.map(str::to_owned));
            data.push(json!({
                "figure": goal.what, "goal": goal.wanted.shown(), "unit": goal.unit, "found": found.map(|of| of.value),
                "state": state,
            }));
        }
        Results {
            command: "goals",
            quick: self.0.values().any(|kept| kept.quick),
            machine: realtime::machine_facts(),
            scheduling: "as each bench says".to_owned(),
            sheets: vec![sheet],
            data: json!(data),
        }
    }

    /// The page of it, with every table behind it.
    ///
    /// # Errors
    /// Where it can't be written.
    pub fn write_page(&self, standing: &Results, path: &Path) -> Result<()> {
        let missed = standing.sheets.first().map_or(0, |sheet| {
            sheet.rows.iter().filter(|row| row.iter().any(|cell| cell == "MISSED")).count()
        });
        let headline = format!("{} of {} figures miss their goal here.", missed, GOALS.len());
        let mut page = Page::new("stepvalve: goals", headline);
        for sheet in &standing.sheets {
            page.sections.push(Section::new(sheet.title.clone()).with(Block::Table(sheet.table())));
        }
        for (command, kept) in &self.0 {
            let mut section = Section::folded(format!("bench {command}"));
            for sheet in &kept.tables {
                section = section.with(Block::Text(sheet.title.clone())).with(Block::Table(sheet.table()));
            }
            page.sections.push(section);
        }
        page.sections.push(Section::folded("The machine").with(Block::Facts(standing.machine.clone())));
        Ok(page.write_html(path)?)
    }
}

fn shown(goal: &Goal, found: &Found) -> String {
    let band = found.band.map_or(String::new(), |band| format!(" (band {band:.2})"));
    format!("{} {}{band}", digits(found.value), goal.unit)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_met_at_its_limit_and_within_the_peer_s_own_band() {
        // What is wanted, found, the peer's band; whether that will do.
        let table = [
            (Wanted::AtMost(1.1), 1.1, None, true),
            (Wanted::AtMost(1.1), 1.2, None, false),
            (Wanted::AtMost(1.1), 1.2, Some(1.3), true),
            (Wanted::AtMost(1.1), 1.4, Some(1.3), false),
            (Wanted::AtMost(1.1), 1.0, Some(0.9), true),
            (Wanted::AtLeast(300.0), 299.0, None, false),
            (Wanted::AtLeast(300.0), 300.0, None, true),
        ];
        for (wanted, value, band, expected) in table {
            assert_eq!(
                wanted.is_met(&Found { value, band }),
                expected,
                "{value} of {}, {band:?}",
                wanted.shown()
            );
        }
    }

    #[test]
    fn every_goal_finds_its_figure_where_the_benches_put_it() {
        let process = |p99: u64| json!({"wake_up": {"p99_ns": p99}, "cyclictest": {"p99_ns": 100}, "cyclictest_band": {"p99": 1.5}});
        let at = |load: &str, period_ns: u64| {
            let early = json!({"processes": {"a": process(10), "b": process(20)}, "chain_p50_ns": 1, "chain_p99_ns": 2});
            json!({
                "load": load, "period_ns": period_ns, "processes": {"a": process(100), "b": process(160)},
                "chain_p50_ns": 7000, "chain_p99_ns": 21000, "early": early,
            })
        };
        let jitter = json!({"loop": [
            at("idle", 1_000_000), at("idle", 500_000), at("idle", 250_000), at("cpu", 1_000_000),
        ]});
        let bus =
            json!({"round_trip": {"the loop's bus": {"p50_ns": 1300}, "bare iceoryx2": {"p50_ns": 1000}}});
        let run = |recorded: bool| json!({"recorded": recorded, "cycles": 200_142, "times_real_time": 250, "command_s": 2});
        let sim = json!({
            "in_process": [{"times_real_time": 700}], "campaign": [{"threads": 2, "times_real_time": 1400}],
            "lockstep": [run(false), run(true)], "memory": {"plant-simulator": {"vm_rss_kb": 11_000}},
        });
        let of = |samples: u64| json!({"samples": samples, "left_out": "all", "wall_s": 3, "memory_mb": 900});
        let speed = json!([of(217_000), of(10_000_000)]);
        let data = |of: &str| match of {
            "jitter" => &jitter,
            "bus" => &bus,
            "sim" => &sim,
            _ => &speed,
        };
        for goal in GOALS {
            assert!((goal.found)(data(goal.of)).is_some(), "{}: {}", goal.of, goal.what);
        }
        let worst = wake_ratio(&jitter, 1_000_000).unwrap();
        assert_eq!((worst.value, worst.band), (1.6, Some(1.5)));
        assert!((whole_command(&sim).unwrap().value - 100.071).abs() < 1e-9);
    }
}
