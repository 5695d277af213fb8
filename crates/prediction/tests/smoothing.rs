//! What an encoder's steps do to a predicted torque: at rest, in slow loops, in fast motion. The noise-free torque of the
//! exact motion is the truth; 0.02 N·m is the noise of a usual torque transducer.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::Run;
use prediction::{Noise, Past, Smoother, motion_at, predict};
use rand::prelude::*;
use rand_distr::Normal;
use std::f64::consts::TAU;
use valve_model::{Model, MotionInput, MotionParams, MotionSample, motion_step};

const STEP_RAD: f64 = TAU / 131_072.0;
const TRANSDUCER_NM: f64 = 0.02;

fn rig() -> Model {
    Model { motor: None, ..Model::bench_rig() }
}

/// A motion known exactly, and its torque: sampled at 1 kHz, integrated at 10 kHz.
fn exact(duration_s: f64, angle: impl Fn(f64) -> f64) -> Run {
    const FINE_S: f64 = 1e-4;
    const DIFFERENCE_S: f64 = 1e-5;
    let motion = |time_s: f64| {
        let (before, now, after) =
            (angle(time_s - DIFFERENCE_S), angle(time_s), angle(time_s + DIFFERENCE_S));
        MotionSample {
            angle_rad: now,
            speed_rad_per_s: (after - before) / (2.0 * DIFFERENCE_S),
            acceleration_rad_per_s2: (after - 2.0 * now + before) / (DIFFERENCE_S * DIFFERENCE_S),
        }
    };
    let params = MotionParams::new(&rig()).unwrap();
    let mut state = params.at_start(&motion(0.0));
    let mut run = Run { name: "run".into(), torque_nm: Some(Vec::new()), ..Run::default() };
    for k in 0..(duration_s / FINE_S) as usize {
        let (begin_s, end_s) = (k as f64 * FINE_S, (k + 1) as f64 * FINE_S);
        let input = MotionInput {
            start: motion(begin_s),
            end: motion(end_s),
            pressure_drop_pa: 0.0,
            oil_temperature_c: 40.0,
        };
        let output = motion_step(&params, &mut state, &input, FINE_S);
        if (k + 1) % 10 == 0 {
            run.time_s.push(end_s);
            run.angle_rad.push(angle(end_s));
            run.torque_nm.as_mut().unwrap().push(output.load_torque_nm);
        }
    }
    run
}

/// The run as an encoder sees it, with noise of so many steps on top.
fn measured(run: &Run, noise_steps: f64) -> Run {
    let mut generator = rand_pcg::Pcg64::seed_from_u64(7);
    let noise = Normal::new(0.0, noise_steps).unwrap();
    let mut seen = run.clone();
    for angle in &mut seen.angle_rad {
        *angle = (*angle / STEP_RAD + noise.sample(&mut generator)).round() * STEP_RAD;
    }
    seen
}

/// Strokes of so many steps, each in the first of two times, s, and the next after the second; all a part of a step off its edges.
fn strokes(steps: f64, (move_s, period_s): (f64, f64), off: f64) -> impl Fn(f64) -> f64 {
    move |t| {
        let (number, part) = ((t / period_s).floor(), ((t % period_s) / move_s).min(1.0));
        STEP_RAD * (steps * (number + (0.5 * std::f64::consts::PI * part).sin().powi(2)) + off)
    }
}

/// Root mean square of the error that the encoder causes, N·m.
fn error_nm(run: &Run, noise_steps: f64) -> f64 {
    let mut seen = measured(run, noise_steps);
    predict(&mut seen, &rig(), &Past::default()).unwrap();
    let pairs = seen.torque_nm.as_ref().unwrap().iter().zip(run.torque_nm.as_ref().unwrap());
    let sum: f64 = pairs.map(|(predicted, truth)| (predicted - truth).powi(2)).sum();
    (sum / run.len() as f64).sqrt()
}

/// The residual over the transducer's noise.
fn ratio(run: &Run, noise_steps: f64) -> f64 {
    (1.0 + (error_nm(run, noise_steps) / TRANSDUCER_NM).powi(2)).sqrt()
}

#[test]
fn slow_loops_stay_within_five_percent_of_the_noise() {
    let loops = [
        ("1 mrad at 0.1 Hz", exact(20.0, |t| 1e-3 * (TAU * 0.1 * t).sin())),
        ("4 mrad at 0.5 Hz", exact(20.0, |t| 4e-3 * (TAU * 0.5 * t).sin())),
        ("loops in loops", exact(20.0, |t| 4e-3 * (TAU * 0.2 * t).sin() + 1e-3 * (TAU * 1.3 * t).sin())),
        ("constant 3 mrad/s", exact(10.0, |t| 3e-3 * t)),
    ];
    for (name, run) in &loops {
        let found = ratio(run, 0.0);
        println!("{name}: {found:.3} times the noise; {:.3} with noise of 0.3 steps", ratio(run, 0.3));
        assert!(found < 1.05, "{name}: {found}");
    }
}

#[test]
fn fast_motion_keeps_its_edges() {
    let run = exact(10.0, |t| 0.2 * (TAU * t).sin());
    let found = ratio(&run, 0.0);
    println!("{found:.3} times the noise");
    assert!(found < 1.02, "{found}");
}

