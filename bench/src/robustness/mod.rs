//! `bench robustness`: whether compensation is ever worse than none, over valves that differ from the belief in one thing
//! or in several, cycles and encoders.

mod valves;
mod variations;

use crate::output::{Results, Sheet};
use crate::progress::Progress;
use anyhow::{Context, Result, anyhow};
use closed_loop::{Level, Outcome};
use config::{Scenario, parse_model, parse_scenario};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use std::path::Path;
use valve_model::{Model, MotorParams};
use variations::{Variation, mixed, variations};

/// How much worse than none the compensated valve may be: what another sampling of the same friction events makes of it.
const WORST_RMS: f64 = 1.02;
const WORST_PEAK: f64 = 1.10;

/// Reversals of the pulses in one rest from which on a valve hunts: to and fro twice.
const HUNTS: u64 = 3;

/// Which valves.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Arguments {
    /// Valves drawn at random instead of the bench rig
    #[arg(long, value_name = "N")]
    valves: Option<u64>,
    /// Runs of a valve that differs from the belief in several things at once, drawn at random, as are scenario and cycle
    #[arg(long, value_name = "N", conflicts_with = "valves")]
    mixed: Option<u64>,
    /// What they are drawn from; with N more than one, each further one is the next seed's
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
}

/// Cycles, ms.
const PERIODS_MS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 10.0];
const QUICK_PERIODS_MS: [f64; 2] = [1.0, 8.0];

/// The shipped scenarios whose valve the motor can turn.
const SCENARIOS: [&str; 5] =
    ["flow-steps", "rotation-200khz", "rotation-600khz", "sine-1hz", "step-sequence"];

/// A compensated run beside the same without compensation.
#[derive(Debug, Clone, Copy)]
struct Pair {
    none: Outcome,
    with: Outcome,
}

impl Pair {
    fn rms(&self) -> f64 {
        self.with.rms_rad / self.none.rms_rad
    }

    fn peak(&self) -> f64 {
        self.with.peak_rad / self.none.peak_rad
    }

    /// Whether it goes to and fro at rest where it would not without compensation.
    fn hunts(&self) -> bool {
        self.with.reversals_at_rest >= HUNTS && self.none.reversals_at_rest < HUNTS
    }

    fn worse(&self) -> bool {
        self.rms() > WORST_RMS || self.peak() > WORST_PEAK || self.hunts()
    }

    /// Whether the controller said that the belief does not fit.
    fn said_so(&self) -> bool {
        self.with.alarms != 0 || self.with.fault.is_some()
    }
}

/// A valve that differs from its belief, in one scenario and cycle.
struct Cell {
    /// The table's row.
    variation: String,
    /// What differs, in full.
    differs: String,
    place: String,
    pair: Pair,
}

/// Measures the whole grid, on the bench rig or on valves drawn at random.
///
/// # Errors
/// Scenarios or models that can't be read or wired.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let periods: &[f64] = if quick { &QUICK_PERIODS_MS } else { &PERIODS_MS };
    let rig = parse_model(&read(Path::new("rt-config/models/rig.toml"))?, "rig.toml")
        .map_err(|errors| anyhow!("{errors}"))?;
    let (command, (sheets, cells)) = match (arguments.valves, arguments.mixed) {
        (Some(count), _) => ("robustness-valves", drawn(&rig, arguments.seed, count, periods)?),
        (None, Some(count)) => {
            let cells = mixed_runs(&rig, arguments.seed, count)?;
            ("robustness-mixed", (vec![by_variation("robustness-mixed", &cells)], cells))
        }
        (None, None) => {
            let cells = grid(&rig, periods, |shipped| shipped)?;
            ("robustness", (vec![by_variation("robustness", &cells)], cells))
        }
    };
    let records: Vec<_> = cells.iter().map(record).collect();
    Ok(Results {
        command,
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets,
        data: json!({"seed": arguments.seed, "runs": records}),
    })
}

