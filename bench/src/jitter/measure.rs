//! One load and one period: the loop and cyclictest in turns, a witness beside each.

use super::cyclictest;
use super::witness::{Seen, Witness};
use crate::programs::{LOOP, RunSummary, Workplace, scheduling};
use crate::progress::Progress;
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result};

/// The core and the highest priority of the shipped scenario's real-time processes.
pub const CORE: usize = 1;
pub const PRIORITY: u8 = 80;
/// Early by this part of the period.
pub const EARLY: u64 = 8;

/// One process of the loop over all turns.
pub struct Process {
    /// Wake-up after the deadline.
    pub wake_up: Times,
    /// From wake-up to the end of the work.
    pub execution: Times,
    /// Cycles run.
    pub cycles: u64,
    /// Cycles passed over, and cycles whose work ran past the next deadline.
    pub missed: u64,
    /// After warm-up: messages published, allocations, page faults.
    pub published: u64,
    pub allocations: u64,
    pub page_faults: u64,
}

/// What one load and one period gave.
pub struct Measured {
    /// The load's name.
    pub load: &'static str,
    /// Length of a cycle, ns.
    pub period_ns: u64,
    /// The loop's processes, in the order of their phases.
    pub ours: Vec<Process>,
    /// The same processes, awake a part of the period before their deadlines.
    pub early: Vec<Process>,
    /// cyclictest's threads by turn, in the order of their offsets; no turns where it is not installed.
    pub peer: Vec<Vec<Times>>,
    /// What the witness saw beside the loop, and beside cyclictest.
    pub beside_ours: Seen,
    pub beside_peer: Seen,
    /// The scheduling that the loop really had.
    pub scheduling: String,
}

impl Process {
    fn nothing() -> Result<Self> {
        let (wake_up, execution) = (Times::new()?, Times::new()?);
        Ok(Self { wake_up, execution, cycles: 0, missed: 0, published: 0, allocations: 0, page_faults: 0 })
    }

    /// The part of all cycles that was missed.
    pub fn missed_share(&self) -> f64 {
        self.missed as f64 / (self.cycles + self.missed).max(1) as f64
    }
}

impl Measured {
    /// Takes turns: the loop, cyclictest, the loop, ...
    ///
    /// # Errors
    /// Where a run fails.
    pub fn take(
        place: &Workplace,
        load: &'static str,
        variant: &Variant,
        turns: usize,
        progress: &Progress,
    ) -> Result<Self> {
        let scenario = place.path("jitter.toml");
        variant.write(&scenario)?;
        let early_scenario = place.path("early.toml");
        Variant { early_ns: variant.period_ns / EARLY, ..*variant }.write(&early_scenario)?;
        let period_us = variant.period_ns / 1000;
        let mut measured = Self {
            load,
            period_ns: variant.period_ns,
            ours: LOOP.iter().map(|_| Process::nothing()).collect::<Result<_>>()?,
            early: LOOP.iter().map(|_| Process::nothing()).collect::<Result<_>>()?,
            peer: Vec::new(),
            beside_ours: Seen::nothing()?,
            beside_peer: Seen::nothing()?,
            scheduling: String::new(),
        };
        for turn in 1..=turns {
            progress.next(format!("{load}, {period_us} µs, the loop, turn {turn}"));
            let witness = Witness::on(CORE);
            let summary = place.simulate(&scenario, "realtime", &[]);
            measured.beside_ours.add(&witness.end()?);
            let summary = summary?;
            measured.scheduling = scheduling(&summary);
            add(&mut measured.ours, &summary)?;
            progress.next(format!("{load}, {period_us} µs, cyclictest, turn {turn}"));
            if cyclictest::there() {
                let witness = Witness::on(CORE);
                let threads = cyclictest::run(place, variant, CORE, PRIORITY);
                measured.beside_peer.add(&witness.end()?);
                measured.peer.push(threads?);
            }
            progress.next(format!("{load}, {period_us} µs, the loop, early, turn {turn}"));
            add(&mut measured.early, &place.simulate(&early_scenario, "realtime", &[])?)?;
        }
        Ok(measured)
    }

    /// All turns of one of cyclictest's threads together; `None` where it is not installed.
    pub fn peer_thread(&self, index: usize) -> Option<Times> {
        let mut all = Times::new().ok()?;
        self.peer.iter().filter_map(|turn| turn.get(index)).for_each(|times| all.add_times(times));
        (all.count() > 0).then_some(all)
    }

    /// How far cyclictest's own turns lie apart at a quantile, largest over smallest.
    pub fn band(&self, index: usize, part: f64) -> Option<f64> {
        let turns = self.peer.iter().filter_map(|turn| turn.get(index));
        let values: Vec<_> = turns.map(|times| times.quantile_ns(part) as f64).collect();
        let largest = values.iter().copied().reduce(f64::max)?;
        let smallest = values.iter().copied().reduce(f64::min)?;
        Some(largest / smallest.max(1.0))
    }
}

/// Execution of the whole chain at a quantile: the sum of the three processes', ns.
pub fn chain_ns(processes: &[Process], part: f64) -> u64 {
    processes.iter().map(|process| process.execution.quantile_ns(part)).sum()
}

fn add(processes: &mut [Process], summary: &RunSummary) -> Result<()> {
    for (name, process) in LOOP.iter().zip(processes) {
        let counts = &summary.processes.get(*name).with_context(|| format!("{name} said nothing"))?.counts;
        process.wake_up.add_bins(counts.timing.wake_up_bins.iter().copied());
        process.execution.add_bins(counts.timing.execution_bins.iter().copied());
        process.cycles += counts.timing.cycles;
        process.missed += counts.timing.overruns + counts.timing.skipped_cycles;
        process.published += counts.steady_published;
        process.allocations += counts.steady_allocations;
        process.page_faults += counts.steady_page_faults.minor + counts.steady_page_faults.major;
    }
    Ok(())
}
