//! A contact along sampled angles: how well it follows a spool that sets out within a sample.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use valve_model::{
    FrictionParams, LuGreParams, MotionInput, MotionOutput, MotionParams, MotionSample, MotionState,
    measured_motion_step, motion_step,
};

/// The step that counts as exact, and so many of it from sample to sample.
const FINE_S: f64 = 1e-5;
const EVERY: usize = 500;
/// rad/s².
const ACCELERATES: f64 = 60.0;
const ENDS_S: f64 = 0.5;

type Step = fn(&MotionParams, &mut MotionState, &MotionInput, f64) -> MotionOutput;

/// Along angles without an error.
fn by_angles(params: &MotionParams, state: &mut MotionState, input: &MotionInput, dt_s: f64) -> MotionOutput {
    measured_motion_step(params, state, (input, 0.0), dt_s)
}

/// Rest, then strokes there, back and further back at constant accelerations, from `sets_out_s` on: sets out, turns round and stops.
fn angle_rad(time_s: f64, sets_out_s: f64) -> f64 {
    let part = |time_s: f64| {
        let (quarter_s, stroke_s) = (0.02, 0.08);
        let speed = ACCELERATES * quarter_s;
        match time_s {
            t if t <= 0.0 => 0.0,
            t if t <= quarter_s => 0.5 * ACCELERATES * t * t,
            t if t <= stroke_s - quarter_s => 0.5 * speed * quarter_s + speed * (t - quarter_s),
            t if t <= stroke_s => {
                let left_s = stroke_s - t;
                speed * (stroke_s - quarter_s) - 0.5 * ACCELERATES * left_s * left_s
            }
            _ => speed * (stroke_s - quarter_s),
        }
    };
    part(time_s - sets_out_s) - part(time_s - sets_out_s - 0.1) - part(time_s - sets_out_s - 0.25)
}

/// The torque every [`EVERY`] fine steps, from angles sampled every `step_s`; speeds and accelerations are differences of them.
fn torques(params: &MotionParams, step: Step, step_s: f64, sets_out_s: f64) -> Vec<f64> {
    let count = (ENDS_S / step_s).round() as usize;
    let at = |index: f64| angle_rad(index * step_s, sets_out_s);
    let motion = |index: usize| {
        let (before, now, after) = (at(index as f64 - 1.0), at(index as f64), at(index as f64 + 1.0));
        MotionSample {
            angle_rad: now,
            speed_rad_per_s: (after - before) / (2.0 * step_s),
            acceleration_rad_per_s2: (after - 2.0 * now + before) / (step_s * step_s),
        }
    };
    let mut state = params.at_start(&motion(0));
    let every = (EVERY as f64 * FINE_S / step_s).round() as usize;
    (0..count)
        .filter_map(|index| {
            let (start, end) = (motion(index), motion(index + 1));
            let input = MotionInput { start, end, pressure_drop_pa: 0.0, oil_temperature_c: 40.0 };
            let out = step(params, &mut state, &input, step_s);
            ((index + 1) % every == 0).then_some(out.friction_torque_nm)
        })
        .collect()
}

/// Root mean square of what samples 5 ms apart get wrong, over all moments within a sample at which the spool sets out.
fn error_nm(params: &MotionParams, step: Step) -> f64 {
    let mut square = Vec::new();
    for phase in 0..10 {
        let sets_out_s = 0.05 + 5e-4 * f64::from(phase);
        let fine = torques(params, motion_step, FINE_S, sets_out_s);
        let coarse = torques(params, step, EVERY as f64 * FINE_S, sets_out_s);
        assert_eq!(fine.len(), coarse.len());
        square.extend(fine.iter().zip(&coarse).map(|(fine, coarse)| (fine - coarse).powi(2)));
    }
    (square.iter().sum::<f64>() / square.len() as f64).sqrt()
}

fn params(law: LuGreParams) -> MotionParams {
    MotionParams::new(&common::model(FrictionParams::LuGre(law))).unwrap()
}

#[test]
fn a_spool_that_sets_out_between_samples_moves_no_sample_early() {
    for stiffness in [300.0, 1000.0, 3000.0] {
        let law = LuGreParams { bristle_stiffness_nm_per_rad: stiffness, ..LuGreParams::BENCH_RIG };
        let params = params(law);
        let (angles, speeds) = (error_nm(&params, by_angles), error_nm(&params, motion_step));
        println!("{stiffness} N·m/rad: {angles:.4} N·m by the angles, {speeds:.4} by the speeds alone");
        assert!(angles < 0.6 * speeds, "{stiffness}: {angles} against {speeds}");
    }
}

#[test]
fn a_motion_whose_speeds_add_up_to_its_angles_is_the_same_either_way() {
    let params = params(LuGreParams::BENCH_RIG);
    let motion = |time_s: f64| MotionSample {
        angle_rad: 2.0 * time_s * time_s,
        speed_rad_per_s: 4.0 * time_s,
        acceleration_rad_per_s2: 4.0,
    };
    let mut states = [params.at_start(&motion(0.0)); 2];
    for index in 0..200 {
        let (start, end) = (motion(1e-3 * f64::from(index)), motion(1e-3 * f64::from(index + 1)));
        let input = MotionInput { start, end, pressure_drop_pa: 0.0, oil_temperature_c: 40.0 };
        let one = motion_step(&params, &mut states[0], &input, 1e-3);
        let other = by_angles(&params, &mut states[1], &input, 1e-3);
        assert_eq!(one, other);
    }
}

#[test]
fn what_may_be_noise_is_not_followed() {
    let params = params(LuGreParams::BENCH_RIG);
    let at = |angle_rad: f64| MotionSample { angle_rad, speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0 };
    for (deviation_rad, follows) in [(0.0, true), (1e-4, true), (4e-4, false)] {
        let mut state = params.at_start(&at(0.0));
        let input =
            MotionInput { start: at(0.0), end: at(1e-3), pressure_drop_pa: 0.0, oil_temperature_c: 40.0 };
        let out = measured_motion_step(&params, &mut state, (&input, deviation_rad), 1e-3);
        assert_eq!(out.friction_torque_nm > 0.1, follows, "an error of {deviation_rad} rad: {out:?}");
    }
}
