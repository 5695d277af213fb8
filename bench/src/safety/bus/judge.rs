//! What the drive's own log says of a trial: leaps, the ramp, standstill, and whether it armed by itself.

use super::faults::{Fault, Trouble};
use crate::safety::tally::Outcome;
use crate::stalls::within;
use machine_stalls::Stall;
use std::time::Duration;
use subdevice::SyncRow;

/// Micro-steps of a cycle at the driver's highest rate, and one for the rounding.
const LONGEST_WAY: i64 = 601;
/// A cycle that is shorter than the one before by so much belongs to a ramp: friction compensation changes a steady rate by less.
const RAMP: i64 = 8;
/// What a ramp of 10 MHz/s takes off the micro-steps of each cycle of 1 ms.
const RAMP_STEPS: u64 = 10;
/// Longer between two SYNC0 is a pause of the clock, ns.
const PAUSE_NS: u64 = 3_000_000;
/// The bus has to operate again within so long of the trouble's end, or of the restart of processes, ns.
const BACK_WITHIN_NS: u64 = 2_000_000_000;
/// So many cycles of a late stop are shown.
const SHOWN_CYCLES: usize = 100;
/// The drive follows, by its status word.
const MASK: u16 = 0x6F;
const ENABLED: u16 = 0x27;

/// What a trial showed from outside.
pub(super) struct Told {
    pub(super) fault: Fault,
    pub(super) at_ns: u64,
    /// When the trouble was over.
    pub(super) over_ns: u64,
    /// When the operator's next order may come.
    pub(super) until_ns: u64,
    /// The controller's state at the end.
    pub(super) state: String,
    /// What the bridge complained of last.
    pub(super) complaints: String,
    /// From the trouble's end to operation.
    pub(super) back: Option<Duration>,
    pub(super) violations: Vec<String>,
}

impl Told {
    pub(super) fn new(fault: Fault, at_ns: u64) -> Self {
        Self {
            fault,
            at_ns,
            over_ns: at_ns,
            until_ns: at_ns,
            state: String::new(),
            complaints: String::new(),
            back: None,
            violations: Vec::new(),
        }
    }
}

/// Judges a trial by the rows of its time. Cycles in which the machine stood still are not counted.
pub(super) fn judged(told: &Told, rows: &[SyncRow], stalls: &[Stall]) -> Outcome {
    let from = rows.partition_point(|row| row.host_ns < told.at_ns);
    let until = rows.partition_point(|row| row.host_ns < told.until_ns);
    let own = rows.get(from..until).unwrap_or(&[]);
    let mut violations = told.violations.clone();
    if let Some(leap) = own.iter().find(|row| way(row).abs() > LONGEST_WAY) {
        violations.push(format!("a leap: {leap:?}"));
    }
    let stopped = matches!(told.state.as_str(), "fault" | "disarmed");
    if told.fault.must_stop && !stopped {
        violations.push(format!("the valve was not stopped: {}", told.state));
    }
    let mut outcome = Outcome {
        fault: told.fault.kind.clone(),
        exact: format!("{:?}, back after {:?}", told.fault, told.back),
        stopped,
        ..Outcome::default()
    };
    if let Some(back) = told.back {
        let back_ns = u64::try_from(back.as_nanos()).unwrap_or(u64::MAX);
        let stalled_ns = within(stalls, told.over_ns, told.over_ns + back_ns);
        if back_ns > BACK_WITHIN_NS + stalled_ns {
            violations.push(format!(
                "the bus is back after {back:?}, of which the machine stood still for {stalled_ns} ns: {}",
                told.complaints
            ));
        }
    }
    if stopped && told.fault.must_stop && !told.fault.while_arming() {
        let before = from.checked_sub(1).and_then(|last| rows.get(last));
        stop((told, stalls), before, own, &mut outcome, &mut violations);
        if !outcome.late().is_empty() {
            outcome.exact.push_str(&cycles_in_words(told.at_ns, own, stalls));
        }
    }
    if told.fault.trouble == Trouble::Enabling(1_000_000)
        && own.iter().any(|row| row.status & MASK == ENABLED)
    {
        violations.push("enabled without current".to_owned());
    }
    outcome.violations = violations;
    outcome
}

