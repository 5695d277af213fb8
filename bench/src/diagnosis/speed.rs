//! `bench diagnosis-speed`: what a diagnosis costs, by samples and by candidates: time, processor, memory, and how soon the
//! first ranking is on the screen.

use crate::output::{Results, Sheet, digits};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::watched::{Taken, watch};
use anyhow::{Context, Result};
use hidden_effect_rig::{Campaign, Hidden, LogKind, STRONG};
use log_data::{Log, Run};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

/// How much of it.
#[derive(clap::Args, Clone, Copy)]
pub struct Arguments {
    /// About how many samples the campaign has; halves and quarters of it are diagnosed beside it
    #[arg(long, default_value_t = 250_000)]
    samples: usize,
    /// Samples of the long log, whose runs are those of the campaign over and over; 0: none
    #[arg(long, default_value_t = 10_000_000)]
    long: usize,
    /// What the campaigns are drawn from
    #[arg(long, default_value_t = 77)]
    seed: u64,
}

impl Default for Arguments {
    fn default() -> Self {
        Self { samples: 250_000, long: 10_000_000, seed: 77 }
    }
}

/// What is hidden in the angle logs: some to which all runs answer, some few; the last one's rotor slips at other moments.
const ANGLE_EFFECTS: [&str; 4] =
    ["coulomb-level", "pressure-dependent-friction", "dwell-stiction", "presliding-hysteresis"];

/// What a diagnosis cost.
struct Cost {
    wall_s: f64,
    processor_s: f64,
    memory_mb: f64,
    first_ranking_s: f64,
    candidates: usize,
}

/// Diagnoses logs of several lengths, and with several channels left out.
///
/// # Errors
/// Where the program is missing or refuses a log.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let arguments =
        if quick { Arguments { samples: 24_000, long: 48_000, ..*arguments } } else { *arguments };
    let place = Workplace::new()?;
    let progress = Progress::new(7 + ANGLE_EFFECTS.len() + usize::from(arguments.long > 0));
    let hidden = Hidden {
        samples: arguments.samples,
        ..Hidden::with(LogKind::Torque, &["pressure-dependent-friction"], STRONG)
    };
    progress.next("drawing the campaign".to_owned());
    let campaign = Campaign::draw(arguments.seed, &hidden);
    campaign.write(&place.path("whole"))?;
    let model = place.path("whole/model.toml");
    let mut by_samples = Sheet::new(
        "diagnosis-speed",
        "`stepvalve diagnose` by the length of the log, one cause hidden, reading and writing included",
        &["samples", "runs", "time, s", "processor, s", "largest memory, MB", "first ranking after, s"],
    );
    let mut data = Vec::new();
    for part in [4, 2, 1] {
        let log = shortened(&campaign.log, part);
        progress.next(format!("{} samples", samples(&log)));
        let cost = diagnosed(&place, &log, &model)?;
        by_samples.row(row(&log, &cost));
        data.push(cost.json(&log, "all"));
    }
    if arguments.long > 0 {
        let log = repeated(&campaign.log, arguments.long);
        progress.next(format!("{} samples", samples(&log)));
        let cost = diagnosed(&place, &log, &model)?;
        by_samples.row(row(&log, &cost));
        data.push(cost.json(&log, "all"));
    }
    let mut by_candidates = Sheet::new(
        "diagnosis-speed-candidates",
        "The same campaign with channels left out: fewer causes can be tested",
        &["channels left out", "causes tested", "time, s", "processor, s", "processor for each cause, s"],
    );
    for (name, pressure, temperature) in [
        ("none", true, true),
        ("oil_temperature", true, false),
        ("pressure_drop and oil_temperature", false, false),
    ] {
        progress.next(format!("without {name}"));
        let log = without(&campaign.log, pressure, temperature);
        let cost = diagnosed(&place, &log, &model)?;
        let each = cost.processor_s / cost.candidates.max(1) as f64;
        let numbers = [cost.wall_s, cost.processor_s, each].map(digits);
        by_candidates.row([name.to_owned(), cost.candidates.to_string()].into_iter().chain(numbers));
        data.push(cost.json(&log, name));
    }
    let mut angles = Sheet::new(
        "diagnosis-speed-angles",
        "Logs of command and angle alone, by what is hidden",
        &[
            "hidden",
            "samples",
            "runs",
            "time, s",
            "processor, s",
            "largest memory, MB",
            "first ranking after, s",
        ],
    );
    for effect in ANGLE_EFFECTS {
        progress.next(format!("command and angle, {effect}"));
        let hidden = Hidden { samples: arguments.samples, ..Hidden::with(LogKind::Angle, &[effect], STRONG) };
        let campaign = Campaign::draw(arguments.seed, &hidden);
        campaign.write(&place.path(effect))?;
        let cost = diagnosed(&place, &campaign.log, &place.path(effect).join("model.toml"))?;
        angles.row(std::iter::once(effect.to_owned()).chain(row(&campaign.log, &cost)));
        data.push(cost.json(&campaign.log, "torque"));
    }
    Ok(Results {
        command: "diagnosis-speed",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![by_samples, angles, by_candidates],
        data: Value::Array(data),
    })
}

