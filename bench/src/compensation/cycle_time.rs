//! How long a control cycle takes.

use super::cases::Case;
use anyhow::Result;
use closed_loop::{InProcess, Level, wire};
use config::Damping;
use std::time::Instant;
use step_control::{Input, State, step};

/// Cycles timed.
const CYCLES: usize = 1_000_000;

/// Times of a control cycle, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleTime {
    /// Half of the cycles are shorter.
    pub median_s: f64,
    /// One in a thousand is longer.
    pub longest_but_one_in_a_thousand_s: f64,
    /// The longest of a million.
    pub worst_s: f64,
}

/// Times a million cycles of the controller on a case's recorded messages, one by one.
///
/// # Errors
/// A case that can't be wired.
pub fn cycle_time(case: &Case, level: Level) -> Result<CycleTime> {
    let mut scenario = case.scenario.clone();
    scenario.compensation = level.feed_forward;
    scenario.encoder.fitted = level.encoder;
    scenario.control.observer = level.encoder;
    scenario.control.damping = if level.encoder { Damping::Active } else { Damping::None };
    let parts = wire(&scenario, &case.truth, &case.truth)?;
    let messages: Vec<_> =
        InProcess::new(&parts).map(|cycle| (cycle.plant.feedback, cycle.reference)).collect();
    let mut times_ns: Vec<u64> = Vec::with_capacity(CYCLES + messages.len());
    while times_ns.len() < CYCLES {
        let mut state = State::new(parts.controller.initial_microsteps);
        for (cycle, (feedback, reference)) in (0..).zip(&messages) {
            let input = Input { feedback: Some(feedback), reference: Some(reference), order: None };
            let begun = Instant::now();
            let output = step(&parts.controller.params, &mut state, cycle, &input);
            times_ns.push(begun.elapsed().as_nanos() as u64);
            std::hint::black_box(output);
        }
    }
    times_ns.sort_unstable();
    let at = |part: f64| {
        let index = ((times_ns.len() - 1) as f64 * part) as usize;
        times_ns.get(index).copied().unwrap_or_default() as f64 / 1e9
    };
    Ok(CycleTime { median_s: at(0.5), longest_but_one_in_a_thousand_s: at(0.999), worst_s: at(1.0) })
}
