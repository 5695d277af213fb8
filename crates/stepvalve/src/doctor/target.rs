//! The loop that the machine is judged for: its period, cores, priority, and how late a process may be.

use crate::loaded;
use anyhow::anyhow;
use config::{Dimension, TaskTiming, parse_quantity};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use supervisor::Failure;

/// Period, ns, where neither the option nor a scenario gives one.
const DEFAULT_PERIOD_NS: u64 = 1_000_000;
/// The shipped scenarios' core, highest priority, and phases in hundredths of the period.
const DEFAULT_CORE: usize = 1;
const DEFAULT_PRIORITY: u8 = 80;
const DEFAULT_PHASES_PERCENT: [u64; 3] = [0, 15, 40];
/// A machine's own limit of silence.
const DEFAULT_SILENCE_CYCLES: u64 = 3;
/// What a process's own work may take of its part of the cycle, ns; `bench jitter` shows what it really takes.
const WORK_NS: u64 = 10_000;
/// What a scenario's period may be, ns.
const PERIODS_NS: std::ops::RangeInclusive<u64> = 100_000..=10_000_000;

/// The loop.
#[derive(Debug, Clone, Serialize)]
pub struct Target {
    /// Length of a cycle, ns.
    pub period_ns: u64,
    /// Cores of the processes with deadlines.
    pub cores: BTreeSet<usize>,
    /// The highest SCHED_FIFO priority asked for; `None`: the normal scheduler.
    pub priority: Option<u8>,
    /// A wake-up later than this makes a process miss the next one's time, ns.
    pub tolerated_ns: u64,
    /// The controller or its partners may be silent for so long, ns; beyond, the valve is stopped.
    pub silence_ns: u64,
}

impl Target {
    /// The loop of a scenario, or that of the shipped ones; `period` overrides.
    ///
    /// # Errors
    /// [`Failure::Input`] for a scenario or a period that is no good.
    pub fn new(scenario: Option<&Path>, period: Option<&str>, core: Option<usize>) -> Result<Self, Failure> {
        let period_ns = period.map(read_period_ns).transpose()?;
        let mut target = match scenario {
            Some(path) => Self::of_scenario(path, period_ns)?,
            None => Self::default_loop(period_ns.unwrap_or(DEFAULT_PERIOD_NS)),
        };
        if let Some(core) = core {
            target.cores = BTreeSet::from([core]);
        }
        Ok(target)
    }

    fn default_loop(period_ns: u64) -> Self {
        let phases_ns = DEFAULT_PHASES_PERCENT.map(|percent| period_ns * percent / 100);
        Self {
            period_ns,
            cores: BTreeSet::from([DEFAULT_CORE]),
            priority: Some(DEFAULT_PRIORITY),
            tolerated_ns: tolerated_ns(period_ns, phases_ns),
            silence_ns: DEFAULT_SILENCE_CYCLES * period_ns,
        }
    }

    fn of_scenario(path: &Path, period_ns: Option<u64>) -> Result<Self, Failure> {
        let scenario = loaded::load(path)?.scenario;
        let timing = &scenario.timing;
        let tasks: [TaskTiming; 3] = [timing.plant, timing.trajectory, timing.controller];
        // With another period the phases keep their parts of it.
        let period = period_ns.unwrap_or(scenario.period_ns);
        let phases_ns = tasks.map(|task| {
            u64::try_from(u128::from(task.phase_ns) * u128::from(period) / u128::from(scenario.period_ns))
                .unwrap_or(0)
        });
        Ok(Self {
            period_ns: period,
            cores: tasks.iter().filter_map(|task| task.core).collect(),
            priority: tasks.iter().filter_map(|task| task.priority).max(),
            tolerated_ns: tolerated_ns(period, phases_ns),
            silence_ns: scenario.safety.silence_cycles * period,
        })
    }

    /// The core to measure on.
    pub fn core(&self) -> Option<usize> {
        self.cores.first().copied()
    }
}

/// The smallest step from one process's phase to the next one's, less what the work takes.
fn tolerated_ns(period_ns: u64, phases_ns: [u64; 3]) -> u64 {
    let [plant, trajectory, controller] = phases_ns;
    let steps = [trajectory.saturating_sub(plant), controller.saturating_sub(trajectory)];
    let to_the_next_cycle = (period_ns + plant).saturating_sub(controller);
    steps.into_iter().fold(to_the_next_cycle, u64::min).saturating_sub(WORK_NS)
}

fn read_period_ns(text: &str) -> Result<u64, Failure> {
    let seconds = parse_quantity(text, Dimension::Time)
        .map_err(|error| Failure::Input(anyhow!("--period {text}: {error}")))?;
    let period_ns = (seconds * 1e9).round();
    if !PERIODS_NS.contains(&(period_ns as u64)) {
        return Err(Failure::Input(anyhow!("--period: found {text}, expected a time from 100us to 10ms")));
    }
    Ok(period_ns as u64)
}
