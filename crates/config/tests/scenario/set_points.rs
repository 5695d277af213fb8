//! Set-points: their order in time, their targets, and the limits that these lie within.

use super::*;

#[test]
fn angles_outside_the_limits() {
    let limits = "an angle within [limits], 0 deg to 45 deg";
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
        let within = "an angle within [limits], 0 deg to -45 deg";
        let mut lines = vec!["x.toml:9:17: initial_angle: found 10deg, expected ".to_owned() + within];
        lines.push(
            "x.toml:16:13: limits.max_angle: found -45deg, expected an angle above min_angle, 0 deg"
                .to_owned(),
        );
        lines.push("x.toml:50:9: set_point[0].angle: found 17deg, expected ".to_owned() + within);
        lines.push(
            "x.toml:67:9: set_point[4].angle: found 0.3, which is 0.3 rad without a unit, expected "
                .to_owned()
                + within,
        );
        lines.push(
            "x.toml:71:8: set_point[5].sine: found a sine from 5.72958 deg to 28.6479 deg, expected "
                .to_owned()
                + within,
        );
        lines.join("\n")
    });
}

#[test]
fn an_angle_without_a_unit_is_told_to_be_in_rad() {
    let says = "found 40, which is 40 rad without a unit, expected an angle within [limits], 0 deg to 45 deg";
    refused(FULL, "\"17deg\"", "40", &format!("x.toml:50:9: set_point[0].angle: {says}"));
}

#[test]
fn an_initial_angle_of_zero_must_be_allowed() {
    let text = SMALL.replace("[limits]", "[limits]\nmin_angle = 0.5");
    let errors = parse_scenario(&text, "x.toml").unwrap_err().to_string();
    assert_eq!(
        errors,
        "x.toml:1:1: initial_angle: found nothing, expected an angle within [limits], 28.6479 deg to unlimited"
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
        "x.toml:20:9: set_point[0].speed: found -13, expected a speed within limits.max_speed, 687.549 deg/s";
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
        &format!("{place} a peak speed of 720 deg/s, expected at most limits.max_speed, 687.549 deg/s"),
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
        "x.toml:71:8: set_point[5].sine: found a sine from -0.572958 deg to 34.9504 deg, expected an angle within [limits], 0 deg to 45 deg",
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
