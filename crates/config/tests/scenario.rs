//! A scenario as a user writes it: what it means, and what is said at which place when it is wrong.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use config::{
    AfterStop, Compensation, ConfigErrors, Damping, FlowPressure, LostSteps, Scenario, Target, parse_scenario,
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
    let targets: Vec<Target> = full().set_points.iter().map(|point| point.target).collect();
    let flow_m3_per_s = 1e-3;
    let expected = [
        Target::Angle { angle_rad: 17f64 * std::f64::consts::PI / 180.0 },
        Target::Opening { opening: 0.5 },
        Target::Flow { flow_m3_per_s, pressure_drop: FlowPressure::Measured },
        Target::Flow { flow_m3_per_s, pressure_drop: FlowPressure::Given(2e6) },
        Target::Angle { angle_rad: 0.3 },
        Target::Sine { amplitude_rad: 0.2, frequency_hz: 1.0 },
        Target::Hold,
    ];
    assert_eq!(targets, expected);
    let points = full().set_points;
    assert_eq!((points[0].time_s, points[0].line, points[1].time_s, points[1].line), (0.5, 48, 1.0, 52));
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
    assert_eq!(s.warnings().len(), 2);
    let rotation = format!(
        "{SMALL}[[set_point]]\ntime = 0\npulse_rate = \"-200kHz\"\n[[set_point]]\ntime = 0.5\nspeed = 11.17"
    );
    let targets: Vec<Target> =
        parse_scenario(&rotation, "x").unwrap().set_points.iter().map(|p| p.target).collect();
    assert_eq!(
        targets,
        [Target::PulseRate { pulse_rate_hz: -2e5 }, Target::Speed { speed_rad_per_s: 11.17 }]
    );
}

const CONTROL: &str = r#"
[encoder]
fitted = true
[compensation]
level = "full-with-effects"
observer = true
observer_bandwidth = "50Hz"
observer_limit = "25%"
damping = "active"
"#;

#[test]
fn the_controller_means_what_it_says() {
    let text =
        format!("{SMALL}following_error_per_speed = \"2ms\"\nlost_steps = \"resynchronise\"\n{CONTROL}");
    let s = parse_scenario(&text, "x.toml").unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(s.compensation, Compensation::FullWithEffects);
    assert_eq!((s.control.observer, s.control.damping), (true, Damping::Active));
    assert_eq!((s.control.observer_bandwidth_hz, s.control.observer_limit), (50.0, 0.25));
    assert_eq!(s.safety.following_error_per_speed_s, 2e-3);
    assert_eq!(s.safety.lost_steps, LostSteps::Resynchronise);
}

#[test]
fn the_controller_takes_what_encoder_and_period_allow() {
    let control = |more: &str| parse_scenario(&format!("{SMALL}{more}"), "x").unwrap().control;
    let (blind, seen) = (control(""), control("[encoder]\nfitted = true"));
    assert_eq!((blind.observer, blind.damping), (false, Damping::None));
    assert_eq!((seen.observer, seen.damping), (true, Damping::Active));
    let none = control("[encoder]\nfitted = true\n[compensation]\nlevel = \"none\"");
    assert_eq!((none.observer, none.damping), (false, Damping::None));
    assert_eq!(full().control.damping, Damping::None);
}

#[test]
fn what_the_controller_lacks_is_refused_with_the_reason() {
    let text = format!("{SMALL}{CONTROL}");
    let reasons = [
        ("fitted = true", "fitted = false", "there is no encoder for an observer to look at"),
        ("observer = true", "observer = false", "active damping needs an encoder and the observer"),
        ("duration", "period = \"2ms\"\nduration", "the command comes too late for the resonance"),
    ];
    for (from, to, reason) in reasons {
        let errors = errors_of(&text, from, to).to_string();
        assert!(errors.contains(reason), "{errors}");
    }
}

#[test]
fn short_periods_are_experimental() {
    let short =
        FULL.replace("period = \"2ms\"", "period = \"200us\"").replace("phase = \"10us\"", "phase = 0");
    assert!(parse_scenario(&short, "x.toml").unwrap().warnings()[0].contains("200 us is experimental"));
}

