//! The bus's clock: how long until our cycle is on it, where the frame lies before SYNC0, and which SYNC0 find no fresh outputs.

use super::ride::{PERIOD_NS, PLACE_NS, Ride, drive};
use crate::output::{Sheet, us};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::stalls::{watch, within};
use crate::timing::Times;
use anyhow::Result;
use realtime::now_ns;
use serde_json::{Value, json};
use signals::StepCommand;
use subdevice::read_log;

/// Crystals, parts per billion.
const DRIFTS_PPB: [i64; 3] = [-100_000, 0, 100_000];
/// OP, in a row's AL status.
const OP: u16 = 8;
/// What a stall may still disturb before and after, ns: two cycles.
const AROUND_NS: u64 = 2_000_000;
/// A bus that is lost only after so many cycles: a stall of the machine shall not end a ride.
const PATIENT_CYCLES: u64 = 1000;

pub(super) fn run(quick: bool, progress: &Progress) -> Result<(Sheet, Value)> {
    let cycles = if quick { 2_000 } else { 60_000 };
    let wanted = (PERIOD_NS - PLACE_NS) / 1000;
    let title = format!(
        "The frame before SYNC0 (wanted: {wanted} µs), {} s from OP on, by the drive's crystal; stalls: the machine stood still",
        cycles / 1000
    );
    let header = [
        "crystal",
        "to OP, s",
        "p1, µs",
        "p50, µs",
        "p99, µs",
        "SYNC0",
        "without fresh outputs",
        "of these outside stalls",
        "stalls",
    ];
    let mut sheet = Sheet::new("bus-drive-clock", title, &header);
    let mut data = Vec::new();
    for drift_ppb in DRIFTS_PPB {
        progress.next(format!("clock, {} ppm", drift_ppb / 1000));
        let seen = ride(drift_ppb, cycles)?;
        sheet.row([
            format!("{:+} ppm", drift_ppb / 1000),
            format!("{:.2}", seen.to_op_ns as f64 / 1e9),
            us(seen.ages.quantile_ns(0.01)),
            us(seen.ages.quantile_ns(0.5)),
            us(seen.ages.quantile_ns(0.99)),
            seen.sync0.to_string(),
            seen.stale.to_string(),
            seen.stale_outside.to_string(),
            seen.stalls.to_string(),
        ]);
        data.push(json!({
            "drift_ppb": drift_ppb, "to_op_ns": seen.to_op_ns, "sync0": seen.sync0, "stale": seen.stale,
            "stale_outside_stalls": seen.stale_outside, "stalls": seen.stalls, "frame_before_sync0": seen.ages.json(),
        }));
    }
    Ok((sheet, json!(data)))
}

struct Seen {
    to_op_ns: u64,
    /// How long before each SYNC0 its frame came.
    ages: Times,
    sync0: u64,
    stale: u64,
    stale_outside: u64,
    stalls: u64,
}

fn ride(drift_ppb: i64, cycles: u64) -> Result<Seen> {
    let place = Workplace::new()?;
    let log = place.path("drive.csv");
    let drift = drift_ppb.to_string();
    let drive = drive(&["--log", &log.display().to_string(), "--drift", &drift])?;
    let stalls = watch();
    let began_ns = now_ns();
    let mut ride = Ride::start(PATIENT_CYCLES)?;
    ride.operate()?;
    let to_op_ns = now_ns() - began_ns;
    for _ in 0..cycles {
        ride.step(&StepCommand::default(), false);
    }
    let ended_ns = now_ns();
    drive.end()?;
    let stalls = stalls.seen();
    let mut seen = Seen {
        to_op_ns,
        ages: Times::new()?,
        sync0: 0,
        stale: 0,
        stale_outside: 0,
        stalls: stalls.len() as u64,
    };
    let from_ns = began_ns + to_op_ns;
    for row in read_log(&log)?.iter().filter(|row| row.al == OP && (from_ns..ended_ns).contains(&row.host_ns))
    {
        seen.sync0 += 1;
        if row.fresh {
            seen.ages.add(row.age_ns);
            continue;
        }
        seen.stale += 1;
        seen.stale_outside +=
            u64::from(within(&stalls, row.host_ns - AROUND_NS, row.host_ns + AROUND_NS) == 0);
    }
    Ok(seen)
}
