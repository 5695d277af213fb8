//! How a process kept its cycles, in histograms of fixed size that the loop fills without heap.

use crate::cyclic_timer::Wake;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// The longest time that the histograms tell apart, in ns: 100 s.
const LONGEST_NS: u64 = 100_000_000_000;

/// Counts and histograms of one process.
#[derive(Debug)]
pub struct LoopStats {
    wake_up: Times,
    execution: Times,
    period_ns: u64,
    cycles: u64,
    overruns: u64,
    skipped_cycles: u64,
}

/// A histogram, and its largest time exactly: the record and the page tell that one too.
#[derive(Debug)]
struct Times {
    histogram: Histogram<u64>,
    max_ns: u64,
}

/// Percentiles of a time, in ns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50_ns: u64,
    /// 99 of 100 are at most this.
    pub p99_ns: u64,
    /// 999 of 1000 are at most this.
    pub p999_ns: u64,
    /// The largest.
    pub max_ns: u64,
}

/// What a process kept, at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoopSummary {
    /// Cycles run.
    pub cycles: u64,
    /// Cycles whose work ran past the process's next deadline.
    pub overruns: u64,
    /// Whole cycles passed over because they were already past.
    pub skipped_cycles: u64,
    /// Wake-up after the deadline that the process slept for.
    pub wake_up: Percentiles,
    /// From wake-up to the end of the work.
    pub execution: Percentiles,
    /// The wake-up histogram: upper edge of each bin that is not empty, in ns, and its count.
    pub wake_up_bins: Vec<(u64, u64)>,
    /// The execution-time histogram, alike.
    pub execution_bins: Vec<(u64, u64)>,
}

impl LoopStats {
    /// Empty counts for a loop of this period. Allocates all that it will ever use.
    ///
    /// # Errors
    /// Never with the constants here; the histogram checks them.
    pub fn new(period_ns: u64) -> Result<Self, hdrhistogram::CreationError> {
        Ok(Self {
            wake_up: Times::new()?,
            execution: Times::new()?,
            period_ns,
            cycles: 0,
            overruns: 0,
            skipped_cycles: 0,
        })
    }

    /// Notes a wake-up: before the cycle's LoopTiming goes out, so that it already counts what was skipped.
    pub fn woke(&mut self, wake: &Wake) {
        self.cycles += 1;
        self.skipped_cycles += wake.skipped;
        self.wake_up.record(wake.latency_ns());
    }

    /// Notes the end of a cycle's work at `finished_ns` on CLOCK_MONOTONIC.
    pub fn finished(&mut self, wake: &Wake, finished_ns: u64) {
        self.execution.record(finished_ns.saturating_sub(wake.woke_ns));
        if finished_ns > wake.deadline_ns + self.period_ns {
            self.overruns += 1;
        }
    }

    /// Cycles whose work ran past the next deadline.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Whole cycles passed over.
    pub fn skipped_cycles(&self) -> u64 {
        self.skipped_cycles
    }

    /// All of it, for people.
    pub fn summary(&self) -> LoopSummary {
        LoopSummary {
            cycles: self.cycles,
            overruns: self.overruns,
            skipped_cycles: self.skipped_cycles,
            wake_up: self.wake_up.percentiles(),
            execution: self.execution.percentiles(),
            wake_up_bins: self.wake_up.bins(),
            execution_bins: self.execution.bins(),
        }
    }
}

impl Times {
    fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(Self { histogram: Histogram::new_with_bounds(1, LONGEST_NS, 2)?, max_ns: 0 })
    }

    fn record(&mut self, time_ns: u64) {
        self.histogram.saturating_record(time_ns);
        self.max_ns = self.max_ns.max(time_ns);
    }

    fn percentiles(&self) -> Percentiles {
        Percentiles {
            p50_ns: self.histogram.value_at_quantile(0.5),
            p99_ns: self.histogram.value_at_quantile(0.99),
            p999_ns: self.histogram.value_at_quantile(0.999),
            max_ns: self.max_ns,
        }
    }

    fn bins(&self) -> Vec<(u64, u64)> {
        self.histogram.iter_recorded().map(|bin| (bin.value_iterated_to(), bin.count_at_value())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overruns_and_skipped_cycles_are_counted() {
        let mut stats = LoopStats::new(1_000_000).unwrap();
        let on_time = Wake {
            cycle: 0,
            deadline_ns: 10_000_000,
            awaited_ns: 10_000_000,
            woke_ns: 10_005_000,
            skipped: 0,
        };
        stats.woke(&on_time);
        stats.finished(&on_time, 10_020_000);
        let late = Wake {
            cycle: 4,
            deadline_ns: 14_000_000,
            awaited_ns: 11_000_000,
            woke_ns: 14_900_000,
            skipped: 3,
        };
        stats.woke(&late);
        stats.finished(&late, 15_000_001);
        let summary = stats.summary();
        assert_eq!((summary.cycles, summary.overruns, summary.skipped_cycles), (2, 1, 3));
        assert_eq!(summary.wake_up.max_ns, 3_900_000);
        assert!(summary.execution.p50_ns.abs_diff(15_000) < 150, "{summary:?}");
        assert_eq!(summary.wake_up_bins.iter().map(|bin| bin.1).sum::<u64>(), 2);
    }
}
