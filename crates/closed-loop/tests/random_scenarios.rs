//! Thousands of random scenarios with random truths and beliefs: no limit is broken, and lost steps are reported where
//! and only where steps are lost. `STEPVALVE_RANDOM_SCENARIOS` sets how many; each failure names its seed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{InProcess, Parts, wire};
use common::{Valve, scenario};
use config::{Compensation, Control, Damping, LostSteps, Scenario, ScheduledSetPoint, SetPoint};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use signals::{ControllerState, FaultCode, limiting, validity};
use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicU64, Ordering};

const USUAL: u64 = 10_000;

/// So long the rotor has to stay in another tooth before that counts as lost and not as swinging, s.
const SETTLED_S: f64 = 0.01;

fn log_uniform(rng: &mut Pcg64Mcg, low: f64, high: f64) -> f64 {
    (rng.random_range(low.ln()..high.ln())).exp()
}

fn random_valve(rng: &mut Pcg64Mcg, missed_step: bool) -> Valve {
    let coulomb_torque_nm = log_uniform(rng, 0.1, 5.0);
    let bristle_stiffness_nm_per_rad = log_uniform(rng, 200.0, 2e4);
    Valve {
        holding_torque_nm: rng.random_range(4.5..7.5),
        rotor_inertia_kg_m2: log_uniform(rng, 2e-4, 8e-4),
        coulomb_torque_nm,
        static_torque_nm: coulomb_torque_nm * rng.random_range(1.0..2.0),
        stribeck_velocity_rad_per_s: log_uniform(rng, 0.01, 0.5),
        bristle_stiffness_nm_per_rad,
        bristle_damping_nm_s_per_rad: rng.random_range(0.2..1.5)
            * (bristle_stiffness_nm_per_rad * 5e-4).sqrt(),
        viscous_nm_s_per_rad: log_uniform(rng, 1e-5, 0.3),
        // After arming: what happens before is where the run begins.
        missed_step_at_s: missed_step.then(|| rng.random_range(0.1..0.25)),
    }
}

fn random_scenario(rng: &mut Pcg64Mcg) -> Scenario {
    let mut scenario = scenario(0.3, "");
    scenario.period_ns =
        [250_000, 500_000, 1_000_000, 1_000_000, 1_000_000, 2_000_000, 4_000_000][rng.random_range(0..7)];
    scenario.seed = rng.random_range(0..1 << 60);
    scenario.loop_delay_cycles = rng.random_range(1..=2);
    scenario.encoder.fitted = rng.random_bool(0.8);
    scenario.encoder.delay_cycles = [0, 0, 0, 1, 2][rng.random_range(0..5)];
    scenario.compensation = [
        Compensation::None,
        Compensation::CoulombViscous,
        Compensation::Full,
        Compensation::Full,
        Compensation::FullWithEffects,
    ][rng.random_range(0..5)];
    let observer = scenario.encoder.fitted && rng.random_bool(0.7);
    scenario.control = Control {
        observer,
        observer_bandwidth_hz: rng.random_bool(0.5).then_some(160.0),
        observer_limit: rng.random_range(0.1..1.0),
        damping: match rng.random_range(0..3) {
            0 if observer && scenario.period_ns <= 1_000_000 => Damping::Active,
            1 => Damping::Shaping,
            _ => Damping::None,
        },
    };
    scenario.safety.lost_steps = if rng.random() { LostSteps::Fault } else { LostSteps::Resynchronise };
    // Out of the way of what is looked for, now and then.
    scenario.safety.max_following_error_rad = if rng.random() { 0.05 } else { 100.0 };
    scenario.driver.max_pulse_rate_hz = log_uniform(rng, 230e3, 600e3);
    scenario.driver.max_pulse_acceleration_hz_per_s = log_uniform(rng, 30e6, 400e6);
    scenario.set_points = (0..rng.random_range(1..4)).map(|index| random_set_point(rng, index)).collect();
    scenario
}

