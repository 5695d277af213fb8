//! All runs of an experiment through a valve, without noise.

use crate::log_kind::LogKind;
use crate::plan::RunPlan;
use crate::spool::{Outputs, Valve};
use std::f64::consts::FRAC_PI_2;

/// Each run's outputs; `None` where the rotor falls out of step.
pub(crate) fn measure(kind: LogKind, runs: &[RunPlan], valve: &Valve) -> Option<Vec<Outputs>> {
    let mut memory = valve.at_rest(runs[0].motion.at(0.0).value, kind == LogKind::Torque);
    let mut all = Vec::with_capacity(runs.len());
    for run in runs {
        let outputs = match kind {
            LogKind::Torque => valve.drive(run, &mut memory),
            LogKind::Angle => valve.follow(run, &mut memory),
        };
        if outputs.most_lag_rad > 0.95 * FRAC_PI_2 {
            return None;
        }
        all.push(outputs);
    }
    Some(all)
}

/// The channel that a log of this kind is about.
pub(crate) fn channel(kind: LogKind, outputs: &Outputs) -> &[f64] {
    match kind {
        LogKind::Torque => &outputs.torque_nm,
        LogKind::Angle => &outputs.angle_rad,
    }
}
