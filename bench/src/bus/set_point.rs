//! From a SetPoint to the first StepCommand that follows it, in an instance that operators speak to.

use crate::output::{Sheet, us};
use crate::programs::Workplace;
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result, bail, ensure};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use recording::{AnyMessage, read_record};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::process::Child;
use std::time::{Duration, Instant};

/// How long the instance may take to answer the first time.
const PATIENCE: Duration = Duration::from_secs(30);

/// Gives so many set-points, and reads from the record what became of them.
///
/// # Errors
/// Where the instance can't be started, refuses to be armed, or its record can't be read.
pub fn run(set_points: usize) -> Result<(Sheet, Value)> {
    let place = Workplace::new()?;
    let scenario = place.path("set-point.toml");
    Variant::of_1khz(1_000).write(&scenario)?;
    let out = place.path("record");
    let mut run = place.stepvalve()?;
    run.args(["run", "--instance", "bench", "--record", "all", "--out"]).arg(&out).arg(&scenario);
    let complaints = place.path("complaints");
    run.stdout(File::create(place.path("said"))?).stderr(File::create(&complaints)?);
    let mut run = run.spawn().context("stepvalve run")?;
    let given = give(&place, set_points);
    end(&mut run)?;
    given.with_context(|| std::fs::read_to_string(&complaints).unwrap_or_default())?;
    let times = read(&out)?;
    ensure!(times.count() > 0, "no set-point was followed");
    Ok(table(&times))
}

fn give(place: &Workplace, set_points: usize) -> Result<()> {
    let begun = Instant::now();
    while !ask(place, &["arm"])? {
        ensure!(begun.elapsed() < PATIENCE, "the instance can't be armed");
        std::thread::sleep(Duration::from_millis(50));
    }
    for number in 0..set_points {
        // Each client is a process of its own, so the set-points come at any time of a cycle.
        let angle = if number % 2 == 0 { "1deg" } else { "2deg" };
        // A stall of the machine may have stopped the valve: then it is armed anew, and this one does not count.
        if !ask(place, &["set", "angle", angle])? {
            ask(place, &["reset"])?;
            ask(place, &["arm"])?;
        }
    }
    Ok(())
}

fn ask(place: &Workplace, words: &[&str]) -> Result<bool> {
    Ok(place.stepvalve()?.args(words).output()?.status.success())
}

fn end(run: &mut Child) -> Result<()> {
    kill(Pid::from_raw(i32::try_from(run.id())?), Signal::SIGTERM)?;
    let status = run.wait()?;
    if !status.success() {
        bail!("stepvalve run: {status}");
    }
    Ok(())
}

/// A SetPoint's way: the first Reference n that leads to it, and StepCommand n−1, which is made from that.
fn read(folder: &std::path::Path) -> Result<Times> {
    let mut segments: Vec<_> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    segments.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    segments.sort();
    let mut asked = Vec::new();
    let mut first_reference: HashMap<u64, u64> = HashMap::new();
    let mut commands = BTreeMap::new();
    read_record(&segments, |message| match message {
        AnyMessage::SetPoint(m) => asked.push((m.body.id, m.header.monotonic_ns)),
        AnyMessage::Reference(m) => {
            first_reference.entry(m.body.set_point_id).or_insert(m.header.cycle);
        }
        AnyMessage::StepCommand(m) => _ = commands.insert(m.header.cycle, m.header.monotonic_ns),
        _ => {}
    })?;
    let mut times = Times::new()?;
    for (id, asked_ns) in asked {
        let reference = first_reference.get(&id).and_then(|cycle| cycle.checked_sub(1));
        if let Some(sent_ns) = reference.and_then(|cycle| commands.get(&cycle)) {
            times.add(sent_ns.saturating_sub(asked_ns));
        }
    }
    Ok(times)
}

fn table(times: &Times) -> (Sheet, Value) {
    let title = format!(
        "{} SetPoints sent to the first StepCommand sent that follows each, 1 kHz, µs: the wait for the trajectory's \
         phase (half a cycle on average), then trajectory and controller",
        times.count()
    );
    let mut sheet = Sheet::new("bus-set-point", title, &["from", "p50", "p99", "p99.9", "max"]);
    sheet.row(
        ["SetPoint sent to StepCommand sent".to_owned()].into_iter().chain(times.percentiles_ns().map(us)),
    );
    (sheet, times.json())
}