fn random_set_point(rng: &mut Pcg64Mcg, index: u32) -> ScheduledSetPoint {
    let set_point = match rng.random_range(0..4) {
        0 => SetPoint::Speed { speed_rad_per_s: rng.random_range(-12.0..12.0) },
        1 => SetPoint::Sine { amplitude_rad: 0.02, frequency_hz: rng.random_range(1.0..30.0) },
        _ => SetPoint::Angle { angle_rad: rng.random_range(-0.8..0.8) },
    };
    ScheduledSetPoint { time_s: 0.01 + 0.09 * f64::from(index), set_point, line: 0 }
}

/// What came of the scenarios, over all of them.
#[derive(Default)]
struct Tally {
    reported: AtomicU64,
    short: AtomicU64,
    kept: AtomicU64,
}

/// How the rotor stands to its tooth over the last cycles.
#[derive(Default)]
struct Teeth {
    home: i64,
    away_cycles: u64,
    lost: bool,
    reported: bool,
    lag_before_rad: [f64; 8],
}

/// Whether the motor could do the motions with a third of its torque to spare.
fn strong_enough(valve: &Valve) -> bool {
    let inertia_nm = 1000.0 * (valve.rotor_inertia_kg_m2 + 1e-4);
    let most_nm = valve.static_torque_nm + inertia_nm + 12.6 * (valve.viscous_nm_s_per_rad + 0.02);
    most_nm < 0.67 * valve.holding_torque_nm
}

fn check(seed: u64, tally: &Tally) {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let scenario = random_scenario(&mut rng);
    let missed_step = rng.random_bool(0.1);
    let truth = random_valve(&mut rng, missed_step);
    let belief_is_right = rng.random();
    let belief = if belief_is_right { truth } else { random_valve(&mut rng, false) };
    let belief = Valve { missed_step_at_s: None, ..belief };
    let parts = wire(&scenario, &truth.model(), &belief.model()).unwrap();
    let (mut before, mut teeth) = (None, Teeth::default());
    let mut short = false;
    let mut last_lost = 0;
    for messages in InProcess::new(&parts) {
        let (status, command, plant) = (&messages.status, &messages.command, &messages.plant);
        last_lost = plant.truth.lost_teeth;
        let running = status.state == ControllerState::Running.code();
        if running {
            within_limits(seed, &parts, &mut before, command);
            assert!(status.lead_angle_rad.abs() <= 70.1_f64.to_radians(), "seed {seed}: lead");
            short |= status.torque_reserve_nm < 0.0;
            assert!(
                status.torque_reserve_nm >= 0.0 || status.limiting & limiting::TORQUE != 0,
                "seed {seed}: a reserve of {} N·m is not flagged",
                status.torque_reserve_nm
            );
        } else {
            before = None;
        }
        assert_eq!(plant.feedback.drive_fault, 0, "seed {seed}: the drive stopped by itself");
        assert!(plant.feedback.validity & validity::LIMITED == 0, "seed {seed}: the drive cut a command");
        if scenario.encoder.fitted && messages.cycle > parts.timeline.arm_cycle && running {
            note_teeth(seed, &scenario, &mut teeth, &messages);
        }
        if status.fault == FaultCode::LostSteps.code() && !teeth.reported {
            note_teeth(seed, &scenario, &mut teeth, &messages);
            assert!(teeth.reported, "seed {seed}");
        }
    }
    if scenario.safety.lost_steps == LostSteps::Fault && teeth.reported && !missed_step {
        assert!(last_lost != 0, "seed {seed}: lost steps reported, and none was lost in the end");
    }
    if scenario.control.damping == Damping::Active && belief_is_right && !missed_step && strong_enough(&truth)
    {
        assert!(!teeth.reported, "seed {seed}: lost steps that the motor had the torque to keep");
        tally.kept.fetch_add(1, Ordering::Relaxed);
    }
    assert!(!teeth.lost || teeth.reported, "seed {seed}: lost steps were not reported");
    tally.reported.fetch_add(u64::from(teeth.reported), Ordering::Relaxed);
    tally.short.fetch_add(u64::from(short), Ordering::Relaxed);
}

