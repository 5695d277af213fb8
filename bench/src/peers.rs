//! `bench peers`: LinuxCNC's servo thread beside the loop, in turns, by the time between two wake-ups.

use crate::output::{Results, Sheet, us};
use crate::programs::{LOOP, Workplace, installed, scheduling};
use crate::progress::Progress;
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result, bail};
use recording::{AnyMessage, read_record};
use serde_json::json;
use signals::Source;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};

const PERIOD_NS: u64 = 1_000_000;
/// HAL's first cycles fill caches, as ours do.
const WARM_UP: usize = 50;
/// The user that LinuxCNC's setuid program drops to.
const NOBODY: &str = "65534";

/// Takes turns: the loop, LinuxCNC, the loop, ...
///
/// # Errors
/// Where a run fails.
pub fn run(quick: bool) -> Result<Results> {
    let (turns, cycles) = if quick { (1, 1_000) } else { (3, 10_000) };
    let there = installed("halrun");
    let progress = Progress::new(2 * turns);
    let place = Workplace::new()?;
    let mut ours = LOOP.iter().map(|_| Times::new()).collect::<Result<Vec<_>>>()?;
    let (mut servo, mut obtained, mut servo_realtime) = (Times::new()?, String::new(), true);
    for turn in 1..=turns {
        progress.next(format!("the loop, turn {turn}"));
        obtained = loop_turn(&place, cycles, &mut ours)?;
        progress.next(format!("LinuxCNC, turn {turn}"));
        if there {
            servo_realtime &= linuxcnc_turn(&place, cycles, &mut servo)?;
        }
    }
    let title = "Time between two wake-ups minus the period of 1 ms, either way, µs";
    let mut sheet = Sheet::new("peers", title, &["thread", "p50", "p99", "p99.9", "max"]);
    for (name, times) in LOOP.iter().zip(&ours) {
        sheet.row([format!("stepvalve, {name}")].into_iter().chain(times.percentiles_ns().map(us)));
    }
    let doubt = if servo_realtime { "" } else { ", which found no real time here" };
    let name = format!("LinuxCNC, servo thread{doubt}");
    if there {
        sheet.row([name].into_iter().chain(servo.percentiles_ns().map(us)));
    } else {
        sheet.row([name].into_iter().chain(["not installed", "–", "–", "–"].map(str::to_owned)));
    }
    let processes = LOOP.iter().zip(&ours).map(|(name, times)| ((*name).to_owned(), times.json()));
    Ok(Results {
        command: "peers",
        quick,
        machine: realtime::machine_facts(),
        scheduling: format!("{obtained}; LinuxCNC: its own choice"),
        sheets: vec![sheet],
        data: json!({
            "stepvalve": processes.collect::<serde_json::Map<_, _>>(),
            "linuxcnc": there.then(|| servo.json()), "linuxcnc_realtime": there.then_some(servo_realtime),
        }),
    })
}

fn loop_turn(place: &Workplace, cycles: u64, ours: &mut [Times]) -> Result<String> {
    let scenario = place.path("peers.toml");
    Variant::of_1khz(cycles).write(&scenario)?;
    let summary = place.simulate(&scenario, "realtime", &[])?;
    let run = place.newest_run().context("the run's folder")?;
    let mut woke_before = [None; LOOP.len()];
    read_record(&[run.join("run-0001.mcap")], |message| {
        let AnyMessage::LoopTiming(source, m) = message else { return };
        let index = match source {
            Source::Plant => 0,
            Source::Trajectory => 1,
            Source::Controller => 2,
            Source::Recorder | Source::Supervisor => return,
        };
        let woke_ns = m.body.deadline_ns + m.body.wake_up_latency_ns;
        if let (Some(before), Some(times)) = (woke_before.get_mut(index), ours.get_mut(index))
            && let Some(before_ns) = before.replace(woke_ns)
            && m.header.cycle > WARM_UP as u64
        {
            times.add((woke_ns - before_ns).abs_diff(PERIOD_NS));
        }
    })?;
    Ok(scheduling(&summary))
}

/// A HAL with a servo thread that runs timedelta and nothing else; `sampler` hands out each cycle's error.
/// Says whether it had real time: it goes without where its conditions aren't met.
fn linuxcnc_turn(place: &Workplace, cycles: u64, servo: &mut Times) -> Result<bool> {
    let (hal, samples) = (place.path("servo.hal"), place.path("samples"));
    let wanted = cycles as usize + WARM_UP;
    let text = format!(
        "loadrt threads name1=servo period1={PERIOD_NS}\n\
         loadrt timedelta count=1\n\
         loadrt sampler depth=16000 cfg=s\n\
         addf timedelta.0 servo\n\
         addf sampler.0 servo\n\
         net error timedelta.0.current-error sampler.0.pin.0\n\
         start\n\
         loadusr -w halsampler -n {wanted} {}\n\
         stop\n",
        samples.display()
    );
    std::fs::write(&hal, text)?;
    // Started by root it drops to a user that must be named, and that must be able to make its socket.
    let open_to_all = tempfile::tempdir()?;
    std::fs::set_permissions(open_to_all.path(), Permissions::from_mode(0o777))?;
    let output = Command::new("halrun")
        .arg("-f")
        .arg(&hal)
        .env("RTAPI_UID", NOBODY)
        .env("RTAPI_FIFO_PATH", open_to_all.path().join("rtapi"))
        .env("LINUXCNC_FORCE_REALTIME", "1")
        .stdin(Stdio::null())
        .output()
        .context("halrun")?;
    if !output.status.success() {
        bail!("halrun: {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
    }
    let text = std::fs::read_to_string(&samples).context("halsampler's samples")?;
    let errors = text.lines().filter_map(|line| line.trim().parse::<i64>().ok());
    errors.skip(WARM_UP).for_each(|error_ns| servo.add(error_ns.unsigned_abs()));
    if servo.count() == 0 {
        bail!("halsampler wrote no samples: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(!String::from_utf8_lossy(&output.stderr).contains("non-realtime"))
}