#[test]
fn values_out_of_range() {
    let period = "a time from 100 us to 10 ms";
    refused(FULL, "\"2ms\"", "\"-1 ms\"", &format!("x.toml:4:10: period: found -1 ms, expected {period}"));
    refused(
        FULL,
        "\"2ms\"",
        "1",
        &format!("x.toml:4:10: period: found 1 (bare numbers are in s), expected {period}"),
    );
    refused(FULL, "\"2ms\"", "nan", &format!("x.toml:4:10: period: found nan, expected {period}"));
    refused(FULL, "\"2ms\"", "-inf", &format!("x.toml:4:10: period: found -inf, expected {period}"));
    refused(FULL, "\"2ms\"", "true", &format!("x.toml:4:10: period: found true, expected {period}"));
    let whole = "a whole number of microseconds";
    refused(
        FULL,
        "\"2ms\"",
        "\"1000.5us\"",
        &format!("x.toml:4:10: period: found 1000.5us, expected {whole}"),
    );
    refused(
        FULL,
        "\"1min\"",
        "\"31d\"",
        "x.toml:5:12: duration: found 31d, expected a time above 0 s and at most 30 d",
    );
    refused(
        FULL,
        "seed = 42",
        "seed = -1",
        "x.toml:6:8: seed: found -1, expected a whole number from 0 to 9223372036854775807",
    );
    refused(
        FULL,
        "loop_delay_cycles = 2",
        "loop_delay_cycles = 3",
        "x.toml:10:21: loop_delay_cycles: found 3, expected a whole number from 1 to 2",
    );
    refused(
        FULL,
        "\"45degC\"",
        "\"300degC\"",
        "x.toml:12:19: oil_temperature: found 300degC, expected a temperature from -60 degC to 200 degC",
    );
    refused(
        FULL,
        "1.2e5",
        "1e999",
        "x.toml:19:12: limits.max_jerk: found 1e999, expected a jerk above 0 rad/s3 and at most 1e10 rad/s3",
    );
    refused(
        FULL,
        "\"de-energise\"",
        "\"off\"",
        "x.toml:25:14: driver.after_stop: found off, expected \"hold\" or \"de-energise\" or \"neutral\"",
    );
    refused(
        FULL,
        "core = 1",
        "core = 1024",
        "x.toml:42:8: timing.plant-simulator.core: found 1024, expected a whole number from 0 to 1023",
    );
    refused(
        FULL,
        "priority = 80",
        "priority = 0",
        "x.toml:43:12: timing.plant-simulator.priority: found 0, expected a whole number from 1 to 99",
    );
}

#[test]
fn limits_of_zero() {
    let speed =
        "x.toml:17:13: limits.max_speed: found 0rpm, expected a speed above 0 rad/s and at most 10000 rad/s";
    refused(FULL, "\"60rpm\"", "\"0rpm\"", speed);
}

#[test]
fn duration_of_less_than_a_cycle() {
    refused(
        SMALL,
        "\"1s\"",
        "\"999us\"",
        "x.toml:4:12: duration: found 999us, expected at least one cycle of 1 ms",
    );
}

#[test]
fn unknown_keys() {
    let errors = errors_of(FULL, "seed = 42", "sead = 42").to_string();
    assert!(
        errors.starts_with(
            "x.toml:6:1: sead: found an unknown key, expected seed (did you mean it?) or one of "
        )
    );
    let errors = errors_of(FULL, "delay_cycles = 1", "  bogus = 1").to_string();
    let keys = "fitted, counts_per_turn, noise, delay_cycles";
    assert_eq!(errors, format!("x.toml:31:3: encoder.bogus: found an unknown key, expected one of {keys}"));
    let errors = errors_of(FULL, "[timing.step-controller]", "[timing.step-controler]").to_string();
    assert!(
        errors.starts_with(
            "x.toml:45:9: timing.step-controler: found an unknown key, expected step-controller"
        )
    );
    let errors = errors_of(FULL, "frequency = \"1Hz\"", "frequency = \"1Hz\", phase = 1").to_string();
    let keys = "amplitude, frequency";
    let place = "x.toml:71:51: set_point[5].sine.phase";
    assert_eq!(errors, format!("{place}: found an unknown key, expected one of {keys}"));
}

#[test]
fn missing_fields_name_the_section() {
    let rate = "a pulse rate above 0 Hz and at most 10 MHz";
    let place = "x.toml:21:1: driver.max_pulse_rate";
    refused(FULL, "max_pulse_rate = \"600kHz\"\n", "", &format!("{place}: found nothing, expected {rate}"));
    refused(FULL, "name = \"everything\"\n", "", "x.toml:1:1: name: found nothing, expected a name");
    refused(
        FULL,
        "fitted = true\n",
        "",
        "x.toml:27:1: encoder.fitted: found nothing, expected true or false",
    );
    refused(
        SMALL,
        "[safety]\nmax_following_error = \"3deg\"\n",
        "",
        "x.toml:1:1: safety: found nothing, expected a section [safety]",
    );
    refused(
        FULL,
        "time = \"2s\"\n",
        "",
        "x.toml:56:1: set_point[2].time: found nothing, expected a time from 0 s to 30 d",
    );
}

