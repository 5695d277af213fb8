//! The bridge's round trip to the simulated drive beside the bare echo's, in turns.

use super::echo;
use super::ride::{Ride, drive};
use crate::output::{Sheet, us};
use crate::progress::Progress;
use crate::timing::Times;
use anyhow::Result;
use serde_json::{Value, json};
use signals::StepCommand;

/// A bus that is lost only after so many cycles: a stall of the machine shall not end a turn.
const PATIENT_CYCLES: u64 = 1000;

pub(super) fn run(quick: bool, progress: &Progress) -> Result<(Sheet, Value)> {
    let (turns, cycles) = if quick { (1, 1_000) } else { (8, 8_000) };
    let (mut echoes, mut bridges) = (Vec::new(), Vec::new());
    for turn in 1..=turns {
        progress.next(format!("echo, turn {turn}"));
        let mut times = Times::new()?;
        echo::trips(cycles, &mut times)?;
        echoes.push(times);
        progress.next(format!("bridge, turn {turn}"));
        bridges.push(bridge(cycles)?);
    }
    let title = "Round trip over a pair of virtual interfaces, one frame of 94 bytes a cycle of 1 ms, µs";
    let header = ["over", "frames", "p50", "p99", "p50 / echo's, by turn", "p99 / echo's, by turn"];
    let mut sheet = Sheet::new("bus-drive-round-trip", title, &header);
    let mut data = serde_json::Map::new();
    for (name, all) in [("bare echo", &echoes), ("bridge and simulated drive", &bridges)] {
        let mut sum = Times::new()?;
        all.iter().for_each(|times| sum.add_times(times));
        let ratio = |part: f64| ratio(all, &echoes, part);
        let quantile = |part: f64| us(sum.quantile_ns(part));
        sheet.row([
            name.to_owned(),
            sum.count().to_string(),
            quantile(0.5),
            quantile(0.99),
            ratio(0.5),
            ratio(0.99),
        ]);
        data.insert(name.to_owned(), sum.json());
    }
    Ok((sheet, json!(data)))
}

fn bridge(cycles: u64) -> Result<Times> {
    let drive = drive(&[])?;
    let mut ride = Ride::start(PATIENT_CYCLES)?;
    ride.operate()?;
    let mut times = Times::new()?;
    let mut lost = ride.bridge.status().lost_frames;
    for _ in 0..cycles {
        ride.step(&StepCommand::default(), false);
        let status = ride.bridge.status();
        if status.lost_frames == lost {
            times.add(status.round_trip_ns);
        }
        lost = status.lost_frames;
    }
    drive.end()?;
    Ok(times)
}

/// Median over the turns of one's quantile over the other's in the same turn, with the least and the largest.
fn ratio(own: &[Times], other: &[Times], part: f64) -> String {
    let at = |times: &Times| times.quantile_ns(part).max(1) as f64;
    let mut ratios: Vec<f64> = own.iter().zip(other).map(|(own, other)| at(own) / at(other)).collect();
    ratios.sort_by(f64::total_cmp);
    let pick = |index: usize| ratios.get(index).copied().unwrap_or(f64::NAN);
    let last = ratios.len().saturating_sub(1);
    format!("{:.2} ({:.2} to {:.2})", pick(last / 2), pick(0), pick(last))
}
