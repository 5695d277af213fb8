//! What is known of the zero, and when the motor has current: their keys, ranges and defaults.

use super::{SMALL, refused};
use config::{Homing, HomingMethod, Scenario, parse_scenario};

fn scenario(text: &str) -> Scenario {
    parse_scenario(text, "x.toml").unwrap_or_else(|errors| panic!("{errors}"))
}

fn limited() -> &'static str {
    include_str!("../../../../fuzz/corpus/configuration/limited.toml")
}

#[test]
fn they_mean_what_they_say() {
    let limited = scenario(limited());
    let degrees = |angle_rad: f64| (angle_rad.to_degrees() * 1e6).round() / 1e6;
    assert_eq!(degrees(limited.limits.unhomed_speed_rad_per_s), 5.0);
    assert!(limited.driver.holds_when_disarmed);
    assert_eq!(limited.driver.energise_time_s, 0.02);
    assert!(limited.encoder.absolute);
    assert!(!limited.homing.begins_homed);
    let search = limited.homing.search.unwrap();
    assert_eq!(search.method, HomingMethod::Stop);
    assert_eq!(degrees(search.speed_rad_per_s), -10.0);
    assert_eq!((degrees(search.angle_rad), degrees(search.longest_rad)), (-4.0, 90.0));
    assert_eq!((search.stop_current, search.largest_spread_rad), (0.6, 3e-3));
    let marks = limited.homing.marks;
    let angles = [marks.switch_angle_rad, marks.index_angle_rad, marks.low_stop_rad, marks.high_stop_rad];
    assert_eq!(angles.map(|angle| angle.map(degrees)), [Some(-3.0), Some(1.0), Some(-6.0), Some(55.0)]);
}

#[test]
fn without_them_a_run_begins_homed_and_a_disarmed_motor_has_no_current() {
    let small = scenario(SMALL);
    assert_eq!(small.homing.search, None);
    assert!(small.homing.begins_homed && !small.encoder.absolute);
    assert!(!small.driver.holds_when_disarmed);
    assert_eq!(small.driver.energise_time_s, 0.0);
    assert!((small.limits.unhomed_speed_rad_per_s.to_degrees() - 10.0).abs() < 1e-9);
    let marked = scenario(&format!("{SMALL}[homing]\n"));
    assert_eq!(marked.homing, Homing { ..small.homing });
}

#[test]
fn slow_jogging_is_never_faster_than_the_reference_may_be() {
    let slow = SMALL.replace("max_speed = \"12rad/s\"", "max_speed = \"1deg/s\"");
    assert!((scenario(&slow).limits.unhomed_speed_rad_per_s.to_degrees() - 1.0).abs() < 1e-9);
}

#[test]
fn out_of_range_or_without_what_they_need() {
    for (from, to, expected) in [
        (
            "\"20ms\"",
            "\"2s\"",
            "x.toml:31:17: driver.energise_time: found 2s, expected a time from 0 s to 1 s",
        ),
        (
            "holds_when_disarmed = true",
            "holds_when_disarmed = 1",
            "x.toml:30:23: driver.holds_when_disarmed: found 1, expected true or false",
        ),
        (
            "\"-10deg/s\"",
            "0",
            "x.toml:50:9: homing.speed: found 0, expected a speed; its sign says in which direction the mark is",
        ),
        (
            "stop_current = 0.6",
            "stop_current = 0.01",
            "x.toml:52:16: homing.stop_current: found 0.01, expected a ratio from 0.05 to 1",
        ),
        (
            "\"3mrad\"",
            "\"1rad\"",
            "x.toml:53:18: homing.largest_spread: found 1rad, expected an angle above 0 rad and at most 0.1 rad",
        ),
        (
            "method = \"stop\"",
            "method = \"bump\"",
            "x.toml:48:10: homing.method: found bump, expected \"switch\" or \"stop\" or \"index\" or \"absolute\"",
        ),
    ] {
        refused(limited(), from, to, expected);
    }
}
