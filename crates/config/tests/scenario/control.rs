//! The controller's section: what it means, and what encoder and period allow.

use super::*;

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
    assert_eq!((s.control.observer_bandwidth_hz, s.control.observer_limit), (Some(50.0), 0.25));
    assert_eq!(s.safety.following_error_per_speed_s, 2e-3);
    assert_eq!(s.safety.lost_steps, LostSteps::Resynchronise);
}

#[test]
fn the_controller_takes_what_encoder_and_period_allow() {
    let control = |more: &str| parse_scenario(&format!("{SMALL}{more}"), "x").unwrap().control;
    let (blind, seen) = (control(""), control("[encoder]\nfitted = true"));
    assert_eq!((blind.observer, blind.damping), (false, Damping::None));
    assert_eq!((seen.observer, seen.damping), (true, Damping::Active));
    let coarse = control("[encoder]\nfitted = true\ncounts_per_turn = 4000");
    assert_eq!((coarse.observer, coarse.damping), (true, Damping::None));
    let told = "[encoder]\nfitted = true\ncounts_per_turn = 4000\n[compensation]\nlevel = \"full\"\ndamping = \"active\"";
    assert_eq!(control(told).damping, Damping::Active);
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
