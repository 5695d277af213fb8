//! A scenario beside its models: what the valve cannot do is refused with the line that asks for it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use config::{belief_warnings, check_against_models, parse_model, parse_scenario};
use valve_model::Model;

const SCENARIO: &str = r#"format = "stepvalve-scenario"
format_version = 1
name = "small"
duration = "3s"
truth = "truth.toml"
belief = "belief.toml"
pressure_drop = [{ time = "0s", value = "2MPa" }, { time = "2s", value = "0MPa" }]
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

fn rig() -> Model {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rt-config/models/rig.toml");
    parse_model(&std::fs::read_to_string(path).unwrap(), path).unwrap()
}

#[track_caller]
fn check(text: &str, truth: &Model, belief: &Model) -> String {
    let scenario = parse_scenario(text, "x.toml").unwrap_or_else(|errors| panic!("{errors}"));
    check_against_models(&scenario, truth, belief, text, "x.toml")
        .map_or_else(|errors| errors.to_string(), |()| String::new())
}

#[track_caller]
fn set_points(set_points: &str) -> String {
    check(&format!("{SCENARIO}{set_points}"), &rig(), &rig())
}

/// The same with the angle limited to 0 … 0.5 rad.
#[track_caller]
fn limited(set_points: &str) -> String {
    let text = SCENARIO.replace("[limits]\n", "[limits]\nmin_angle = 0\nmax_angle = 0.5\n");
    check(&format!("{text}{set_points}"), &rig(), &rig())
}

#[test]
fn the_rig_can() {
    assert_eq!(check(SCENARIO, &rig(), &rig()), "");
    assert_eq!(set_points("[[set_point]]\ntime = 0\npulse_rate = \"200kHz\""), "");
}

#[test]
fn sections_needed() {
    let bare = Model { motor: None, load: None, ..rig() };
    let expected = "(bench rig, 2026), expected a model with [motor] and [load]";
    assert_eq!(
        check(SCENARIO, &bare, &Model { load: None, ..rig() }),
        format!(
            "x.toml:5:9: truth: found a model without [motor] {expected}\n\
             x.toml:5:9: truth: found a model without [load] {expected}\n\
             x.toml:6:10: belief: found a model without [load] {expected}"
        )
    );
}

#[test]
fn one_resolution() {
    let mut belief = rig();
    belief.motor.as_mut().unwrap().microsteps_per_full_step = 250;
    let errors = check(SCENARIO, &rig(), &belief);
    let expected = "expected 112500 as in the truth: the driver has one resolution";
    assert!(errors.starts_with(&format!(
        "x.toml:6:10: belief: found a motor of 125000 micro-steps a turn, {expected}"
    )));
}

#[test]
fn rates_of_driver_and_motor() {
    assert_eq!(
        check(&SCENARIO.replace("600kHz", "601kHz"), &rig(), &rig()),
        "x.toml:13:18: driver.max_pulse_rate: found 601 kHz, expected at most the motor's max_pulse_rate_hz, 600 kHz"
    );
    assert_eq!(
        check(&SCENARIO.replace("\"12rad/s\"", "\"1921deg/s\""), &rig(), &rig()),
        "x.toml:9:13: limits.max_speed: found 1921 deg/s, 600.312 kHz in pulses, expected at most 1920 deg/s, \
         driver.max_pulse_rate being 600 kHz"
    );
    assert_eq!(check(&SCENARIO.replace("\"12rad/s\"", "\"1920deg/s\""), &rig(), &rig()), "");
    // As the trajectory sees it, 600 kHz is an ulp above 1920deg/s.
    let rotation = format!("{SCENARIO}[[set_point]]\ntime = 0\npulse_rate = \"600kHz\"");
    let errors = check(&rotation.replace("\"12rad/s\"", "\"1920deg/s\""), &rig(), &rig());
    assert!(
        errors.starts_with("x.toml:21:14: set_point[0].pulse_rate: found 600kHz, 1920 deg/s"),
        "{errors}"
    );
    assert_eq!(check(&rotation.replace("\"12rad/s\"", "\"1920.1deg/s\""), &rig(), &rig()), "");
    assert_eq!(
        check(&SCENARIO.replace("400MHz/s", "10MHz/s"), &rig(), &rig()),
        "x.toml:10:20: limits.max_acceleration: found 1000 rad/s2, 17.9049 MHz/s in pulses, expected at most \
         558.505 rad/s2, driver.max_pulse_acceleration being 10 MHz/s"
    );
    assert_eq!(
        set_points("[[set_point]]\ntime = 0\npulse_rate = \"300kHz\""),
        "x.toml:21:14: set_point[0].pulse_rate: found 300kHz, 960 deg/s on the shaft, expected a speed within \
         limits.max_speed, 687.549 deg/s"
    );
}

