//! One run: texts to a wired loop, the loop to a row.

use crate::base::{Base, Source};
use crate::diagnose::diagnosed;
use crate::plan::Campaign;
use crate::recorded::Recorded;
use crate::row::{Failure, MotionMetrics, Row, Stage};
use closed_loop::{InProcess, Metrics, Parts, wire, wire_like};
use config::{Scenario, Target, check_against_models, parse_model, parse_scenario};
use std::any::Any;
use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use valve_model::Model;

/// So often a run looks whether it is to be given up: every few milliseconds.
const CYCLES_BETWEEN_LOOKS: u64 = 4096;

/// What a run is simulated and diagnosed with.
struct Ready<'c> {
    scenario: Cow<'c, Scenario>,
    belief: Cow<'c, Model>,
    parts: Parts,
}

impl Campaign {
    /// Makes a run. Whatever becomes of it is a row; `None` where `is_over` said in its middle that it is to be given up.
    pub fn run(&self, run: u64, is_over: &(dyn Fn() -> bool + Sync)) -> Option<Row> {
        guarded(run, || self.attempt(run, is_over))
    }

    fn attempt(&self, run: u64, is_over: &(dyn Fn() -> bool + Sync)) -> Option<Row> {
        let task = self.plan.task;
        let mut row = Row { run, motion: None, diagnosed: None, failure: None };
        let ready = match self.ready(run) {
            Ok(ready) => ready,
            Err(reason) => {
                row.failure = Some(Failure::new(Stage::Simulation, &reason));
                return Some(row);
            }
        };
        let mut metrics = Metrics::default();
        let mut recorded = task.diagnoses().then(|| Recorded::new(ready.scenario.period_ns));
        let mut cycles = InProcess::new(&ready.parts);
        // `cycles.cycle()` would be the iterator's.
        while let Some(outputs) = InProcess::cycle(&mut cycles) {
            metrics.note_cycle(&outputs);
            if let Some(recorded) = &mut recorded {
                recorded.note(&outputs);
            }
            if outputs.cycle.is_multiple_of(CYCLES_BETWEEN_LOOKS) && is_over() {
                return None;
            }
        }
        row.motion = task.measures().then(|| MotionMetrics::new(&metrics));
        if let Some(recorded) = recorded {
            let found = diagnosed(recorded.into_log(), &ready.belief, is_over);
            if is_over() {
                return None;
            }
            match found {
                Ok(diagnosed) => row.diagnosed = Some(diagnosed),
                Err(error) => row.failure = Some(Failure::new(Stage::Diagnosis, &error.to_string())),
            }
        }
        Some(row)
    }

    /// The loop of a run. What is not varied was read with the plan.
    fn ready(&self, run: u64) -> Result<Ready<'_>, String> {
        let texts = self.texts(run).ok_or("no such run")?;
        let base = self.base(run).ok_or("no such run")?;
        let model = |target: Target, own: fn(&Base) -> &Model| {
            if !self.varies(target) {
                return Ok(Cow::Borrowed(own(base)));
            }
            let source = texts.of(target);
            parse_model(&source.text, &source.file).map(Cow::Owned)
        };
        let truth = model(Target::Truth, |base| &base.truth).map_err(|errors| errors.to_string())?;
        let belief = model(Target::Belief, |base| &base.belief).map_err(|errors| errors.to_string())?;
        let Source { file, text } = &texts.scenario;
        let scenario = if self.varies(Target::Scenario) {
            Cow::Owned(parse_scenario(text, file).map_err(|errors| errors.to_string())?)
        } else {
            Cow::Borrowed(&base.scenario)
        };
        check_against_models(&scenario, &truth, &belief, text, file).map_err(|errors| errors.to_string())?;
        let is_same_controller = !self.varies(Target::Scenario) && !self.varies(Target::Belief);
        let parts = if is_same_controller {
            wire_like(&base.parts, &scenario, &truth, &belief)
        } else {
            wire(&scenario, &truth, &belief)
        };
        let parts = parts.map_err(|error| error.to_string())?;
        Ok(Ready { scenario, belief, parts })
    }
}

/// A row of what panics, too.
fn guarded(run: u64, attempt: impl FnOnce() -> Option<Row>) -> Option<Row> {
    // What a panic leaves behind is dropped with the attempt: nothing of it is used again.
    catch_unwind(AssertUnwindSafe(attempt)).unwrap_or_else(|panic| {
        let failure = Some(Failure::new(Stage::Panic, &said(panic.as_ref())));
        Some(Row { run, motion: None, diagnosed: None, failure })
    })
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason given".to_owned())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_row() {
        let row = guarded(7, || panic!("a fault\nof {}", "ours")).unwrap();
        assert_eq!(row.run, 7);
        let failure = row.failure.unwrap();
        assert_eq!((failure.stage, failure.reason.as_str()), (Stage::Panic, "a fault of ours"));
        assert!(guarded(7, || None).is_none());
    }
}