/// The grid on valves drawn at random: a table by what differs, and one by valve.
fn drawn(rig: &Model, seed: u64, count: u64, periods: &[f64]) -> Result<(Vec<Sheet>, Vec<Cell>)> {
    let mut by_valve = Sheet::new("robustness-by-valve", "The valves drawn", &BY_VALVE);
    let mut all = Vec::new();
    for index in 0..count {
        let valve = valves::valve(rig, seed, index);
        let mut cells = grid(&valve, periods, |shipped| valves::fitted(&shipped, &valve))
            .with_context(|| valve.name.clone())?;
        by_valve.row(valve_row(seed.wrapping_add(index), &valve, &cells));
        for cell in &mut cells {
            cell.place = format!("{}, {}", seed.wrapping_add(index), cell.place);
        }
        all.extend(cells);
    }
    Ok((vec![by_variation("robustness-valves", &all), by_valve], all))
}

/// Runs of valves that differ in several things at once, a row for how many.
fn mixed_runs(belief: &Model, seed: u64, count: u64) -> Result<Vec<Cell>> {
    println!("mixed: seed {seed}");
    let random = &mut Pcg64::seed_from_u64(seed);
    let progress = Progress::new(count as usize);
    let mut drawn = Vec::new();
    for _ in 0..count {
        let (variation, differs) = mixed(belief, random)?;
        progress.next("mixed");
        let name = SCENARIOS.get(random.random_range(0..SCENARIOS.len())).context("a scenario")?;
        let period_ms = *PERIODS_MS.get(random.random_range(0..PERIODS_MS.len())).context("a period")?;
        for (period_ms, pair) in runs(&variation, belief, &shipped(name)?, &[period_ms])? {
            let cell = Cell {
                variation: how_many(differs).to_owned(),
                differs: variation.name.clone(),
                place: place(name, period_ms),
                pair,
            };
            drawn.push((differs, cell));
        }
    }
    drawn.sort_by_key(|(differs, _)| *differs);
    Ok(drawn.into_iter().map(|(_, cell)| cell).collect())
}

/// The row of a valve that differs in so many things.
fn how_many(things: usize) -> &'static str {
    match things {
        0..=2 => "two things at the most",
        3 | 4 => "three or four",
        _ => "five or more",
    }
}

fn place(scenario: &str, period_ms: f64) -> String {
    format!("{scenario}, {period_ms} ms")
}

fn shipped(name: &str) -> Result<Scenario> {
    let path = format!("rt-config/scenarios/{name}.toml");
    parse_scenario(&read(Path::new(&path))?, &path).map_err(|errors| anyhow!("{errors}"))
}

fn grid(belief: &Model, periods: &[f64], fit: impl Fn(Scenario) -> Scenario) -> Result<Vec<Cell>> {
    let variations = variations(belief)?;
    let progress = Progress::new(variations.len());
    let mut cells = Vec::new();
    for variation in &variations {
        progress.next(variation.name.clone());
        for name in SCENARIOS {
            cells.extend(runs(variation, belief, &fit(shipped(name)?), periods)?.into_iter().map(
                |(period_ms, pair)| Cell {
                    variation: variation.name.clone(),
                    differs: variation.name.clone(),
                    place: place(name, period_ms),
                    pair,
                },
            ));
        }
    }
    Ok(cells)
}

/// A scenario with one variation in each cycle, ms.
fn runs(
    variation: &Variation,
    belief: &Model,
    shipped: &Scenario,
    periods: &[f64],
) -> Result<Vec<(f64, Pair)>> {
    let level = Level { encoder: variation.counts.is_some(), ..Level::FULL };
    let pair = |period_ms: f64| {
        let scenario = Scenario { period_ns: (period_ms * 1e6) as u64, ..variation.scenario(shipped) };
        let outcome = |level| variation.measure(&scenario, belief, level);
        Ok((period_ms, Pair { none: outcome(Level::NONE)?, with: outcome(level)? }))
    };
    periods.iter().map(|period_ms| pair(*period_ms)).collect()
}

const BY_VARIATION: [&str; 10] = [
    "what differs",
    "runs",
    "RMS, worst",
    "peak, worst",
    "told so",
    "pulses at rest",
    "hunts at rest",
    "worse than none",
    "of them unsaid",
    "where worst",
];