#[test]
fn openings() {
    assert_eq!(limited("[[set_point]]\ntime = 0\nopening = 0.6"), "");
    assert_eq!(
        limited("[[set_point]]\ntime = 0\nopening = 0.7"),
        "x.toml:23:11: set_point[0].opening: found 0.7, which is at 31.5001 deg, expected an angle within [limits], \
         0 deg to 28.6479 deg"
    );
    let text = format!("{SCENARIO}[[set_point]]\ntime = 0\nopening = 0.6");
    let expected =
        "x.toml:21:11: set_point[0].opening: found an opening, expected a belief with [orifice], or an angle";
    assert_eq!(check(&text, &rig(), &Model { orifice: None, ..rig() }), expected);
}

#[test]
fn flows() {
    let flow = |time: &str, flow: &str, more: &str| {
        format!("[[set_point]]\ntime = {time}\nflow = \"{flow}\"\n{more}")
    };
    assert_eq!(set_points(&flow("0", "233L/min", "")), "");
    let place = "x.toml:21:8: set_point[0].flow: found";
    assert_eq!(
        set_points(&flow("0", "234L/min", "")),
        format!(
            "{place} 234L/min, expected at most 233.684 L/min, all that the open orifice lets through at 2 MPa"
        )
    );
    // Half the pressure is left after a second, none after two.
    assert!(set_points(&flow("1", "233L/min", "")).contains("at most 165.239 L/min"));
    assert_eq!(set_points(&flow("1", "233L/min", "pressure_drop = \"2MPa\"")), "");
    assert!(set_points(&flow("2", "1L/min", "")).contains("lets through at 0 Pa"));
    assert_eq!(set_points(&flow("2", "0L/min", "")), "");
    assert!(limited(&flow("0", "200L/min", "")).contains("200L/min, which is at 38."));
    let text = format!("{SCENARIO}{}", flow("0", "1L/min", ""));
    let expected = format!("{place} a flow, expected a belief with [orifice] and [oil], or an angle");
    assert_eq!(check(&text, &rig(), &Model { oil: None, ..rig() }), expected);
}

#[test]
fn a_sine_about_an_opening() {
    let sine = "[[set_point]]\ntime = 1\nsine = { amplitude = 0.2, frequency = 1 }";
    assert_eq!(limited(&format!("[[set_point]]\ntime = 0\nopening = 0.3\n{sine}")), "");
    let errors = limited(&format!("[[set_point]]\ntime = 0\nopening = 0.5\n{sine}"));
    assert!(
        errors.starts_with("x.toml:26:8: set_point[1].sine: found a sine from 11.0409 deg to 33.9592 deg"),
        "{errors}"
    );
}

#[test]
fn another_text_than_the_scenario_was_read_from_is_no_panic() {
    let scenario = parse_scenario(SCENARIO, "x.toml").unwrap();
    let bare = Model { motor: None, ..rig() };
    for text in ["", "truth = 1", "= broken"] {
        let errors = check_against_models(&scenario, &bare, &rig(), text, "x.toml").unwrap_err();
        assert_eq!(errors.errors()[0].line, 1);
    }
}

#[test]
fn a_belief_beyond_the_motor_is_warned_of() {
    let scenario = parse_scenario(SCENARIO, "x.toml").unwrap();
    assert_eq!(belief_warnings(&scenario, &rig()), Vec::<String>::new());
    let mut belief = rig();
    belief.motor.as_mut().unwrap().holding_torque_nm = 3.1;
    let warnings = belief_warnings(&scenario, &belief);
    assert!(
        warnings[0]
            .starts_with("the belief's friction takes up to 3.00 N·m, and the motor is asked for 2.91")
    );
}

#[test]
fn a_cycle_in_step_with_the_resonance_is_warned_of() {
    // 50 teeth, 6 N·m, 5e-4 kg·m²: 123.3 Hz, a period of 8.11 ms.
    for (period, in_step) in [
        ("1ms", false),
        ("4ms", false),
        ("7.2ms", false),
        ("7.4ms", true),
        ("8ms", true),
        ("8.9ms", true),
        ("9ms", false),
        ("10ms", false),
    ] {
        let beside = |compensation: &str, encoder: &str| {
            let text = SCENARIO.replace("duration", &format!("period = \"{period}\"\nduration"));
            let text = format!("{text}[compensation]\nlevel = \"{compensation}\"\n[encoder]\n{encoder}\n");
            let scenario = parse_scenario(&text, "x.toml").unwrap_or_else(|errors| panic!("{errors}"));
            belief_warnings(&scenario, &rig())
        };
        let fitted = |counts: u32| format!("fitted = true\ncounts_per_turn = {counts}");
        for encoder in ["fitted = false".to_owned(), fitted(4000)] {
            let warnings = beside("full", &encoder);
            assert_eq!(!warnings.is_empty(), in_step, "{period}, {encoder}: {warnings:?}");
            assert_eq!(beside("none", &encoder), Vec::<String>::new(), "{period}, {encoder}");
        }
        assert_eq!(beside("full", &fitted(20_000)), Vec::<String>::new(), "{period}");
    }
}
