//! `bench data-quality`: mistakes made on purpose in campaigns of the rig, and whether the check of the log names them.

use crate::output::{Results, Sheet, digits};
use crate::progress::Progress;
use anyhow::Result;
use hidden_effect_rig::{Campaign, Family, Hidden, LogKind, STRONG, choose, effects_of};
use log_data::{Channel, Log, Run};
use log_quality::{Finding, Kind, Severity, inspect};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use std::time::Instant;
use valve_model::Model;

/// How many campaigns, and which.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Campaigns for each kind of mistake
    #[arg(long, default_value_t = 20)]
    campaigns: u64,
    /// Campaigns without any
    #[arg(long, default_value_t = 300)]
    clean: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// This mistake alone, by a part of its name
    #[arg(long)]
    only: Option<String>,
    /// Says which were missed or claimed, and all that was found there
    #[arg(long)]
    verbose: bool,
}

/// A mistake that people make.
struct Mistake {
    name: &'static str,
    kinds: &'static [Kind],
    /// Which logs it can be made in.
    logs: &'static [LogKind],
    make: fn(&mut Log, &mut Pcg64),
}

const TORQUE: &[LogKind] = &[LogKind::Torque];
const BOTH: &[LogKind] = &[LogKind::Torque, LogKind::Angle];
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

const MISTAKES: &[Mistake] = &[
    Mistake {
        name: "torque's sign turned",
        kinds: &[Kind::TorqueSign],
        logs: TORQUE,
        make: |log, _| scale(log, Channel::Torque, -1.0),
    },
    Mistake {
        name: "angle in degrees",
        kinds: &[Kind::AngleUnit],
        logs: BOTH,
        make: |log, _| scale(log, Channel::Angle, DEGREES),
    },
    Mistake {
        name: "torque in N·cm",
        kinds: &[Kind::TorqueUnit],
        logs: TORQUE,
        make: |log, _| scale(log, Channel::Torque, 100.0),
    },
    Mistake {
        name: "time in ms",
        kinds: &[Kind::TimeUnit],
        logs: BOTH,
        make: |log, _| scale(log, Channel::Time, 1000.0),
    },
    Mistake {
        name: "pressure in bar",
        kinds: &[Kind::PressureUnit],
        logs: BOTH,
        make: |log, _| scale(log, Channel::PressureDrop, 1e-5),
    },
    Mistake { name: "channels exchanged", kinds: &[Kind::SwappedChannels], logs: BOTH, make: exchange },
    Mistake { name: "torque clipped", kinds: &[Kind::Clipped], logs: TORQUE, make: clip },
    Mistake { name: "rows missing", kinds: &[Kind::Gaps], logs: BOTH, make: lose_rows },
    Mistake {
        name: "wrong column for the angle",
        kinds: &[Kind::WrongAngle, Kind::ConstantChannel],
        logs: BOTH,
        make: wrong_column,
    },
    Mistake {
        name: "direction inverted",
        kinds: &[Kind::TorqueSign, Kind::AngleDirection],
        logs: BOTH,
        make: |log, _| scale(log, Channel::Angle, -1.0),
    },
    Mistake { name: "samples doubled", kinds: &[Kind::DoubledSamples], logs: BOTH, make: double },
    Mistake { name: "units differ between runs", kinds: &[Kind::RunsDiffer], logs: BOTH, make: mix },
];

fn scale_run(run: &mut Run, channel: Channel, factor: f64) {
    if let Some(mut values) = run.take_channel(channel) {
        values.iter_mut().for_each(|value| *value *= factor);
        run.set_channel(channel, values);
    }
}

fn scale(log: &mut Log, channel: Channel, factor: f64) {
    log.runs.iter_mut().for_each(|run| scale_run(run, channel, factor));
}

/// Two of the channels that every run has: of a torque log any two, of an angle log angle and command.
fn exchange(log: &mut Log, rng: &mut Pcg64) {
    let all = [
        Channel::Angle,
        Channel::AngleCommand,
        Channel::Torque,
        Channel::PressureDrop,
        Channel::OilTemperature,
    ];
    let there: Vec<Channel> = all
        .into_iter()
        .filter(|channel| log.runs.iter().all(|run| run.channel(*channel).is_some()))
        .collect();
    let is_torque = there.contains(&Channel::Torque);
    let (one, other) = loop {
        let pick =
            |rng: &mut Pcg64| there.get(rng.random_range(0..there.len())).copied().unwrap_or(Channel::Angle);
        let pair = (pick(rng), pick(rng));
        let ours = [pair.0, pair.1]
            .into_iter()
            .filter(|c| matches!(c, Channel::Angle | Channel::AngleCommand))
            .count();
        if pair.0 != pair.1 && (is_torque || ours == 2) {
            break pair;
        }
    };
    for run in &mut log.runs {
        let (first, second) = (run.take_channel(one), run.take_channel(other));
        if let (Some(first), Some(second)) = (first, second) {
            run.set_channel(one, second);
            run.set_channel(other, first);
        }
    }
}

