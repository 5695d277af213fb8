//! A cable that is pulled while the drive turns: when the fault is told, when the drive brakes and stands, when the bus is back.

use super::ride::{PERIOD_NS, Ride, drive};
use crate::output::Sheet;
use crate::programs::Workplace;
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use realtime::now_ns;
use serde_json::{Value, json};
use signals::StepCommand;
use subdevice::{SyncRow, read_log};

/// As the shipped drive file says.
const BUS_LOST_CYCLES: u64 = 3;
const RATE_HZ: f64 = 200e3;
/// By which the rate changes in a cycle, Hz.
const RAMP_HZ: f64 = 19e3;
const TURNING_CYCLES: u64 = 60;
/// How long the cable is out, ns.
const OUT_NS: u64 = 100_000_000;
const PATIENCE_CYCLES: u64 = 10_000;

/// What a trial showed.
struct Trial {
    /// Cycles from the first frame lost to the fault in Feedback.
    told: u64,
    /// SYNC0 from the last fresh outputs to the first of the ramp, and to standstill.
    brakes: u64,
    stands: u64,
    /// From the cable's return to operation, ns.
    back_ns: u64,
}

pub(super) fn run(quick: bool, progress: &Progress) -> Result<(Sheet, Value)> {
    let trials = if quick { 2 } else { 20 };
    let mut sheet = Sheet::new(
        "bus-drive-cable",
        format!("The cable is out for 100 ms at {} kHz, {trials} times; cycles of 1 ms", RATE_HZ / 1e3),
        &[
            "drive without fresh outputs",
            "fault told after, cycles",
            "brakes after",
            "stands after",
            "bus back in operation, s",
        ],
    );
    let mut data = Vec::new();
    for (name, option) in [("stands", None), ("goes on", Some("--extrapolate"))] {
        let mut all = Vec::new();
        for number in 1..=trials {
            progress.next(format!("cable, {name}, {number}"));
            all.push(trial(option)?);
        }
        let spread = |value: fn(&Trial) -> u64| {
            let values = || all.iter().map(value);
            (values().min().unwrap_or(0), values().max().unwrap_or(0))
        };
        let cycles = |value: fn(&Trial) -> u64| {
            let (least, most) = spread(value);
            if least == most { least.to_string() } else { format!("{least} to {most}") }
        };
        let (soonest, latest) = spread(|trial| trial.back_ns);
        sheet.row([
            name.to_owned(),
            cycles(|trial| trial.told),
            cycles(|trial| trial.brakes),
            cycles(|trial| trial.stands),
            format!("{:.2} to {:.2}", soonest as f64 / 1e9, latest as f64 / 1e9),
        ]);
        let rows = all.iter().map(|trial| json!([trial.told, trial.brakes, trial.stands, trial.back_ns]));
        data.push(
            json!({"without_fresh_outputs": name, "told_brakes_stands_back_ns": rows.collect::<Vec<_>>()}),
        );
    }
    Ok((sheet, json!(data)))
}

fn trial(option: Option<&str>) -> Result<Trial> {
    let place = Workplace::new()?;
    let log = place.path("drive.csv").display().to_string();
    let arguments: Vec<&str> = ["--log", &log].into_iter().chain(option).collect();
    let mut drive = drive(&arguments)?;
    let mut ride = Ride::start(BUS_LOST_CYCLES)?;
    let mut course = Ramp { position: ride.enable()?, rate_hz: 0.0 };
    for _ in 0..TURNING_CYCLES {
        ride.step(&course.next(), false);
    }
    let lost_before = ride.bridge.status().lost_frames;
    drive.hurt(&format!("cable {OUT_NS}"))?;
    let back_ns = now_ns() + OUT_NS;
    let told = told(&mut ride, &mut course, lost_before)?;
    for _ in 0..PATIENCE_CYCLES {
        ride.step(&StepCommand::default(), false);
        if now_ns() >= back_ns && ride.operates() {
            break;
        }
    }
    let operates_ns = now_ns();
    drive.end()?;
    let (brakes, stands) =
        stop(&read_log(place.path("drive.csv").as_path())?).context("the drive does not stop")?;
    Ok(Trial { told, brakes, stands, back_ns: operates_ns.saturating_sub(back_ns) })
}

/// Goes on until a fault is told: cycles from the first frame that was lost.
fn told(ride: &mut Ride, course: &mut Ramp, lost_before: u64) -> Result<u64> {
    let mut first_lost = None;
    for cycle in 0..PATIENCE_CYCLES {
        let (_, feedback) = ride.step(&course.next(), false);
        if ride.bridge.status().lost_frames > lost_before {
            first_lost.get_or_insert(cycle);
        }
        if feedback.is_some_and(|feedback| feedback.drive_fault != 0) {
            return Ok(cycle + 1 - first_lost.unwrap_or(cycle));
        }
    }
    bail!("no fault is told: {:?}", ride.bridge.status())
}

/// SYNC0 from the last fresh outputs in motion to the first slower cycle, and to the first at rest.
fn stop(rows: &[SyncRow]) -> Option<(u64, u64)> {
    let way = |row: &SyncRow| (row.end - row.start).abs();
    let full = (RATE_HZ * PERIOD_NS as f64 / 1e9) as i64;
    let last = rows.iter().rposition(|row| row.fresh && way(row) + 1 >= full)?;
    let after = rows.get(last + 1..)?;
    let brakes = after.iter().position(|row| way(row) + 1 < full)?;
    let stands = after.iter().position(|row| way(row) == 0)?;
    Some((brakes as u64 + 1, stands as u64 + 1))
}

/// A ramp to the rate, and on.
struct Ramp {
    position: f64,
    rate_hz: f64,
}

impl Ramp {
    fn next(&mut self) -> StepCommand {
        self.rate_hz = (self.rate_hz + RAMP_HZ).min(RATE_HZ);
        self.position += self.rate_hz * PERIOD_NS as f64 / 1e9;
        StepCommand {
            position_microsteps: self.position.round() as i64,
            position_unrounded: self.position,
            pulse_rate_hz: self.rate_hz,
            follow: 1,
            follow_id: 1,
            energise: 1,
            ..StepCommand::default()
        }
    }
}
