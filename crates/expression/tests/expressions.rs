//! Values, errors with their places, poles, and what random texts and programs must never do.
#![allow(clippy::unwrap_used, missing_docs)]

use expression::{Dual, Interval, compile, free_names, pole};
use proptest::prelude::*;

const VARIABLES: [&str; 3] = ["speed", "angle", "pressure_drop"];
const RANGES: [(f64, f64); 3] = [(-50.0, 50.0), (-100.0, 100.0), (-5e7, 5e7)];

fn value(text: &str, at: [f64; 3]) -> f64 {
    let given: Vec<(&str, f64)> =
        [("a", 0.5), ("b", 3.0)].into_iter().filter(|(name, _)| uses(text, name)).collect();
    compile(text, &VARIABLES, &given).unwrap().run(&at)
}

/// Whether a word stands in a text by itself.
fn uses(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|found| found == word)
}

#[test]
fn values_follow_the_usual_rules() {
    let at = [-2.0, 0.3, 4e6];
    for (text, expected) in [
        ("a*speed*abs(speed)", -2.0),
        ("-speed^2", -4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("1 - 2 - 3", -4.0),
        ("8/4/2", 1.0),
        ("1.5e-3 * 1E3", 1.5),
        ("+ + 2", 2.0),
        ("sin(2*pi*angle + b)", (std::f64::consts::TAU * 0.3 + 3.0).sin()),
        ("max(0, cos(angle - b))^4", 0.0),
        ("sqrt(abs(pressure_drop)/1e6)", 2.0),
        ("atan2(1, 1)*4 + min(speed, 1) + hypot(3, 4) + sign(speed)", std::f64::consts::PI + 2.0),
        ("exp(ln(a)) + tanh(0) + acos(1) + asin(0) + atan(0) + tan(0)", 0.5),
    ] {
        assert!((value(text, at) - expected).abs() < 1e-12, "{text}: {}", value(text, at));
    }
}

#[test]
fn errors_say_where_what_and_what_else() {
    for (text, parameters, at, found, expected) in [
        ("", "", 0, "the end", "a number, a name or a bracket"),
        ("a*sped", "a", 2, "an unknown name `sped`", "speed (did you mean it?)"),
        ("c*speed", "", 0, "an unknown name `c`", "one of speed, angle"),
        ("cs(speed)", "", 0, "an unknown name `cs`", "cos (did you mean it?)"),
        ("speed*sin", "", 9, "the end", "`(` behind the function sin"),
        ("2*max(speed)", "", 2, "1 argument(s)", "2 of max"),
        ("abs(speed, 2)", "", 0, "2 argument(s)", "1 of abs"),
        ("abs()", "", 0, "0 argument(s)", "1 of abs"),
        ("(speed", "", 6, "the end", "`)`"),
        ("speed speed", "", 6, "`speed`", "an operator"),
        ("speed # 2", "", 6, "`#`", "a number"),
        ("speed ** 2", "", 7, "`*`", "a number, a name"),
        ("1.2.3", "", 0, "`1.2.3`", "a number"),
        ("speed*1e999", "", 6, "`1e999`", "a number"),
        ("speed", "a", 0, "a parameter `a` that is not in the expression", "uses"),
        ("sin*2", "sin", 0, "a parameter `sin`", "no function's"),
        ("speed", "speed", 0, "a parameter `speed`", "no variable's"),
        ("speed", "2a", 0, "a parameter `2a`", "no digit first"),
    ] {
        let given: Vec<(&str, f64)> = parameters.split_whitespace().map(|name| (name, 1.0)).collect();
        let error = compile(text, &VARIABLES, &given).unwrap_err();
        assert_eq!(error.at, at, "{text}: {error}");
        assert!(error.found.contains(found) && error.expected.contains(expected), "{text}: {error}");
    }
}

#[test]
fn length_and_depth_are_bounded() {
    let long = vec!["speed"; 33].join("+");
    assert!(compile(&long, &VARIABLES, &[]).unwrap_err().expected.contains("64"));
    assert!(compile(&vec!["speed"; 32].join("+"), &VARIABLES, &[]).is_ok());
    for text in ["(".repeat(400), "-".repeat(400), "abs(".repeat(100)] {
        assert!(compile(&text, &VARIABLES, &[]).unwrap_err().expected.contains("within each other"));
    }
    assert!(compile(&format!("speed{}", "^(speed".repeat(20)), &VARIABLES, &[]).is_err());
    assert!(compile(&" ".repeat(501), &VARIABLES, &[]).unwrap_err().expected.contains("500"));
}

#[test]
fn poles_are_found_and_only_poles() {
    for (text, at) in [
        ("1/speed", 1),
        ("2 + 1/(angle - 3.1)", 5),
        ("sqrt(speed)", 0),
        ("ln(abs(speed))", 0),
        ("speed^1.5", 5),
        ("speed^-1", 5),
        ("tan(angle)", 0),
        ("asin(speed)", 0),
        ("exp(exp(abs(speed)))", 0),
        ("speed/(speed^2 - angle)", 5),
    ] {
        let found = pole(&compile(text, &VARIABLES, &[]).unwrap(), &RANGES).map(|pole| pole.at);
        assert_eq!(found, Some(at), "{text}");
    }
    for text in [
        "speed*abs(speed)",
        "1/(1 + speed^2)",
        "speed/(abs(speed) + 0.001)",
        "sqrt(abs(speed)) + ln(1 + abs(angle)) + abs(speed)^1.5",
        "exp(-abs(speed)/0.05)",
        "tanh(speed/0.01) + atan2(speed, angle)",
        "max(0, cos(angle - 1))^8",
        "1/(speed*speed - 2*speed + 2)",
        "sqrt(1 - cos(angle))",
    ] {
        assert_eq!(pole(&compile(text, &VARIABLES, &[]).unwrap(), &RANGES), None, "{text}");
    }
}

/// Texts of expressions that are mostly right.
fn texts() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("speed".to_owned()),
        Just("angle".to_owned()),
        (-9.0..9.0f64).prop_map(|number| format!("({number:.2})")),
    ];
    leaf.prop_recursive(4, 24, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone(), "[-+*/^]").prop_map(|(a, b, sign)| format!("({a}{sign}{b})")),
            (inner.clone(), "(abs|sin|cos|exp|tanh|sqrt|atan|sign|ln|tan)")
                .prop_map(|(a, f)| format!("{f}({a})")),
            (inner.clone(), inner, "(min|max|hypot|atan2)").prop_map(|(a, b, f)| format!("{f}({a},{b})")),
        ]
    })
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in "[-+*/^(),.a-z0-9 ]{0,80}", other in ".{0,40}") {
        for text in [text, other] {
            if let Err(error) = compile(&text, &VARIABLES, &[]) {
                prop_assert!(error.at <= text.chars().count(), "{error}");
            }
        }
    }

    #[test]
    fn slopes_are_those_of_secants(text in texts(), speed in -5.0..5.0f64, angle in -5.0..5.0f64) {
        let Ok(program) = compile(&text, &VARIABLES, &[]) else { return Ok(()) };
        let at = [Dual::<2>::variable(speed, 0), Dual::variable(angle, 1), Dual { value: 0.0, slopes: [0.0; 2] }];
        let found = program.run(&at);
        let plain = |speed: f64, angle: f64| program.run(&[speed, angle, 0.0]);
        prop_assert!(found.value.to_bits() == plain(speed, angle).to_bits() || found.value.is_nan());
        prop_assert!(found.slopes.iter().all(|slope| slope.is_finite()));
        let (ahead, behind) =
            ((plain(speed + 1e-6, angle) - found.value) / 1e-6, (found.value - plain(speed - 1e-6, angle)) / 1e-6);
        // Only where both agree is there one slope.
        if (ahead - behind).abs() < 1e-3 && found.value.abs() < 1e3 && ahead.abs() < 1e2 {
            prop_assert!((found.slopes[0] - ahead).abs() < 2e-3 * (1.0 + ahead.abs()), "{text}: {found:?} {ahead}");
        }
    }

    #[test]
    fn intervals_hold_every_value(text in texts(), low in -5.0..5.0f64, width in 0.0..5.0f64, part in 0.0..1.0f64) {
        let Ok(program) = compile(&text, &VARIABLES, &[]) else { return Ok(()) };
        let range = Interval::new(low, low + width);
        let all = program.run(&[range, range, Interval::new(0.0, 0.0)]);
        let value = program.run(&[low + part * width, low + (1.0 - part) * width, 0.0]);
        if all.is_sound() {
            let slack = 1e-9 * (1.0 + value.abs());
            prop_assert!(all.low - slack <= value && value <= all.high + slack, "{text}: {value} {all:?}");
        }
    }
}

#[test]
fn names_that_are_free_are_parameters() {
    let free = |text: &str| free_names(text, &VARIABLES);
    assert_eq!(free("a*sin(2*pi*b*speed + a) + c_2").unwrap(), ["a", "b", "c_2"]);
    assert_eq!(free("speed*abs(angle)").unwrap(), Vec::<String>::new());
    let misspelt = free("a*sped").unwrap_err();
    assert_eq!((misspelt.at, misspelt.expected.starts_with("speed (did you mean it?)")), (2, true));
    assert_eq!(free("a # b").unwrap_err().at, 2);
}