/// At 50 to 85 % of the largest torque.
fn clip(log: &mut Log, rng: &mut Pcg64) {
    let most = log.runs.iter().filter_map(|run| run.torque_nm.as_ref()).flatten();
    let most = most.filter(|torque| torque.is_finite()).fold(0.0, |most: f64, torque| most.max(torque.abs()));
    let rail = most * rng.random_range(0.5..0.85);
    for torque in log.runs.iter_mut().filter_map(|run| run.torque_nm.as_mut()).flatten() {
        *torque = if torque.is_nan() { *torque } else { torque.clamp(-rail, rail) };
    }
}

/// Three stretches of up to a twentieth of a run, in half of the runs, in one at least.
fn lose_rows(log: &mut Log, rng: &mut Pcg64) {
    let chosen = rng.random_range(0..log.runs.len());
    for (index, run) in log.runs.iter_mut().enumerate() {
        if (rng.random_bool(0.5) || index == chosen) && run.len() > 200 {
            for _ in 0..3 {
                let length = rng.random_range(2..(run.len() / 20).max(3));
                let from = rng.random_range(10..run.len() - length - 10);
                for channel in Channel::ALL {
                    if let Some(mut values) = run.take_channel(*channel) {
                        values.drain(from..from + length);
                        run.set_channel(*channel, values);
                    }
                }
            }
        }
    }
}

/// A speed, a time, a temperature, or a current in the place of the angle.
fn wrong_column(log: &mut Log, rng: &mut Pcg64) {
    let which = rng.random_range(0..3);
    let mut draw = Pcg64::seed_from_u64(rng.random_range(0..u64::MAX));
    for run in &mut log.runs {
        run.angle_rad = match which {
            0 => speed(&run.time_s, &run.angle_rad),
            1 => run.time_s.clone(),
            _ => run.time_s.iter().map(|_| draw.random_range(-1.0..1.0)).collect(),
        };
    }
}

fn speed(time_s: &[f64], angle_rad: &[f64]) -> Vec<f64> {
    let steps = time_s.windows(2).zip(angle_rad.windows(2));
    let mut speed: Vec<f64> = steps
        .map(|(time, angle)| match (time, angle) {
            ([from_s, to_s], [from, to]) => (to - from) / (to_s - from_s),
            _ => f64::NAN,
        })
        .collect();
    speed.push(speed.last().copied().unwrap_or(0.0));
    speed
}

/// Every value for two to four samples.
fn double(log: &mut Log, rng: &mut Pcg64) {
    let every = rng.random_range(2..5);
    for run in &mut log.runs {
        for channel in Channel::ALL.iter().skip(1) {
            if let Some(values) = run.take_channel(*channel) {
                let held =
                    (0..values.len()).map(|row| values.get(row - row % every).copied().unwrap_or(f64::NAN));
                run.set_channel(*channel, held.collect());
            }
        }
    }
}

fn is_under_pressure(run: &Run) -> bool {
    run.pressure_drop_pa.as_ref().is_some_and(|pressure| pressure.iter().any(|pressure| *pressure > 1e5))
}

/// A third of the runs with another unit.
fn mix(log: &mut Log, rng: &mut Pcg64) {
    let torque = log.runs.iter().any(|run| run.torque_nm.is_some());
    let cases = [
        (Channel::Torque, 100.0),
        (Channel::Torque, 1000.0),
        (Channel::Angle, DEGREES),
        (Channel::PressureDrop, 1e-5),
        (Channel::Time, 1000.0),
    ];
    let has = |channel: Channel| log.runs.iter().all(|run| run.channel(channel).is_some());
    let fits: Vec<_> = cases
        .into_iter()
        .filter(|(channel, _)| has(*channel) && (torque || *channel != Channel::Torque))
        .filter(|(channel, _)| *channel != Channel::PressureDrop || log.runs.iter().all(is_under_pressure))
        .collect();
    let (channel, factor) =
        fits.get(rng.random_range(0..fits.len())).copied().unwrap_or((Channel::Angle, DEGREES));
    for (index, run) in log.runs.iter_mut().enumerate() {
        if index % 3 == 1 {
            scale_run(run, channel, factor);
        }
    }
}

/// A campaign, with or without something hidden.
fn campaign(seed: u64, family: Family, log: LogKind, hidden: bool) -> Option<(Log, Model)> {
    let mut what = Hidden { family, ..Hidden::none(log) };
    if hidden {
        let id = choose(seed, &effects_of(log));
        what = Hidden { family, ..Hidden::with(log, &[id], STRONG) };
    }
    what.samples = 30_000;
    let drawn = Campaign::try_draw(seed, &what)?;
    let model = config::parse_model(&drawn.model_toml, "model").ok()?;
    Some((drawn.log, model))
}