impl Cost {
    fn json(&self, log: &Log, channels: &str) -> Value {
        json!({
            "samples": samples(log), "runs": log.runs.len(), "left_out": channels, "wall_s": self.wall_s,
            "processor_s": self.processor_s, "memory_mb": self.memory_mb, "first_ranking_s": self.first_ranking_s,
            "candidates": self.candidates,
        })
    }
}

fn row(log: &Log, cost: &Cost) -> Vec<String> {
    let counts = [samples(log).to_string(), log.runs.len().to_string()];
    let numbers = [cost.wall_s, cost.processor_s, cost.memory_mb, cost.first_ranking_s].map(digits);
    counts.into_iter().chain(numbers).collect()
}

fn samples(log: &Log) -> usize {
    log.runs.iter().map(Run::len).sum()
}

/// Each run's first part: as many runs, fewer samples.
fn shortened(log: &Log, part: usize) -> Log {
    let mut log = log.clone();
    for run in &mut log.runs {
        let length = run.len().div_ceil(part).max(200).min(run.len());
        let channels = [&mut run.torque_nm, &mut run.angle_command_rad, &mut run.pressure_drop_pa];
        let more = [&mut run.oil_temperature_c, &mut run.flow_m3_per_s];
        channels.into_iter().chain(more).flatten().for_each(|values| values.truncate(length));
        run.time_s.truncate(length);
        run.angle_rad.truncate(length);
    }
    log
}

/// The runs over and over, one after the other in time, until there are so many samples.
fn repeated(log: &Log, wanted: usize) -> Log {
    let mut long = Log { runs: Vec::new(), ..log.clone() };
    let span_s = log.runs.iter().map(Run::end_s).fold(0.0, f64::max) + 1.0;
    let mut round = 0.0;
    let mut count = 0;
    while count < wanted {
        for run in &log.runs {
            let time_s = run.time_s.iter().map(|time_s| time_s + round * span_s).collect();
            count += run.len();
            long.runs.push(Run { name: format!("{}-{round}", run.name), time_s, ..run.clone() });
        }
        round += 1.0;
    }
    long
}

fn without(log: &Log, pressure: bool, temperature: bool) -> Log {
    let mut log = log.clone();
    for run in &mut log.runs {
        run.pressure_drop_pa = run.pressure_drop_pa.take().filter(|_| pressure);
        run.oil_temperature_c = run.oil_temperature_c.take().filter(|_| temperature);
    }
    log
}

/// Runs the command on a log and watches it.
fn diagnosed(place: &Workplace, log: &Log, model: &Path) -> Result<Cost> {
    let (path, out) = (place.path("log.h5"), place.path("found"));
    run_log::write_log(&path, log)?;
    let mut command = place.stepvalve()?;
    command.arg("diagnose").arg("--log").arg(&path).arg("--model").arg(model).arg("--out").arg(&out);
    let begun = Instant::now();
    let mut process = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
    let said = process.stdout.take().context("stdout of stepvalve diagnose")?;
    let listener = std::thread::spawn(move || {
        let mut lines = BufReader::new(said).lines().map_while(Result::ok);
        let first = lines.find(|line| line.starts_with("first look")).map(|_| begun.elapsed());
        lines.for_each(drop);
        first
    });
    let Taken { wall_s, cpu_s, memory_mb } = watch(&mut process, begun).context("stepvalve diagnose")?;
    // Where a number of the model explains it, nothing is ranked.
    let first = listener.join().ok().flatten();
    let found: Value = serde_json::from_slice(&std::fs::read(out.join("diagnosis.json"))?)?;
    std::fs::remove_dir_all(&out)?;
    std::fs::remove_file(&path)?;
    let count = |key: &str| found.get(key).and_then(Value::as_array).map_or(0, Vec::len);
    Ok(Cost {
        wall_s,
        processor_s: cpu_s,
        memory_mb,
        first_ranking_s: first.map_or(f64::NAN, |first| first.as_secs_f64()),
        candidates: count("causes") + count("rejected"),
    })
}
