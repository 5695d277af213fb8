//! The same faults between real processes in lockstep: what they record must be what one thread computes, bit for bit.

use super::ground::{Ground, VARIANTS, Variant};
use super::in_process::{Trial, Watch, outcome};
use super::tally::{Outcome, Tally};
use crate::programs::Workplace;
use crate::progress::Progress;
use anyhow::{Context, Result};
use closed_loop::InProcess;
use injection::FaultyWire;
use recording::{AnyMessage, read_record};
use signals::{Body, PlantTruth};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs many trials.
///
/// # Errors
/// Where a run can't be started.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    let place = Workplace::new()?;
    let grounds = VARIANTS.iter().map(Variant::ground).collect::<Result<Vec<_>>>()?;
    println!("in lockstep: seeds {} to {}", seed << 32, (seed << 32) + trials - 1);
    let progress = Progress::new(trials as usize);
    for number in 0..trials {
        let seed = (seed << 32) + number;
        let trial = Trial::draw(seed);
        progress.next(trial.name);
        let Some(ground) = grounds.get(trial.variant) else { continue };
        tally.note(one(&place, ground, &trial, seed)?);
    }
    Ok(())
}

fn one(place: &Workplace, ground: &Ground, trial: &Trial, seed: u64) -> Result<Outcome> {
    let exact = format!("seed {seed}, {}: {}", ground.name, trial.injection);
    let scenario = place.path("scenario.toml");
    std::fs::write(&scenario, &ground.text)?;
    let out = place.path("out");
    let _ = std::fs::remove_dir_all(&out);
    let mut command = place.stepvalve()?;
    command.args(["simulate", "--mode", "lockstep", "--instance", "fault", "--allow-injection", "--inject"]);
    command.arg(trial.injection.to_string()).arg("--out").arg(&out).arg(&scenario);
    let said = place.path("stderr.txt");
    command.stderr(std::fs::File::create(&said)?);
    let code = end_of(command)?;
    let mut outcome = match code {
        Some(0 | 3) => judged(ground, trial, exact, &out.join("run-0001.mcap"))?,
        code => Outcome {
            fault: trial.name.to_owned(),
            exact,
            violations: vec![format!(
                "{}: {}",
                code.map_or("hangs".to_owned(), |code| format!("ended with {code}")),
                std::fs::read_to_string(&said)?.trim()
            )],
            ..Outcome::default()
        },
    };
    outcome.violations.extend(leftovers(place, "fault"));
    Ok(outcome)
}

/// Runs a command to its end; its exit code, `None` where it hangs. Its stderr goes where the caller sends it.
pub fn end_of(mut command: Command) -> Result<Option<i32>> {
    let mut process = command.stdout(Stdio::null()).spawn().context("stepvalve")?;
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if let Some(status) = process.try_wait()? {
            return Ok(Some(status.code().unwrap_or(-1)));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    process.kill()?;
    process.wait()?;
    Ok(None)
}

/// What is left of an instance that has ended: its folder, shared memory.
pub fn leftovers(place: &Workplace, instance: &str) -> Vec<String> {
    let folder = place.path("runtime/stepvalve").join(instance);
    let prefix = shared_memory_prefix(&folder);
    let entries = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix));
    let mut left: Vec<PathBuf> = ours.map(|entry| entry.path()).collect();
    left.extend(folder.exists().then_some(folder));
    left.into_iter().map(|path| format!("left behind: {}", path.display())).collect()
}

/// What the names of an instance's shared memory begin with.
pub fn shared_memory_prefix(folder: &Path) -> String {
    let hash = crc32c::crc32c(folder.as_os_str().as_encoded_bytes());
    format!("stepvalve_{}_{hash:08x}_", nix::unistd::getuid())
}

fn judged(ground: &Ground, trial: &Trial, exact: String, record: &Path) -> Result<Outcome> {
    let mut watch = Watch::new(ground, trial.injection.at);
    let mut truths = BTreeMap::new();
    read_record(&[record], |message| match message {
        AnyMessage::PlantTruth(m) => {
            truths.insert(m.header.cycle, m.body);
            watch.judge().truth(m.header.cycle, &m.body);
        }
        AnyMessage::StepCommand(m) => watch.judge().command(m.header.cycle, &m.body),
        AnyMessage::Feedback(m) => watch.flags(m.header.cycle, m.body.validity),
        AnyMessage::ControlStatus(m) => watch.state(m.header.cycle, m.body.state),
        _ => {}
    })?;
    let mut outcome = outcome(ground, trial, exact, &watch.end());
    if let Some(cycle) = first_difference(ground, trial, &truths) {
        outcome.violations.push(format!("differs from the run in one thread in cycle {cycle}"));
    }
    Ok(outcome)
}

/// The first cycle in which the valve is not bit for bit where it is in one thread.
fn first_difference(ground: &Ground, trial: &Trial, truths: &BTreeMap<u64, PlantTruth>) -> Option<u64> {
    let wire = FaultyWire::new(&ground.parts, std::slice::from_ref(&trial.injection));
    let mut run = InProcess::over(&ground.parts, wire);
    while let Some(outputs) = run.cycle() {
        let expected = outputs.plant.map(|plant| words(&plant.truth));
        if truths.get(&outputs.cycle).map(words) != expected {
            return Some(outputs.cycle);
        }
    }
    None
}

fn words(truth: &PlantTruth) -> Vec<u64> {
    let mut words = Vec::new();
    truth.each_word(|word| words.push(word));
    words
}