#[test]
fn wrong_kinds() {
    refused(
        SMALL,
        "[safety]\nmax_following_error = \"3deg\"\n",
        "[[safety]]\n",
        "x.toml:16:1: safety: found [[safety]], expected a section [safety]",
    );
    refused(
        FULL,
        "name = \"everything\"",
        "name = \"  \"",
        "x.toml:3:8: name: found an empty text, expected a name",
    );
    refused(
        FULL,
        "name = \"everything\"",
        "name = \"a\\u001bb\"",
        "x.toml:3:8: name: found a\\u{1b}b, expected a name",
    );
    refused(
        FULL,
        "fitted = true",
        "fitted = 1",
        "x.toml:28:10: encoder.fitted: found 1, expected true or false",
    );
    refused(
        FULL,
        "\"45degC\"",
        "[]",
        "x.toml:12:19: oil_temperature: found an empty list, expected at least one { time, value }",
    );
}

#[test]
fn another_format_is_not_read_further() {
    let expected = "x.toml:1:10: format: found stepvalve-model, expected \"stepvalve-scenario\"";
    refused(FULL, "\"stepvalve-scenario\"", "\"stepvalve-model\"", expected);
    refused(
        FULL,
        "format_version = 1",
        "format_version = 2",
        "x.toml:2:18: format_version: found 2, expected 1",
    );
    let nothing = parse_scenario("", "x.toml").unwrap_err();
    assert_eq!(nothing.errors().len(), 2);
    assert_eq!(
        nothing.errors()[0].to_string(),
        "x.toml:1:1: format: found nothing, expected \"stepvalve-scenario\""
    );
}

#[test]
fn angles_outside_the_limits() {
    let limits = "an angle within [limits], 0 rad to 0.785398 rad";
    refused(
        FULL,
        "\"17deg\"",
        "\"50deg\"",
        &format!("x.toml:50:9: set_point[0].angle: found 50deg, expected {limits}"),
    );
    refused(
        FULL,
        "initial_angle = \"10deg\"",
        "initial_angle = \"-1deg\"",
        &format!("x.toml:9:17: initial_angle: found -1deg, expected {limits}"),
    );
    refused(FULL, "max_angle = \"45deg\"", "max_angle = \"-45deg\"", &{
        let within = "an angle within [limits], 0 rad to -0.785398 rad";
        let mut lines = vec!["x.toml:9:17: initial_angle: found 10deg, expected ".to_owned() + within];
        lines.push(
            "x.toml:16:13: limits.max_angle: found -45deg, expected an angle above min_angle, 0 rad"
                .to_owned(),
        );
        lines.push("x.toml:50:9: set_point[0].angle: found 17deg, expected ".to_owned() + within);
        lines.push("x.toml:67:9: set_point[4].angle: found 0.3, expected ".to_owned() + within);
        lines.push(
            "x.toml:71:8: set_point[5].sine: found a sine from 0.1 rad to 0.5 rad, expected ".to_owned()
                + within,
        );
        lines.join("\n")
    });
}

#[test]
fn an_initial_angle_of_zero_must_be_allowed() {
    let text = SMALL.replace("[limits]", "[limits]\nmin_angle = 0.5");
    let errors = parse_scenario(&text, "x.toml").unwrap_err().to_string();
    assert_eq!(
        errors,
        "x.toml:1:1: initial_angle: found nothing, expected an angle within [limits], 0.5 rad to unlimited"
    );
}

#[test]
fn times_in_order_and_within_the_scenario() {
    refused(
        FULL,
        "time = \"2s\"",
        "time = 1.0",
        "x.toml:57:8: set_point[2].time: found 1.0, expected a time after the set-point before, 1 s",
    );
    refused(
        FULL,
        "time = \"7s\"",
        "time = \"60s\"",
        "x.toml:74:8: set_point[6].time: found 60s, expected a time before the scenario's end, 60 s",
    );
    refused(
        FULL,
        "time = \"0.5s\"",
        "time = \"-0.5s\"",
        "x.toml:49:8: set_point[0].time: found -0.5s, expected a time from 0 s to 30 d",
    );
    let point = "{ time = \"1s\", value = 4e6 }]";
    refused(
        FULL,
        "{ time = \"3s\", value = 4e6 }]",
        point,
        "x.toml:11:60: pressure_drop[1].time: found 1s, expected a time after the point before, 1 s",
    );
}

