//! `bench robustness`: whether compensation is ever worse than none, over valves that differ from the belief in one thing,
//! cycles and encoders.

mod variations;

use crate::output::{Results, Sheet};
use crate::progress::Progress;
use anyhow::{Context, Result, anyhow};
use closed_loop::{Level, Outcome};
use config::{Scenario, parse_model, parse_scenario};
use serde_json::{Value, json};
use std::path::Path;
use valve_model::Model;
use variations::{Variation, variations};

/// How much worse than none the compensated valve may be: what another sampling of the same friction events makes of it.
const WORST_RMS: f64 = 1.02;
const WORST_PEAK: f64 = 1.10;

/// Reversals of the pulses in one rest from which on a valve hunts: to and fro twice.
const HUNTS: u64 = 3;

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

/// Measures the whole grid.
///
/// # Errors
/// Scenarios or models that can't be read or wired.
pub fn run(quick: bool) -> Result<Results> {
    let periods: &[f64] = if quick { &QUICK_PERIODS_MS } else { &PERIODS_MS };
    let folder = Path::new("rt-config");
    let belief = parse_model(&read(&folder.join("models/rig.toml"))?, "rig.toml")
        .map_err(|errors| anyhow!("{errors}"))?;
    let variations = variations(&belief)?;
    let progress = Progress::new(variations.len());
    let header = [
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
    let mut sheet =
        Sheet::new("robustness", "Compensation beside none, by what differs from the belief", &header);
    let mut data = Vec::new();
    let mut all = Vec::new();
    for variation in &variations {
        progress.next(variation.name.clone());
        let pairs = pairs(variation, &belief, periods)?;
        sheet.row(row(&variation.name, &pairs));
        data.extend(pairs.iter().map(|(place, pair)| record(&variation.name, place, pair)));
        all.extend(pairs);
    }
    sheet.row(row("all", &all));
    Ok(Results {
        command: "robustness",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets: vec![sheet],
        data: json!({"runs": data}),
    })
}

/// Every scenario and cycle with one variation, each with its place in words.
fn pairs(variation: &Variation, belief: &Model, periods: &[f64]) -> Result<Vec<(String, Pair)>> {
    let mut pairs = Vec::new();
    for name in SCENARIOS {
        let path = format!("rt-config/scenarios/{name}.toml");
        let shipped =
            parse_scenario(&read(Path::new(&path))?, &path).map_err(|errors| anyhow!("{errors}"))?;
        for period_ms in periods {
            let scenario = Scenario { period_ns: (period_ms * 1e6) as u64, ..variation.scenario(&shipped) };
            let level = Level { encoder: variation.counts.is_some(), ..Level::FULL };
            let outcome = |level| variation.measure(&scenario, belief, level);
            let pair = Pair { none: outcome(Level::NONE)?, with: outcome(level)? };
            pairs.push((format!("{name}, {period_ms} ms"), pair));
        }
    }
    Ok(pairs)
}

fn row(name: &str, pairs: &[(String, Pair)]) -> Vec<String> {
    let worse: Vec<_> = pairs.iter().filter(|(_, pair)| pair.worse()).collect();
    let most = |of: fn(&Pair) -> f64| pairs.iter().map(|(_, pair)| of(pair)).fold(0.0, f64::max);
    let count = |of: fn(&Pair) -> bool| pairs.iter().filter(|(_, pair)| of(pair)).count();
    let place = worse.iter().max_by(|a, b| a.1.peak().total_cmp(&b.1.peak()));
    vec![
        name.to_owned(),
        pairs.len().to_string(),
        format!("{:.2}", most(Pair::rms)),
        format!("{:.2}", most(Pair::peak)),
        count(Pair::said_so).to_string(),
        count(|pair| pair.with.restless_cycles > pair.none.restless_cycles).to_string(),
        count(Pair::hunts).to_string(),
        worse.len().to_string(),
        worse.iter().filter(|(_, pair)| !pair.said_so()).count().to_string(),
        place.map_or("-".to_owned(), |(place, _)| place.clone()),
    ]
}

fn record(variation: &str, place: &str, pair: &Pair) -> Value {
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
    json!({"variation": variation, "place": place, "none": outcome(&pair.none), "with": outcome(&pair.with)})
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| path.display().to_string())
}