fn way(row: &SyncRow) -> i64 {
    row.end - row.start
}

/// Ramp and last pulse, and that nothing follows.
fn stop(
    (told, stalls): (&Told, &[Stall]),
    before: Option<&SyncRow>,
    own: &[SyncRow],
    outcome: &mut Outcome,
    violations: &mut Vec<String>,
) {
    let cycles = |row: &SyncRow| (row.host_ns - told.at_ns) / 1_000_000;
    let (first, later) = own.split_at(until_a_pause(before, own));
    // The valve may still have been gaining speed, or the drive making up for a frame that it missed.
    let mut most = before.map_or(0, |row| way(row).abs());
    let ramp = first.iter().find(|row| {
        most = most.max(way(row).abs());
        way(row).abs() < most - RAMP
    });
    let last_pulse_by = told.fault.ramp_by + most.unsigned_abs().div_ceil(RAMP_STEPS) + 1;
    let stalled_ns = within(stalls, told.at_ns, told.at_ns + last_pulse_by * 1_000_000);
    let less = |cycles: u64| cycles.saturating_sub(stalled_ns.div_ceil(1_000_000));
    if let Some(row) = ramp {
        outcome.reaction = Some((less(cycles(row)), told.fault.ramp_by));
    }
    if let Some(row) = first.iter().rfind(|row| way(row) != 0) {
        outcome.standstill = Some((less(cycles(row)), last_pulse_by));
    }
    if let Some(row) = later.iter().find(|row| way(row) != 0 || row.status & MASK == ENABLED) {
        violations.push(format!("motion or current after a pause of the clock: {row:?}"));
    }
    let left = first.iter().position(|row| row.status & MASK != ENABLED).unwrap_or(first.len());
    if let Some(row) = first.iter().skip(left).find(|row| row.status & MASK == ENABLED) {
        violations.push(format!("enabled again by itself: {row:?}"));
    }
}

/// What a stop that came too late is understood from: for each cycle its time since the fault, ms, its micro-steps, the drive's
/// status and control words, and whether its outputs were old; and the machine's stalls, ms.
fn cycles_in_words(at_ns: u64, own: &[SyncRow], stalls: &[Stall]) -> String {
    let ms = |ns: u64| (ns as f64 - at_ns as f64) / 1e6;
    let cycles = own.iter().take(SHOWN_CYCLES).map(|row| {
        let old = if row.fresh { "" } else { " old" };
        format!("{:.2} {} {:#x} {:#x}{old}", ms(row.host_ns), way(row), row.status, row.control)
    });
    let until_ns = own.iter().take(SHOWN_CYCLES).next_back().map_or(at_ns, |row| row.host_ns);
    let near = stalls.iter().filter(|stall| stall.within_ns(at_ns, until_ns) > 0);
    let near =
        near.map(|stall| format!("core {} {:.2} to {:.2}", stall.core, ms(stall.from_ns), ms(stall.to_ns)));
    format!(
        "; cycles: {}; stalls: {}",
        cycles.collect::<Vec<_>>().join(", "),
        near.collect::<Vec<_>>().join(", ")
    )
}

/// How many rows there are before the clock pauses. Without SYNC0 there are no pulses: the drive's power is off, or its clock was
/// stopped for a bring-up.
fn until_a_pause(before: Option<&SyncRow>, own: &[SyncRow]) -> usize {
    let last_ns = before.into_iter().chain(own).map(|row| row.host_ns);
    last_ns.zip(own).take_while(|(last_ns, row)| row.host_ns - last_ns < PAUSE_NS).count()
}