#[test]
fn exactly_one_target() {
    let kinds = "expected exactly one of angle, opening, flow, speed, pulse_rate, sine, hold";
    set_points_refused(
        "[[set_point]]\ntime = 0",
        &format!("x.toml:18:1: set_point[0]: found nothing, {kinds}"),
    );
    set_points_refused(
        "[[set_point]]\ntime = 0\nspeed = 1\nangle = 1",
        &format!("x.toml:18:1: set_point[0]: found angle and speed, {kinds}"),
    );
    set_points_refused(
        "[[set_point]]\ntime = 0\nhold = false",
        "x.toml:20:8: set_point[0].hold: found false, expected true",
    );
    set_points_refused(
        "[[set_point]]\ntime = 0\nangle = 1\npressure_drop = 1e6",
        "x.toml:21:17: set_point[0].pressure_drop: found a pressure drop beside angle, expected one beside flow only",
    );
    set_points_refused(
        "[[set_point]]\ntime = 0\nopening = 1.5",
        "x.toml:20:11: set_point[0].opening: found 1.5, expected a ratio from 0 to 1",
    );
    refused(
        SMALL,
        "[limits]",
        "set_point = 3\n[limits]",
        "x.toml:7:13: set_point: found 3, expected a list, or tables [[set_point]]",
    );
    refused(
        SMALL,
        "[limits]",
        "set_point = [3]\n[limits]",
        "x.toml:7:14: set_point[0]: found 3, expected a table [[set_point]]",
    );
}

#[test]
fn rotation_needs_unlimited_angles() {
    let place = "x.toml:50:9: set_point[0].speed: found rotation without end at 1rad/s";
    let expected = "expected no min_angle and no max_angle in [limits], or a set-point of another kind";
    refused(FULL, "angle = \"17deg\"", "speed = \"1rad/s\"", &format!("{place}, {expected}"));
    let speed =
        "x.toml:20:9: set_point[0].speed: found -13, expected a speed within limits.max_speed, 12 rad/s";
    set_points_refused("[[set_point]]\ntime = 0\nspeed = -13", speed);
    let rate = "x.toml:20:14: set_point[0].pulse_rate: found 601kHz, expected a pulse rate within driver.max_pulse_rate, 600 kHz";
    set_points_refused("[[set_point]]\ntime = 0\npulse_rate = \"601kHz\"", rate);
}

#[test]
fn sines_within_the_limits() {
    let place = "x.toml:20:8: set_point[0].sine: found a sine with";
    let sine = |amplitude: f64, frequency: f64| {
        format!("[[set_point]]\ntime = 0\nsine = {{ amplitude = {amplitude:?}, frequency = {frequency:?} }}")
    };
    set_points_refused(
        &sine(2.0, 1.0),
        &format!("{place} a peak speed of 12.5664 rad/s, expected at most limits.max_speed, 12 rad/s"),
    );
    set_points_refused(
        &sine(0.15, 12.2),
        &format!(
            "{place} a peak acceleration of 1015.06 rad/s2, expected at most limits.max_acceleration, 1000 rad/s2"
        ),
    );
    set_points_refused(
        &sine(0.02, 26.0),
        &format!("{place} a peak jerk of 135243 rad/s3, expected at most limits.max_jerk, 120000 rad/s3"),
    );
    set_points_refused(
        &sine(1e-6, 101.0),
        &format!("{place} fewer than ten cycles a period, expected a lower frequency or a shorter period"),
    );
    refused(
        FULL,
        "0.2rad",
        "0.31rad",
        "x.toml:71:8: set_point[5].sine: found a sine from -0.01 rad to 0.61 rad, expected an angle within [limits], 0 rad to 0.785398 rad",
    );
}

#[test]
fn phases_increase_within_the_period() {
    let order = "phases that increase from plant-simulator to trajectory-generator to step-controller";
    refused(
        FULL,
        "priority = 78",
        "phase = \"300us\"",
        &format!("x.toml:46:9: timing.step-controller.phase: found 300us, expected {order}"),
    );
    refused(
        FULL,
        "\"10us\"",
        "\"300us\"",
        &format!("x.toml:41:9: timing.plant-simulator.phase: found 300us, expected {order}"),
    );
    refused(
        FULL,
        "\"10us\"",
        "\"2ms\"",
        "x.toml:41:9: timing.plant-simulator.phase: found 2ms, expected a time below the period, 2 ms",
    );
}

#[test]
fn all_errors_at_once_in_the_order_of_lines() {
    let text =
        FULL.replace("\"2ms\"", "\"-1ms\"").replace("\"17deg\"", "\"170deg\"").replace("[safety]", "[safty]");
    let errors = parse_scenario(&text, "x.toml").unwrap_err();
    let places: Vec<(usize, &str)> =
        errors.errors().iter().map(|error| (error.line, error.key.as_str())).collect();
    assert_eq!(places, [(1, "safety"), (4, "period"), (33, "safty"), (50, "set_point[0].angle")]);
}