/// A row for each variation, and one for all.
fn by_variation(id: &str, cells: &[Cell]) -> Sheet {
    let mut sheet =
        Sheet::new(id, "Compensation beside none, by what differs from the belief", &BY_VARIATION);
    let mut names: Vec<&str> = Vec::new();
    for cell in cells {
        if !names.contains(&cell.variation.as_str()) {
            names.push(&cell.variation);
        }
    }
    for name in names {
        sheet.row(row(name, cells.iter().filter(|cell| cell.variation == name)));
    }
    sheet.row(row("all", cells.iter()));
    sheet
}

const BY_VALVE: [&str; 13] = [
    "seed",
    "friction law",
    "teeth",
    "micro-step",
    "holding torque",
    "resonance",
    "Coulomb / holding",
    "break-away / Coulomb",
    "runs",
    "told so",
    "worse than none",
    "of them unsaid",
    "hunts at rest",
];

fn valve_row(seed: u64, valve: &Model, cells: &[Cell]) -> Vec<String> {
    let motor = valve.motor.unwrap_or(MotorParams::BENCH_RIG);
    let resonance_hz = valve.resonance_hz().unwrap_or_default();
    let coulomb_nm = valve.friction.steady_torque(1.0);
    let count = |of: fn(&Pair) -> bool| cells.iter().filter(|cell| of(&cell.pair)).count().to_string();
    vec![
        seed.to_string(),
        valve.friction.law().to_owned(),
        motor.rotor_teeth.to_string(),
        format!("{:.3} mrad", 1e3 * motor.microstep_angle_rad()),
        format!("{:.1} N·m", motor.holding_torque_nm),
        format!("{resonance_hz:.0} Hz"),
        format!("{:.2}", coulomb_nm / motor.holding_torque_nm),
        format!("{:.1}", valves::break_away(&valve.friction)),
        cells.len().to_string(),
        count(Pair::said_so),
        count(Pair::worse),
        count(|pair| pair.worse() && !pair.said_so()),
        count(Pair::hunts),
    ]
}

fn row<'a>(name: &str, cells: impl Iterator<Item = &'a Cell>) -> Vec<String> {
    let cells: Vec<_> = cells.collect();
    let worse: Vec<_> = cells.iter().filter(|cell| cell.pair.worse()).collect();
    let most = |of: fn(&Pair) -> f64| cells.iter().map(|cell| of(&cell.pair)).fold(0.0, f64::max);
    let count = |of: fn(&Pair) -> bool| cells.iter().filter(|cell| of(&cell.pair)).count();
    let place = worse.iter().max_by(|a, b| a.pair.peak().total_cmp(&b.pair.peak()));
    vec![
        name.to_owned(),
        cells.len().to_string(),
        format!("{:.2}", most(Pair::rms)),
        format!("{:.2}", most(Pair::peak)),
        count(Pair::said_so).to_string(),
        count(|pair| pair.with.restless_cycles > pair.none.restless_cycles).to_string(),
        count(Pair::hunts).to_string(),
        worse.len().to_string(),
        worse.iter().filter(|cell| !cell.pair.said_so()).count().to_string(),
        place.map_or("-".to_owned(), |cell| cell.place.clone()),
    ]
}

fn record(cell: &Cell) -> Value {
    let outcome = |of: &Outcome| {
        json!({
            "rms_rad": of.rms_rad,
            "peak_rad": of.peak_rad,
            "alarms": signals::alarm::names(of.alarms).collect::<Vec<_>>(),
            "fault": of.fault.map(signals::FaultCode::name),
            "restless_cycles": of.restless_cycles,
            "reversals_at_rest": of.reversals_at_rest,
            "lost_teeth": of.lost_teeth,
        })
    };
    json!({
        "variation": cell.variation,
        "differs": cell.differs,
        "place": cell.place,
        "none": outcome(&cell.pair.none),
        "with": outcome(&cell.pair.with),
    })
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| path.display().to_string())
}
