//! What address spaces of their own cost: cyclictest's threads in one process, and in a process each as the loop has them.

use super::cyclictest;
use super::measure::{CORE, PRIORITY};
use crate::output::{Sheet, us};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::Result;
use serde_json::{Value, json};

/// Both ways at one period, the threads of all turns together.
pub struct Apart {
    period_ns: u64,
    one_process: Times,
    a_process_each: Times,
}

impl Apart {
    /// Takes turns: one process, a process each, one process, ...
    ///
    /// # Errors
    /// Where cyclictest fails.
    pub fn take(place: &Workplace, variant: &Variant, turns: usize, progress: &Progress) -> Result<Self> {
        let (mut one_process, mut a_process_each) = (Times::new()?, Times::new()?);
        for turn in 1..=turns {
            progress.next(format!("cyclictest, one process and several, turn {turn}"));
            let threads = cyclictest::run(place, variant, CORE, PRIORITY)?;
            threads.iter().for_each(|times| one_process.add_times(times));
            let threads = cyclictest::run_apart(place, variant, CORE, PRIORITY)?;
            threads.iter().for_each(|times| a_process_each.add_times(times));
        }
        Ok(Self { period_ns: variant.period_ns, one_process, a_process_each })
    }

    fn ratio(&self, part: f64) -> f64 {
        self.a_process_each.quantile_ns(part) as f64 / self.one_process.quantile_ns(part).max(1) as f64
    }
}

/// The table.
pub fn sheet(all: &[Apart]) -> Sheet {
    let title = "cyclictest's wake-up latency, µs, idle: its threads in one process, and in a process each, as the loop's are; \
                 in turns, without the loop";
    let header = ["period", "one process p50", "p99", "a process each p50", "p99", "ratio p50", "ratio p99"];
    let mut sheet = Sheet::new("jitter-address-spaces", title, &header);
    for apart in all {
        let mut row = vec![format!("{} µs", apart.period_ns / 1000)];
        for times in [&apart.one_process, &apart.a_process_each] {
            row.extend([0.5, 0.99].map(|part| us(times.quantile_ns(part))));
        }
        row.extend([0.5, 0.99].map(|part| format!("{:.2}", apart.ratio(part))));
        sheet.row(row);
    }
    sheet
}

/// For machines.
pub fn data(all: &[Apart]) -> Value {
    let one = |apart: &Apart| {
        json!({
            "period_ns": apart.period_ns, "one_process": apart.one_process.json(),
            "a_process_each": apart.a_process_each.json(),
        })
    };
    all.iter().map(one).collect()
}