fn mistakes(found: &[Finding]) -> Vec<&Finding> {
    found.iter().filter(|finding| finding.severity == Severity::Mistake).collect()
}

/// Makes each mistake in campaigns of its own, and inspects them; and campaigns without any.
///
/// # Errors
/// None.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let (campaigns, clean) = if quick { (4, 20) } else { (arguments.campaigns, arguments.clean) };
    let title = format!("{campaigns} campaigns of the rig for each mistake, {clean} without any");
    let mut sheet = Sheet::new("data-quality", title, &["mistake", "named", "of", "and another claimed"]);
    let mut data = Vec::new();
    let wanted = |name: &str| arguments.only.as_ref().is_none_or(|only| name.contains(only));
    let clean = if wanted("none") { clean } else { 0 };
    let chosen: Vec<&Mistake> = MISTAKES.iter().filter(|mistake| wanted(mistake.name)).collect();
    let progress = Progress::new((chosen.len() as u64 * campaigns + clean) as usize);
    for mistake in chosen {
        let tally = made(mistake, campaigns, arguments, &progress);
        sheet.row([
            mistake.name.to_owned(),
            tally.named.to_string(),
            tally.of.to_string(),
            tally.others.to_string(),
        ]);
        data.push(tally.json(mistake.name));
    }
    let (claimed, of, slowest) = unspoilt(clean, arguments, &progress);
    sheet.row(["none".to_owned(), "-".to_owned(), of.to_string(), claimed.to_string()]);
    data.push(json!({ "mistake": "none", "claimed": claimed, "of": of, "s_for_250000_samples": slowest }));
    sheet.row(["slowest, s for 250,000 samples".to_owned(), digits(slowest), String::new(), String::new()]);
    Ok(Results {
        command: "data-quality",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "one thread".to_owned(),
        sheets: vec![sheet],
        data: Value::Array(data),
    })
}

#[derive(Default)]
struct Tally {
    named: u64,
    others: u64,
    of: u64,
}

impl Tally {
    fn json(&self, name: &str) -> Value {
        json!({ "mistake": name, "named": self.named, "of": self.of, "others": self.others })
    }
}

fn kind(mistake: &Mistake, seed: u64) -> LogKind {
    choose(seed, mistake.logs)
}

fn made(mistake: &Mistake, campaigns: u64, arguments: &Arguments, progress: &Progress) -> Tally {
    let mut tally = Tally::default();
    let mut seed = arguments.seed;
    while tally.of < campaigns {
        seed += 1;
        let log_kind = kind(mistake, seed);
        let Some((mut log, model)) = campaign(seed, Family::Real, log_kind, seed.is_multiple_of(3)) else {
            continue;
        };
        // It must be there to be mistaken.
        let absent = match mistake.kinds {
            [Kind::PressureUnit] => !log.runs.iter().any(is_under_pressure),
            [Kind::RunsDiffer] => log.runs.len() < 2,
            _ => false,
        };
        if absent {
            continue;
        }
        progress.next(mistake.name);
        let mut rng = Pcg64::seed_from_u64(seed);
        (mistake.make)(&mut log, &mut rng);
        let found = inspect(&log, Some(&model));
        let claims = mistakes(&found);
        let named = claims.iter().any(|finding| mistake.kinds.contains(&finding.kind));
        let other = claims.iter().any(|finding| !mistake.kinds.contains(&finding.kind));
        tally.of += 1;
        tally.named += u64::from(named);
        tally.others += u64::from(other);
        if arguments.verbose && (!named || other) {
            println!("{} seed {seed} {log_kind:?}: {found:#?}", mistake.name);
        }
    }
    tally
}

/// How many of the campaigns without mistakes a claim is made in, of how many; and the slowest inspection.
fn unspoilt(clean: u64, arguments: &Arguments, progress: &Progress) -> (u64, u64, f64) {
    let (mut claimed, mut of, mut slowest) = (0, 0, 0.0);
    let mut seed = arguments.seed + 100_000;
    while of < clean {
        seed += 1;
        let family = if seed.is_multiple_of(3) { Family::Exact } else { Family::Real };
        let log_kind = if seed.is_multiple_of(2) { LogKind::Torque } else { LogKind::Angle };
        let Some((log, model)) = campaign(seed, family, log_kind, seed % 5 < 2) else { continue };
        of += 1;
        progress.next("none");
        let begun = Instant::now();
        let found = inspect(&log, Some(&model));
        let samples: usize = log.runs.iter().map(Run::len).sum();
        slowest = f64::max(slowest, begun.elapsed().as_secs_f64() * 250_000.0 / samples as f64);
        let claims = mistakes(&found);
        if !claims.is_empty() {
            claimed += 1;
            if arguments.verbose {
                println!("clean seed {seed} {family:?} {log_kind:?}: {claims:#?}");
            }
        }
    }
    (claimed, of, slowest)
}