/// Pulse rate and its change, on the unrounded command.
fn within_limits(seed: u64, parts: &Parts, before: &mut Option<(f64, f64)>, command: &signals::StepCommand) {
    let drive = &parts.plant.drive;
    let period_s = drive.period_s;
    if let Some((position, rate_hz)) = *before {
        let now_hz = (command.position_unrounded - position) / period_s;
        let change = (now_hz - rate_hz).abs() / period_s;
        // Positions have sixteen digits, and their second difference is taken.
        assert!(now_hz.abs() <= drive.max_pulse_rate_hz * (1.0 + 1e-6), "seed {seed}: pulse rate {now_hz}");
        assert!(
            change <= drive.max_pulse_acceleration_hz_per_s * (1.0 + 1e-6),
            "seed {seed}: change of the pulse rate {change}"
        );
        *before = Some((command.position_unrounded, now_hz));
    } else {
        *before = Some((command.position_unrounded, command.pulse_rate_hz));
    }
}

fn note_teeth(seed: u64, scenario: &Scenario, teeth: &mut Teeth, messages: &closed_loop::CycleMessages) {
    let truth = &messages.plant.truth;
    let lag_rad = 50.0 * (truth.command_angle_rad - truth.angle_rad);
    let from_home_rad = (lag_rad - TAU * teeth.home as f64).abs();
    teeth.lag_before_rad.rotate_right(1);
    teeth.lag_before_rad[0] = from_home_rad;
    let status = &messages.status;
    let now_reported = status.fault == FaultCode::LostSteps.code() || status.lost_teeth > 0;
    if now_reported && !teeth.reported {
        teeth.reported = true;
        // The encoder's reading is as old as the scenario says.
        let age = scenario.encoder.delay_cycles as usize;
        let seen_rad = teeth.lag_before_rad[age];
        assert!(
            seen_rad > PI,
            "seed {seed}: reported at a lag of {seen_rad} rad in cycle {}",
            messages.cycle
        );
        let before_rad = teeth.lag_before_rad[age + 1];
        // Within a tooth pitch after 180°, unless a single cycle brought it further.
        assert!(
            seen_rad < PI + TAU || before_rad < PI + 0.2,
            "seed {seed}: reported late, at a lag of {seen_rad} rad, {before_rad} rad before"
        );
    }
    // About 180° friction may hold the rotor between two teeth.
    teeth.away_cycles = if from_home_rad > 1.5 * PI { teeth.away_cycles + 1 } else { 0 };
    let settled_cycles = (SETTLED_S / scenario.period_s()).ceil() as u64 + scenario.encoder.delay_cycles;
    // Once reported, the teeth that are home are others.
    teeth.lost |= !teeth.reported && teeth.away_cycles > settled_cycles;
}

#[test]
fn no_limit_is_broken_and_lost_steps_are_reported_where_they_are_lost() {
    let count: u64 = std::env::var("STEPVALVE_RANDOM_SCENARIOS").map_or(USUAL, |text| text.parse().unwrap());
    let (next, tally) = (AtomicU64::new(0), Tally::default());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= count {
                        break;
                    }
                    check(seed, &tally);
                }
            });
        }
    });
    let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    println!(
        "seeds 0 to {}: steps lost in {}, a torque reserve below zero flagged in {}",
        count - 1,
        of(&tally.reported),
        of(&tally.short)
    );
    println!("right beliefs with torque to spare that lost none: {}", of(&tally.kept));
    if count >= USUAL {
        assert!(of(&tally.reported) > count / 100, "hardly any scenario lost steps: nothing was tested");
    }
}
