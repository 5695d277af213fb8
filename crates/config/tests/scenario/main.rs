//! A scenario as a user writes it: what it means, and what is said at which place when it is wrong.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod control;
mod files;
mod homing;
mod keys;
mod set_points;
mod values;

use config::{
    AfterStop, Compensation, ConfigErrors, Damping, FlowPressure, LostSteps, Scenario, SetPoint,
    parse_scenario,
};

const FULL: &str = r#"format = "stepvalve-scenario"
format_version = 1
name = "everything"
period = "2ms"
duration = "1min"
seed = 42
truth = "a.toml"
belief = "b.toml"
initial_angle = "10deg"
loop_delay_cycles = 2
pressure_drop = [{ time = "1s", value = "2MPa" }, { time = "3s", value = 4e6 }]
oil_temperature = "45degC"

[limits]
min_angle = "0deg"
max_angle = "45deg"
max_speed = "60rpm"
max_acceleration = "1000rad/s2"
max_jerk = 1.2e5

[driver]
max_pulse_rate = "600kHz"
max_pulse_acceleration = "400MHz/s"
quick_stop_deceleration = "10MHz/s"
after_stop = "de-energise"

[encoder]
fitted = true
counts_per_turn = 65536
noise = "0.01mrad"
delay_cycles = 1

[safety]
silence_cycles = 50
max_following_error = "3deg"

[compensation]
level = "coulomb-viscous"

[timing.plant-simulator]
phase = "10us"
core = 1
priority = 80

[timing.step-controller]
priority = 78

[[set_point]]
time = "0.5s"
angle = "17deg"

[[set_point]]
time = 1
opening = 0.5

[[set_point]]
time = "2s"
flow = "60L/min"

[[set_point]]
time = "3s"
flow = "60L/min"
pressure_drop = "20bar"

[[set_point]]
time = "4s"
angle = 0.3

[[set_point]]
time = "5s"
sine = { amplitude = "0.2rad", frequency = "1Hz" }

[[set_point]]
time = "7s"
hold = true
"#;

const SMALL: &str = r#"format = "stepvalve-scenario"
format_version = 1
name = "small"
duration = "1s"
truth = "a.toml"
belief = "b.toml"
[limits]
max_speed = "12rad/s"
max_acceleration = "1000rad/s2"
max_jerk = "1.2e5rad/s3"
[driver]
max_pulse_rate = "600kHz"
max_pulse_acceleration = "400MHz/s"
quick_stop_deceleration = "10MHz/s"
after_stop = "hold"
[safety]
max_following_error = "3deg"
"#;

fn full() -> Scenario {
    parse_scenario(FULL, "x.toml").unwrap_or_else(|errors| panic!("{errors}"))
}

/// The errors of `text` with `from`, which stands in it once, replaced by `to`.
#[track_caller]
fn errors_of(text: &str, from: &str, to: &str) -> ConfigErrors {
    assert_eq!(text.matches(from).count(), 1, "{from}");
    parse_scenario(&text.replace(from, to), "x.toml").expect_err("accepted")
}

/// That this change gives exactly one error, and how it reads.
#[track_caller]
fn refused(text: &str, from: &str, to: &str, expected: &str) {
    assert_eq!(errors_of(text, from, to).to_string(), expected);
}

