//! All runs of all cases, on all cores.

use super::cases::{Case, factor_of_two, thirty_percent, wrong_shaft};
use anyhow::{Context, Result};
use closed_loop::{Level, Outcome, measure};
use config::Compensation;
use indicatif::{ProgressBar, ProgressStyle};
use log_data::median;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use valve_model::Model;

/// The levels measured with the right belief.
pub const LEVELS: [(&str, Level); 5] = [
    ("Coulomb + viscous", Level { feed_forward: Compensation::CoulombViscous, encoder: false }),
    ("full law", Level::FULL),
    ("full law, effects", Level { feed_forward: Compensation::FullWithEffects, encoder: false }),
    ("observer alone", Level { feed_forward: Compensation::None, encoder: true }),
    ("full law, observer", Level::OBSERVED),
];

/// How much better than without compensation, over a set of wrong beliefs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The least ratio of RMS errors.
    pub worst: f64,
    /// The median.
    pub median: f64,
    /// Runs that ended in a fault.
    pub faults: usize,
    /// Runs.
    pub runs: usize,
}

/// What a case came to.
#[derive(Debug, Clone)]
pub struct Findings {
    /// Without compensation.
    pub none: Outcome,
    /// With the right belief, in the order of [`LEVELS`].
    pub right: Vec<Outcome>,
    /// ±30 % and ±50 %, without and with an encoder.
    pub thirty_percent: [Spread; 2],
    /// A factor of two, without and with an encoder.
    pub factor_of_two: [Spread; 2],
    /// Inertia or holding torque 30 % off, with an encoder.
    pub wrong_shaft: Spread,
}

/// Runs every case; the result does not depend on the number of cores.
///
/// # Errors
/// A case that can't be wired.
pub fn run_all(cases: &[Case]) -> Result<Vec<Findings>> {
    let bar = ProgressBar::new(cases.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} case {pos} of {len}, {elapsed}") {
        bar.set_style(style);
    }
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some((index, case)) = take(&next, cases) {
                    let findings = examine(case).with_context(|| case.name.clone());
                    if let Ok(mut done) = done.lock() {
                        done.push((index, findings));
                    }
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let mut done = done.into_inner().context("a thread failed")?;
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, findings)| findings).collect()
}

fn take<'a>(next: &AtomicUsize, cases: &'a [Case]) -> Option<(usize, &'a Case)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    cases.get(index).map(|case| (index, case))
}

fn examine(case: &Case) -> Result<Findings> {
    let outcome = |belief: &Model, level: Level| measure(&case.scenario, &case.truth, belief, level);
    let none = outcome(&case.truth, Level::NONE)?;
    let right = LEVELS.iter().map(|(_, level)| outcome(&case.truth, *level)).collect::<Result<_, _>>()?;
    let spread = |beliefs: &[Model], level: Level| -> Result<Spread> {
        let outcomes: Vec<Outcome> =
            beliefs.iter().map(|belief| outcome(belief, level)).collect::<Result<_, _>>()?;
        let mut ratios: Vec<f64> = outcomes.iter().map(|outcome| none.rms_rad / outcome.rms_rad).collect();
        Ok(Spread {
            worst: ratios.iter().copied().reduce(f64::min).unwrap_or(f64::NAN),
            median: median(&mut ratios).unwrap_or(f64::NAN),
            faults: outcomes.iter().filter(|outcome| outcome.fault.is_some()).count(),
            runs: outcomes.len(),
        })
    };
    let both = |beliefs: &[Model]| {
        Ok::<_, anyhow::Error>([spread(beliefs, Level::FULL)?, spread(beliefs, Level::OBSERVED)?])
    };
    let thirty_percent = both(&thirty_percent(&case.truth))?;
    let factor_of_two = both(&factor_of_two(&case.truth))?;
    let wrong_shaft = spread(&wrong_shaft(&case.truth), Level::OBSERVED)?;
    Ok(Findings { none, right, thirty_percent, factor_of_two, wrong_shaft })
}
