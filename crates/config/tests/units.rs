//! Quantities with units, as a user may write them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::f64::consts::PI;

use config::Dimension::{self, *};
use config::parse_quantity;
use proptest::prelude::*;

#[track_caller]
fn reads(text: &str, dimension: Dimension, expected: f64) {
    let value = parse_quantity(text, dimension).unwrap_or_else(|error| panic!("{text}: {error}"));
    let tolerance = expected.abs() * 4.0 * f64::EPSILON;
    assert!((value - expected).abs() <= tolerance, "{text}: {value} instead of {expected}");
}

#[test]
fn every_unit() {
    let cases = [
        ("2s", Time, 2.0),
        ("1ms", Time, 1e-3),
        ("250us", Time, 250e-6),
        ("250µs", Time, 250e-6),
        ("40ns", Time, 40e-9),
        ("3min", Time, 180.0),
        ("2h", Time, 7200.0),
        ("30d", Time, 2_592_000.0),
        ("0.5rad", Angle, 0.5),
        ("5mrad", Angle, 5e-3),
        ("17deg", Angle, 17.0 * PI / 180.0),
        ("2turn", Angle, 4.0 * PI),
        ("11.17rad/s", Speed, 11.17),
        ("90deg/s", Speed, PI / 2.0),
        ("60rpm", Speed, 2.0 * PI),
        ("2000rad/s2", Acceleration, 2000.0),
        ("2000rad/s^2", Acceleration, 2000.0),
        ("180deg/s2", Acceleration, PI),
        ("180deg/s^2", Acceleration, PI),
        ("2.4e5rad/s3", Jerk, 2.4e5),
        ("2.4e5rad/s^3", Jerk, 2.4e5),
        ("180deg/s3", Jerk, PI),
        ("180deg/s^3", Jerk, PI),
        ("40L/min", Flow, 40.0 / 60_000.0),
        ("0.002m3/s", Flow, 0.002),
        ("5mL/s", Flow, 5e-6),
        ("7Pa", Pressure, 7.0),
        ("7kPa", Pressure, 7e3),
        ("2MPa", Pressure, 2e6),
        ("200bar", Pressure, 2e7),
        ("-5degC", Temperature, -5.0),
        ("40°C", Temperature, 40.0),
        ("1Hz", Frequency, 1.0),
        ("1kHz", Frequency, 1e3),
        ("1MHz", Frequency, 1e6),
        ("200mHz", Frequency, 0.2),
        ("10Hz", PulseRate, 10.0),
        ("200kHz", PulseRate, 2e5),
        ("0.6MHz", PulseRate, 6e5),
        ("7Hz/s", PulseAcceleration, 7.0),
        ("7kHz/s", PulseAcceleration, 7e3),
        ("40MHz/s", PulseAcceleration, 4e7),
        ("0.5", Ratio, 0.5),
        ("50%", Ratio, 0.5),
    ];
    for (text, dimension, expected) in cases {
        reads(text, dimension, expected);
    }
}

#[test]
fn signs_exponents_and_blanks() {
    reads("-17deg", Angle, -17.0 * PI / 180.0);
    reads("+1.5e-3 rad", Angle, 1.5e-3);
    reads("  -2E2\tkHz ", PulseRate, -2e5);
    reads(".5s", Time, 0.5);
}

#[test]
fn decimals_become_the_nearest_double() {
    for (text, expected) in [("0.1ms", 1e-4), ("3ms", 0.003), ("250us", 0.000_25), ("700ns", 7e-7)] {
        assert_eq!(parse_quantity(text, Time).unwrap(), expected, "{text}");
    }
}

#[test]
fn refused() {
    for text in [
        "",
        " ",
        "deg",
        "17",
        "17 degrees",
        "17s",
        "1e999deg",
        "nandeg",
        "infrad",
        "1e",
        "--1deg",
        "1.2.3deg",
    ] {
        let error = parse_quantity(text, Angle).expect_err(text);
        assert!(error.expected.contains("rad, mrad, deg, turn"), "{error}");
    }
    // The number is finite, its value in SI is not.
    assert!(parse_quantity("1e308turn", Angle).is_err());
    assert!(parse_quantity("5e307h", Time).is_err());
    assert_eq!(
        parse_quantity("17s", Angle).unwrap_err().to_string(),
        "found 17s, expected an angle with a unit (rad, mrad, deg, turn, °)"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_finite_number_reads_back(number in proptest::num::f64::NORMAL) {
        prop_assert_eq!(parse_quantity(&format!("{number:?}rad"), Angle).unwrap(), number);
    }

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,40}") {
        for dimension in [Time, Angle, Speed, Flow, Pressure, Temperature, Frequency, PulseRate, Ratio] {
            if let Ok(value) = parse_quantity(&text, dimension) {
                prop_assert!(value.is_finite());
            }
        }
    }
}