#[track_caller]
fn set_points_refused(set_points: &str, expected: &str) {
    let errors = parse_scenario(&format!("{SMALL}{set_points}"), "x.toml").expect_err("accepted");
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn everything_means_what_it_says() {
    let s = full();
    assert_eq!((s.name.as_str(), s.period_ns, s.duration_s, s.seed), ("everything", 2_000_000, 60.0, 42));
    assert_eq!((s.truth.as_str(), s.belief.as_str(), s.loop_delay_cycles), ("a.toml", "b.toml", 2));
    assert_eq!(s.initial_angle_rad, 10f64.to_radians());
    assert_eq!(s.limits.min_angle_rad, Some(0.0));
    assert_eq!(s.limits.max_speed_rad_per_s, 60.0 * std::f64::consts::PI / 30.0);
    assert_eq!(s.limits.max_jerk_rad_per_s3, 1.2e5);
    assert_eq!((s.driver.max_pulse_rate_hz, s.driver.after_stop), (6e5, AfterStop::DeEnergise));
    assert_eq!(
        (s.driver.max_pulse_acceleration_hz_per_s, s.driver.quick_stop_deceleration_hz_per_s),
        (4e8, 1e7)
    );
    assert_eq!((s.encoder.fitted, s.encoder.counts_per_turn, s.encoder.delay_cycles), (true, 65536, 1));
    assert_eq!(s.encoder.noise_rad, 1e-5);
    assert_eq!((s.safety.silence_cycles, s.compensation), (50, Compensation::CoulombViscous));
    assert_eq!(
        (s.timing.plant.phase_ns, s.timing.plant.core, s.timing.plant.priority),
        (10_000, Some(1), Some(80))
    );
    assert_eq!((s.timing.trajectory.phase_ns, s.timing.trajectory.priority), (300_000, None));
    assert_eq!((s.timing.controller.phase_ns, s.timing.controller.priority), (800_000, Some(78)));
    let pressures: Vec<f64> = [0.0, 1.0, 2.0, 3.0, 9.0].iter().map(|&t| s.pressure_drop.at(t)).collect();
    assert_eq!(pressures, [2e6, 2e6, 3e6, 4e6, 4e6]);
    assert_eq!(s.oil_temperature.at(5.0), 45.0);
    assert!(s.warnings().is_empty());
}

#[test]
fn set_points_mean_what_they_say() {
    let targets: Vec<SetPoint> = full().set_points.iter().map(|point| point.set_point).collect();
    let flow_m3_per_s = 1e-3;
    let expected = [
        SetPoint::Angle { angle_rad: 17f64 * std::f64::consts::PI / 180.0 },
        SetPoint::Opening { opening: 0.5 },
        SetPoint::Flow { flow_m3_per_s, pressure_drop: FlowPressure::Measured },
        SetPoint::Flow { flow_m3_per_s, pressure_drop: FlowPressure::Given(2e6) },
        SetPoint::Angle { angle_rad: 0.3 },
        SetPoint::Sine { amplitude_rad: 0.2, frequency_hz: 1.0 },
        SetPoint::Hold,
    ];
    assert_eq!(targets, expected);
    let points = full().set_points;
    assert_eq!((points[0].time_s, points[0].line, points[1].time_s, points[1].line), (0.5, 48, 1.0, 52));
}

#[test]
fn numbers_that_were_hardly_meant_in_radians_or_pascals_are_noted() {
    let with = |limit: &str, pressure: &str| {
        let own = SMALL.replace("[limits]\n", &format!("[limits]\nmax_angle = {limit}\n"));
        assert_ne!(own, SMALL);
        parse_scenario(&format!("pressure_drop = {pressure}\n{own}"), "x.toml").unwrap().warnings().join("\n")
    };
    for (limit, pressure, turns, pascals) in [
        ("50", "0", true, false),
        ("\"50deg\"", "\"20bar\"", false, false),
        ("1.2", "20", false, true),
        ("1.2", "[{ time = 0, value = 0 }, { time = 1, value = \"0.02MPa\" }]", false, false),
        ("1.2", "[{ time = 0, value = \"1MPa\" }, { time = 1, value = 30 }]", false, true),
    ] {
        let notes = with(limit, pressure);
        assert_eq!(notes.contains("limits.max_angle is 50 rad, 8.0 turns"), turns, "{limit}: {notes}");
        assert_eq!(notes.contains("Pa, next to none"), pascals, "{pressure}: {notes}");
    }
}

#[test]
fn an_encoder_too_coarse_for_the_following_error_is_noted() {
    for (counts, noted) in [("8", true), ("100", true), ("4000", false)] {
        let text = format!("{SMALL}[encoder]\nfitted = true\ncounts_per_turn = {counts}\n");
        let notes = parse_scenario(&text, "x.toml").unwrap().warnings().join("\n");
        assert_eq!(notes.contains("more than max_following_error (3.000°)"), noted, "{counts}: {notes}");
    }
}

#[test]
fn limits_so_wide_that_nothing_is_watched_are_noted() {
    let with = |cycles: &str, error: &str, limits: &str| {
        let text = SMALL
            .replace(
                "max_following_error = \"3deg\"",
                &format!("max_following_error = \"{error}\"\nsilence_cycles = {cycles}"),
            )
            .replace("[limits]\n", &format!("[limits]\n{limits}"));
        let text = format!("{text}[encoder]\nfitted = true\n");
        parse_scenario(&text, "x.toml").unwrap().warnings().join("\n")
    };
    let valve = "min_angle = \"-5deg\"\nmax_angle = \"50deg\"\n";
    for (cycles, error, limits, silent, free) in [
        ("50", "3deg", valve, false, false),
        ("1000", "50deg", valve, false, false),
        ("1001", "55deg", valve, true, true),
        ("100000", "150deg", valve, true, true),
        ("3", "150deg", "", false, false),
        ("3", "360deg", "", false, true),
    ] {
        let notes = with(cycles, error, limits);
        assert_eq!(notes.contains("that nobody commands any more"), silent, "{cycles}: {notes}");
        assert_eq!(notes.contains("is never a fault"), free, "{error}, {limits}: {notes}");
    }
}

#[test]
fn defaults() {
    let s = parse_scenario(SMALL, "x.toml").unwrap();
    assert_eq!((s.period_ns, s.seed, s.loop_delay_cycles), (1_000_000, 0, 1));
    assert_eq!((s.encoder.fitted, s.encoder.counts_per_turn, s.encoder.noise_rad), (false, 131_072, 0.0));
    assert_eq!((s.safety.silence_cycles, s.compensation), (3, Compensation::Full));
    assert_eq!(
        (s.timing.plant.phase_ns, s.timing.trajectory.phase_ns, s.timing.controller.phase_ns),
        (0, 150_000, 400_000)
    );
    assert_eq!((s.pressure_drop.at(1.0), s.oil_temperature.at(1.0)), (0.0, 40.0));
    // No set-point, no encoder, and no current that would keep the zero.
    assert_eq!(s.warnings().len(), 3);
    let rotation = format!(
        "{SMALL}[[set_point]]\ntime = 0\npulse_rate = \"-200kHz\"\n[[set_point]]\ntime = 0.5\nspeed = 11.17"
    );
    let targets: Vec<SetPoint> =
        parse_scenario(&rotation, "x").unwrap().set_points.iter().map(|p| p.set_point).collect();
    assert_eq!(
        targets,
        [SetPoint::PulseRate { pulse_rate_hz: -2e5 }, SetPoint::Speed { speed_rad_per_s: 11.17 }]
    );
}