#[test]
fn nothing_creeps_at_rest() {
    let up = |t: f64| 0.01 * (0.5 * std::f64::consts::PI * t.min(1.0)).sin().powi(2) + 0.4 * STEP_RAD;
    let run = exact(20.0, up);
    for noise_steps in [0.0, 0.3] {
        let mut seen = measured(&run, noise_steps);
        predict(&mut seen, &rig(), &Past::default()).unwrap();
        let torque_nm = seen.torque_nm.unwrap();
        let creep_nm = (torque_nm[2_000] - torque_nm[19_900]).abs();
        println!("noise of {noise_steps} steps: {creep_nm:.1e} N·m in 18 s of rest");
        assert!(creep_nm < 2e-3, "{noise_steps}: {creep_nm}");
    }
}

/// A record of few samples a second has rests of a hundred samples. Where the spool stands between two counts they flicker; followed
/// by the bristles, that would take a tenth off the friction before the next motion.
#[test]
fn nothing_creeps_in_the_short_rests_of_a_slow_record() {
    // Moves of 60 ms by a whole number of steps and a half, and rests of 120 ms.
    let moved = strokes(1000.0, (0.06, 0.18), 0.5);
    let run = exact(9.0, moved);
    let mut seen = measured(&run, 0.05);
    predict(&mut seen, &rig(), &Past::default()).unwrap();
    let (predicted, truth) = (seen.torque_nm.unwrap(), run.torque_nm.clone().unwrap());
    for rest in 1..49 {
        let (begin, end) = (180 * rest + 65, 180 * rest + 175);
        let creep_nm = (predicted[end] - predicted[begin]) - (truth[end] - truth[begin]);
        let part = creep_nm.abs() / truth[end].abs();
        assert!(part < 0.03, "rest {rest}: {:.1} % of the friction in 110 ms", 100.0 * part);
    }
}

/// Rests of sixty samples between moves are smoothed less than long ones, and what noise is left is more. Followed by the bristles, it
/// would take the friction away that the spool rests with.
#[test]
fn noise_takes_no_friction_away_in_rests_of_sixty_samples() {
    let moved = strokes(300.0, (0.03, 0.09), 0.0);
    let run = exact(9.0, moved);
    for noise_steps in [0.3, 1.0, 2.0] {
        let mut seen = measured(&run, noise_steps);
        predict(&mut seen, &rig(), &Past::default()).unwrap();
        let (predicted, truth) = (seen.torque_nm.unwrap(), run.torque_nm.clone().unwrap());
        let lost = (1..99).map(|rest| {
            let end = 90 * rest + 85;
            (truth[end] - predicted[end]) / truth[end]
        });
        let lost = lost.sum::<f64>() / 98.0;
        println!("noise of {noise_steps} steps: {:.1} % of the friction is lost", 100.0 * lost);
        assert!(lost.abs() < 0.05, "{noise_steps}: {lost}");
    }
}

/// The same, rest by rest: where the mean is right, one rest in five may still have lost a third.
#[test]
fn the_torque_of_each_short_rest_stays() {
    let moved = strokes(300.0, (0.03, 0.09), 0.48);
    let run = exact(9.0, moved);
    for noise_steps in [0.03, 0.1, 0.3, 1.0, 2.0] {
        let mut seen = measured(&run, noise_steps);
        predict(&mut seen, &rig(), &Past::default()).unwrap();
        let (predicted, truth) = (seen.torque_nm.unwrap(), run.torque_nm.clone().unwrap());
        let changes = |rest: usize| {
            let (begin, end) = (90 * rest + 40, 90 * rest + 80);
            ((predicted[end] - predicted[begin]) - (truth[end] - truth[begin])).abs() / truth[end]
        };
        let changed = (1..99).filter(|rest| changes(*rest) > 0.02).count();
        println!("noise of {noise_steps} steps: the torque changes in {changed} of 98 rests");
        assert!(changed <= 10, "{noise_steps}: {changed} of 98");
    }
}

/// A rest's smoothed angle finds back from the noise of the motion's end over the first hundreds of samples. Followed by the bristles,
/// that would take off what the spool holds.
#[test]
fn what_is_held_after_a_move_stays_through_a_long_rest() {
    let moved = strokes(3000.0, (0.2, 0.8), 0.0);
    let run = exact(16.0, moved);
    for noise_steps in [0.3, 0.7, 1.4] {
        let mut seen = measured(&run, noise_steps);
        predict(&mut seen, &rig(), &Past::default()).unwrap();
        let (predicted, truth) = (seen.torque_nm.unwrap(), run.torque_nm.clone().unwrap());
        let faded = (0..20).map(|rest| {
            let (begin, end) = (800 * rest + 230, 800 * rest + 720);
            ((predicted[begin] - predicted[end]) - (truth[begin] - truth[end])) / truth[end]
        });
        let faded = faded.map(f64::abs).sum::<f64>() / 20.0;
        println!("noise of {noise_steps} steps: {:.2} % of the friction fades", 100.0 * faded);
        assert!(faded < 0.005, "{noise_steps}: {faded}");
    }
}

