//! Keys and values: ranges, kinds, what is missing and what is unknown.

use super::*;

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
    let keys = "fitted, counts_per_turn, noise, delay_cycles, absolute";
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
fn a_word_that_is_nearly_a_known_one_is_answered_with_it() {
    let of = |word: &str| errors_of(FULL, "\"coulomb-viscous\"", word).to_string();
    let near = of("\"ful\"");
    assert!(
        near.contains(
            "compensation.level: found ful, expected \"full\" (did you mean it?) or one of \"none\", "
        ),
        "{near}"
    );
    let far = of("\"everything\"");
    assert!(far.contains("expected \"none\" or \"coulomb-viscous\" or "), "{far}");
}
