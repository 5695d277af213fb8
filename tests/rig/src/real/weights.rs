//! How well each sample of a measurement is known: what the answer key's "strong" and "weak" are counted in.
//!
//! The predicted channel's noise, and in a torque log what the encoder's counts and noise make of a torque: through the
//! bristles' slope at that sample, and through inertia times the acceleration's error when a parabola is laid through a window
//! of half the run's quickest change of speed (σ_a² = 720·σ²·Δt/w⁵).

use super::world::World;
use crate::log_kind::LogKind;
use crate::plan::RunPlan;
use crate::spool::Outputs;

/// 1/σ² of every sample, run by run.
pub(super) fn of(
    world: &World,
    kind: LogKind,
    load_kg_m2: f64,
    runs: &[RunPlan],
    plain: &[Outputs],
) -> Vec<Vec<f64>> {
    let encoder = world.encoder.deviation_rad();
    let one = |(run, outputs): (&RunPlan, &Outputs)| match kind {
        LogKind::Angle => vec![1.0 / (world.noise.powi(2) + encoder.powi(2)); run.times_s.len()],
        LogKind::Torque => {
            let step_s = 1.0 / world.rate_hz;
            let window_s = (0.5 * run.motion.quickest_s()).max(5.0 * step_s);
            let acceleration = encoder * (720.0 * step_s / window_s.powi(5)).sqrt();
            let inertia = (load_kg_m2 * acceleration).powi(2);
            let known = |slope: &f64| 1.0 / (world.noise.powi(2) + (slope * encoder).powi(2) + inertia);
            outputs.slope_nm_per_rad.iter().map(known).collect()
        }
    };
    runs.iter().zip(plain).map(one).collect()
}