#[test]
fn the_encoder_is_found_in_its_angles() {
    let run = exact(2.0, |t| 0.3 * t);
    let noise = Noise::of(&measured(&run, 0.0).angle_rad);
    assert!((noise.step_rad / STEP_RAD - 1.0).abs() < 1e-9, "{noise:?}");
    let noise = Noise::of(&measured(&run, 2.0).angle_rad);
    assert!((noise.deviation_rad / STEP_RAD - 2.02).abs() < 0.2, "{noise:?}");
    assert_eq!(Noise::of(&run.angle_rad).step_rad, 0.0);
}

#[test]
fn a_block_begins_where_the_last_one_ended() {
    // Long enough for several blocks, with noise so that the play is in use.
    let time_s: Vec<f64> = (0..80_000).map(|k| 1e-3 * f64::from(k)).collect();
    let mut generator = rand_pcg::Pcg64::seed_from_u64(3);
    let noise = Normal::new(0.0, 0.5).unwrap();
    let truth = |t: f64| 0.01 * (0.3 * t).sin();
    let angles: Vec<f64> = time_s
        .iter()
        .map(|t| (truth(*t) / STEP_RAD + noise.sample(&mut generator)).round() * STEP_RAD)
        .collect();
    let mut smoother = Smoother::new(&time_s, &angles, Noise::of(&angles));
    let motions: Vec<MotionSample> = (0..time_s.len()).map(|index| smoother.motion(index)).collect();
    for (pair, time) in motions.windows(2).zip(&time_s) {
        let jump = (pair[1].angle_rad - pair[0].angle_rad).abs();
        assert!(jump < 1e-5, "a jump of {jump} rad at {time} s");
    }
    let worst = motions.iter().zip(&time_s).map(|(motion, t)| (motion.angle_rad - truth(*t)).abs());
    assert!(worst.fold(0.0, f64::max) < STEP_RAD);
}

#[test]
fn a_rest_has_no_speed_however_soon_a_motion_follows() {
    // A valve met near break-away would slip of the speed that noise makes.
    let moves = |k: u32| if k < 60 { 0.0 } else { 2e-6 * f64::from(k - 60).powi(2) };
    let time_s: Vec<f64> = (0..600).map(|k| 1e-3 * f64::from(k)).collect();
    for seed in 0..20 {
        let mut generator = rand_pcg::Pcg64::seed_from_u64(seed);
        let noise = Normal::new(0.0, 1.0).unwrap();
        let angles: Vec<f64> = (0..600)
            .map(|k| ((moves(k) + 0.3) / STEP_RAD + noise.sample(&mut generator)).round() * STEP_RAD)
            .collect();
        let noise = Noise::of(&angles);
        let first = motion_at(&time_s, &angles, noise, 0);
        assert_eq!(first.speed_rad_per_s, 0.0, "seed {seed}");
        assert!((first.angle_rad - 0.3).abs() < STEP_RAD, "seed {seed}: {} rad", first.angle_rad);
        let later = motion_at(&time_s, &angles, noise, 300);
        assert!((later.speed_rad_per_s / 0.96 - 1.0).abs() < 0.05, "seed {seed}: {later:?}");
    }
}

#[test]
fn the_encoder_is_found_in_a_text_of_few_digits() {
    // Counts in a swing of ±16°, as tables have it: of 4,000 each is a whole number of decimals, of the others none is.
    for (counts, digits) in
        [4000.0, 4096.0, 16_384.0, 65_536.0].into_iter().flat_map(|of| (4..10).map(move |to| (of, to)))
    {
        let step_rad = TAU / counts;
        let reading = |t: f64| ((0.28 * (3.0 * t).sin()) / step_rad).round() * step_rad;
        let shown = |degrees: f64| format!("{degrees:.digits$}").parse::<f64>().unwrap().to_radians();
        let angle_rad: Vec<f64> =
            (0..4000).map(|row| shown(reading(1e-3 * f64::from(row)).to_degrees())).collect();
        let noise = Noise::of(&angle_rad);
        assert!(
            (noise.step_rad / step_rad - 1.0).abs() < 1e-3,
            "{counts} counts, {digits} digits: {noise:?}"
        );
        // A motion that no encoder rounded has no step beyond the text's.
        let smooth: Vec<f64> =
            (0..4000).map(|row| shown((0.28 * (3e-3 * f64::from(row)).sin()).to_degrees())).collect();
        let text_rad = 10f64.powi(-i32::try_from(digits).unwrap()).to_radians();
        assert!(Noise::of(&smooth).step_rad < 1.01 * text_rad, "{digits} digits: {:?}", Noise::of(&smooth));
        // Nor has one at few speeds.
        let speeds = |row: u32| 0.11 * f64::from(row) + 0.023 * f64::from(row.saturating_sub(2000));
        let ramps: Vec<f64> = (0..4000).map(|row| shown((1e-3 * speeds(row)).to_degrees())).collect();
        assert!(Noise::of(&ramps).step_rad < 1.01 * text_rad, "{digits} digits: {:?}", Noise::of(&ramps));
    }
}