#[test]
fn columns_count_characters() {
    let text =
        FULL.replace("sine = { amplitude = \"0.2rad\"", "sine = { \"äöü°\" = 1, amplitude = \"0.2rad\"");
    let errors = parse_scenario(&text, "x.toml").unwrap_err();
    assert_eq!((errors.errors()[0].line, errors.errors()[0].column), (71, 10));
    let text = text.replace(
        "\"äöü°\" = 1, amplitude = \"0.2rad\"",
        "amplitude = \"0.2°\", frequency = 1, \"ä\" = 2, \"ö\"=1, x",
    );
    let columns: Vec<usize> =
        parse_scenario(&text, "x").unwrap_err().errors().iter().map(|e| e.column).collect();
    assert_eq!(columns.first(), Some(&62));
    let windows = FULL.replace('\n', "\r\n").replace("seed = 42", "seed = -1");
    let marked = format!("\u{feff}{}", windows.replace("format = \"stepvalve-scenario\"", "format = \"x\""));
    assert!(parse_scenario(&windows, "x.toml").unwrap_err().to_string().starts_with("x.toml:6:8: seed"));
    assert!(parse_scenario(&marked, "x.toml").unwrap_err().to_string().starts_with("x.toml:1:10: format"));
    assert_eq!(parse_scenario(&FULL.replace('\n', "\r\n"), "x").unwrap(), full());
}

#[test]
fn what_is_no_toml() {
    let errors = errors_of(FULL, "seed = 42", "seed = ").to_string();
    assert!(errors.starts_with("x.toml:6:"), "{errors}");
    assert!(errors.ends_with("expected valid TOML"), "{errors}");
    let errors = errors_of(FULL, "seed = 42", "seed = 42\nseed = 43").to_string();
    assert_eq!(errors, "x.toml:7:1: found duplicate key, expected valid TOML");
}

#[test]
fn huge_and_deep_files_are_refused() {
    let errors = parse_scenario(&format!("{FULL}{}", "#".repeat(1 << 20)), "x.toml").unwrap_err().to_string();
    assert!(errors.contains("expected at most 1 MiB"), "{errors}");
    for deep in ["[", "{a=", "[[", "[{a="] {
        let text = format!("{FULL}x = {}", deep.repeat((1 << 19) / deep.len()));
        assert!(parse_scenario(&text, "x.toml").is_err());
    }
    for deep in [format!("[{}a]", "a.".repeat(400_000)), format!("{}a = 1", "a.".repeat(400_000))] {
        assert!(parse_scenario(&format!("{SMALL}{deep}"), "x.toml").is_err());
    }
    let many = "[[set_point]]\nx = 1\n".repeat(40_000);
    assert_eq!(parse_scenario(&format!("{SMALL}{many}"), "x.toml").unwrap_err().errors().len(), 100);
}

#[test]
fn a_neutral_angle_needs_an_end_on_either_side() {
    let with = |keys: &str| FULL.replace("after_stop = \"de-energise\"", keys);
    let good = with("after_stop = \"neutral\"\nneutral_angle = \"5deg\"\nneutral_speed = \"10rpm\"");
    let driver = parse_scenario(&good, "x.toml").unwrap_or_else(|errors| panic!("{errors}")).driver;
    let AfterStop::Neutral { angle_rad, speed_rad_per_s } = driver.after_stop else { panic!("{driver:?}") };
    assert!(
        (angle_rad - 5.0_f64.to_radians()).abs() < 1e-12
            && (speed_rad_per_s - std::f64::consts::FRAC_PI_3).abs() < 1e-12
    );
    for (keys, says) in [
        ("after_stop = \"neutral\"", "neutral_angle"),
        ("after_stop = \"neutral\"\nneutral_angle = \"80deg\"\nneutral_speed = \"10rpm\"", "within [limits]"),
        ("after_stop = \"neutral\"\nneutral_angle = 0\nneutral_speed = \"1000rpm\"", "neutral_speed"),
        ("after_stop = \"hold\"\nneutral_angle = 0", "neutral"),
    ] {
        let errors = parse_scenario(&with(keys), "x.toml").expect_err(keys).to_string();
        assert!(errors.contains(says), "{keys}: {errors}");
    }
    let turns = good.replace("min_angle = \"0deg\"\n", "");
    let errors = parse_scenario(&turns, "x.toml").expect_err("a way without an end").to_string();
    assert!(errors.contains("turns without end"), "{errors}");
}
