//! Whole files: all errors at once, where they stand, and what is no scenario at all.

use super::*;

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
    assert_eq!(errors, "x.toml:7:1: found a mistake of syntax (duplicate key), expected valid TOML");
    for (value, told) in [("50deg", "50deg"), ("-1.5 rad/s # fast", "-1.5 rad/s"), ("40L/min", "40L/min")] {
        let errors = errors_of(FULL, "seed = 42", &format!("seed = {value}")).to_string();
        assert!(errors.lines().all(|line| line.starts_with("x.toml:6:")), "{errors}");
        assert!(errors.contains(&format!("found {told}, expected quotes: \"{told}\"")), "{errors}");
    }
    let prose = "some words\nand = more = of them\n".repeat(50);
    let errors = parse_scenario(&prose, "x.toml").unwrap_err().to_string();
    assert!(errors.lines().count() <= 5, "{errors}");
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
