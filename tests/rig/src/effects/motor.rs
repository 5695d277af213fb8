//! What the motor and its drive train do.

use super::{Applied, Instance, applied, series};
use crate::forms::Wave;
use crate::plan::RunPlan;
use crate::spool::Valve;
use serde_json::json;
use std::f64::consts::TAU;

impl Instance {
    pub(super) fn detent_torque(&self, valve: &mut Valve) -> Applied {
        let n = valve.contact.nominal;
        let size = self.amount * self.between(0, 0.02, 0.06) * n.holding_nm;
        let wave = Wave::Sines(vec![(1.0, size, TAU * self.draws[1])]);
        let parameters = series(&wave);
        valve.detent = Some(wave);
        applied(parameters, true)
    }

    pub(super) fn microstep_error(&self, valve: &mut Valve) -> Applied {
        let size = self.amount * self.between(0, 1e-4, 4e-4);
        let order = 1.0 + (4.0 * self.draws[3]).floor();
        let wave = Wave::Sines(vec![
            (order, size, TAU * self.draws[1]),
            (order + 1.0, 0.5 * size, TAU * self.draws[2]),
        ]);
        let parameters = series(&wave);
        valve.microstep = Some(wave);
        applied(parameters, true)
    }

    pub(super) fn backlash(&self, valve: &mut Valve) -> Applied {
        valve.backlash_rad = self.amount * self.between(0, 5e-4, 2e-3);
        applied(json!({ "half_width_rad": valve.backlash_rad }), true)
    }

    pub(super) fn missed_steps(&self, valve: &mut Valve, runs: &[RunPlan]) -> Applied {
        // In the middle of a run's motion, past the middle of the log.
        let mut moving: Vec<&RunPlan> = runs.iter().filter(|run| run.kind == "constant-speed").collect();
        if moving.is_empty() {
            moving = runs.iter().collect();
        }
        let run = moving[(self.draws[0] * moving.len() as f64) as usize];
        let at_s = run.times_s[0] + self.between(1, 0.3, 0.6) * (run.end_s() - run.times_s[0]);
        let teeth = self.sign * if self.draws[2] < 0.7 { 1.0 } else { 2.0 };
        valve.missed = vec![(run.clock_s + at_s, teeth)];
        applied(json!({ "run": run.name, "time_s": at_s - run.times_s[0], "teeth": teeth }), false)
    }
}
