//! The log that the instruments leave behind.

use super::Draft;
use super::instruments::{lose, noise, normal, read, transduced};
use super::world::Presence;
use crate::log_kind::LogKind;
use crate::plan::RunPlan;
use crate::spool::Outputs;
use log_data::{AngleZero, Log, Run};
use rand::RngExt;
use rand_pcg::Pcg64;

/// All runs as recorded.
pub(super) fn log(draft: &Draft, seed: u64, outputs: &[Outputs], quiet: bool, rng: &mut Pcg64) -> Log {
    let world = &draft.world;
    // The torque channel's scale is known half as badly as the model's numbers.
    let scale = 1.0 + 0.5 * world.off_by * rng.random_range(-1.0..1.0);
    let told = rng.random_bool(0.5);
    let mut runs: Vec<Run> = Vec::new();
    for (index, (plan, outputs)) in draft.runs.iter().zip(outputs).enumerate() {
        let mut run = run(draft, plan, outputs, scale, quiet, rng);
        run.kind.clone_from(&draft.labels[index]);
        let there = |presence: Presence| match presence {
            Presence::All => true,
            Presence::Some => index % 3 != 0,
            Presence::None => false,
        };
        run.pressure_drop_pa = run.pressure_drop_pa.filter(|_| there(world.pressure));
        run.oil_temperature_c = run.oil_temperature_c.filter(|_| there(world.temperature));
        runs.push(run);
    }
    let own_zeros = draft.kind == LogKind::Angle && world.zero > 0.0 && told;
    Log {
        title: format!("Rig campaign {seed} of the real family"),
        provenance: Some("hidden-effect-rig".to_owned()),
        angle_zero: if own_zeros { AngleZero::PerRun } else { AngleZero::Common },
        runs,
        ..Log::default()
    }
}

fn run(draft: &Draft, plan: &RunPlan, outputs: &Outputs, scale: f64, quiet: bool, rng: &mut Pcg64) -> Run {
    let world = &draft.world;
    let clock = |time: &f64| plan.clock_s + time;
    let zero = world.zero * normal(rng);
    let mut disturbed = noise(world, &plan.times_s, rng);
    if quiet {
        disturbed.fill(0.0);
    }
    let zeros = plan.times_s.iter().map(|time| zero + world.drift_per_s * clock(time));
    let added: Vec<f64> = disturbed.iter().zip(zeros).map(|(noise, zero)| noise + zero).collect();
    let is_torque = draft.kind == LogKind::Torque;
    let mut angle_rad: Vec<f64> = outputs
        .angle_rad
        .iter()
        .zip(&added)
        .map(|(angle, added)| read(&world.encoder, if is_torque { *angle } else { angle + added }, rng))
        .collect();
    let mut torque_nm = is_torque.then(|| {
        let passed = transduced(&plan.times_s, &outputs.torque_nm, world.bandwidth_hz);
        passed.iter().zip(&added).map(|(torque, added)| scale * torque + added).collect::<Vec<f64>>()
    });
    let along = |value: &dyn Fn(f64) -> f64| plan.times_s.iter().map(|time| value(*time)).collect();
    let mut pressure_drop_pa: Vec<f64> = along(&|time| 1e6 * plan.pressure_mpa.at(time));
    if world.missing > 0.0 {
        match &mut torque_nm {
            Some(torque) => lose(torque, world.missing, rng),
            None => lose(&mut angle_rad, world.missing, rng),
        }
        lose(&mut pressure_drop_pa, 0.3 * world.missing, rng);
    }
    Run {
        name: plan.name.clone(),
        time_s: plan.times_s.iter().map(clock).collect(),
        angle_rad,
        angle_command_rad: (!is_torque)
            .then(|| (0..plan.times_s.len()).map(|index| plan.command_rad(index)).collect()),
        torque_nm,
        pressure_drop_pa: Some(pressure_drop_pa),
        oil_temperature_c: Some(along(&|time| plan.celsius.at(time))),
        ..Run::default()
    }
}
