//! The scenario's file, section by section.

use crate::asked::Visit;
use crate::bounds::{ANGLE, Bounds, PRESSURE};
use crate::error::ConfigErrors;
use crate::reader::{Section, asked as asked_of, parse};
use crate::scenario::read_control::read_compensation;
use crate::scenario::read_homing::read_homing;
use crate::scenario::read_set_points::{Frame, read_set_points};
use crate::scenario::read_timing::read_timing;
use crate::scenario::{
    AfterStop, Drive, Driver, Encoder, LostSteps, MotionLimits, Profile, Safety, Scenario, checks,
};
use crate::units::Dimension;

const FORMAT: &str = "stepvalve-scenario";
const FORMAT_VERSION: u64 = 1;

const PERIOD: Bounds = Bounds::within(1e-4, 1e-2);
const DURATION: Bounds = Bounds::positive(30.0 * 86_400.0);
const SPEED: Bounds = Bounds::positive(1e4);
const ACCELERATION: Bounds = Bounds::positive(1e7);
const JERK: Bounds = Bounds::positive(1e10);
const PULSE_RATE: Bounds = Bounds::positive(1e7);
const PULSE_ACCELERATION: Bounds = Bounds::positive(1e12);
const ENERGISE_TIME: Bounds = Bounds::within(0.0, 1.0);
/// 10°/s: slow enough to watch.
const DEFAULT_UNHOMED_SPEED_RAD_PER_S: f64 = 0.174_532_925_199_432_95;
const NOISE: Bounds = Bounds::within(0.0, 1.0);
const FOLLOWING_ERROR: Bounds = Bounds::positive(1e6);
const PER_SPEED: Bounds = Bounds::within(0.0, 10.0);
const TEMPERATURE: Bounds = Bounds::within(-60.0, 200.0);
const TIME: Bounds = Bounds::within(0.0, 30.0 * 86_400.0);

const DEFAULT_PERIOD_S: f64 = 1e-3;
const DEFAULT_OIL_TEMPERATURE_C: f64 = 40.0;
const DEFAULT_COUNTS_PER_TURN: u64 = 131_072;
/// The largest age of an encoder's reading, in cycles: as much as the controller keeps of its commands.
pub const LARGEST_ENCODER_DELAY_CYCLES: u64 = 16;
const DEFAULT_SILENCE_CYCLES: u64 = 3;

/// Reads a scenario from its text. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text: what does not parse, unknown keys, missing ones, values out of range, and set-points
/// that contradict the limits. What needs the models is checked by [`crate::check_against_models`].
pub fn parse_scenario(text: &str, file: &str) -> Result<Scenario, ConfigErrors> {
    parse(text, file, FORMAT, FORMAT_VERSION, |root| Some(read(root)))
}

/// What the reader asks of scenarios that together have every key.
pub(crate) fn asked() -> Vec<Visit> {
    // The fuzzer's corpus, which a test holds to have every key. What is a course in one is constant in the last, which has
    // no limits for bounds to come from, and the other processes' timing.
    let limited = include_str!("../../../../fuzz/corpus/configuration/limited.toml");
    let rotating = include_str!("../../../../fuzz/corpus/configuration/rotating.toml");
    let constant = "pressure_drop = 1\noil_temperature = [{ time = 0, value = 1 }]\n[driver]\nafter_stop = \"neutral\"\n\
                    [timing.trajectory-generator]\nphase = 1\ncore = 1\npriority = 1\n\
                    [timing.step-controller]\nphase = 1\ncore = 1\npriority = 1\n\
                    [timing.run-recorder]\nphase = 1\ncore = 1\npriority = 1\n";
    let texts = [limited, rotating, constant];
    texts.into_iter().flat_map(|text| asked_of(text, FORMAT, FORMAT_VERSION, read)).collect()
}

fn read(root: Section<'_>) -> Scenario {
    let name = root.text("name", "a name");
    let period_ns = read_period_ns(&root);
    let duration_s = read_duration_s(&root, period_ns);
    let limits = root.section("limits").map_or(NO_LIMITS, read_limits);
    let driver = root.section("driver").map_or(NO_DRIVER, |section| read_driver(section, &limits));
    let initial_angle_rad = read_initial_angle_rad(&root, &limits);
    let frame = Frame {
        period_ns,
        duration_s,
        limits,
        max_pulse_rate_hz: driver.max_pulse_rate_hz,
        initial_angle_rad,
    };
    let encoder = root.optional_section("encoder").map_or(NO_ENCODER, read_encoder);
    let (compensation, control) = read_compensation(&root, &encoder, period_ns);
    let scenario = Scenario {
        name,
        period_ns,
        duration_s,
        seed: root.integer_or("seed", 0..=i64::MAX as u64, 0),
        truth: root.text("truth", "the path of a model file"),
        belief: root.text("belief", "the path of a model file"),
        initial_angle_rad,
        limits,
        driver,
        encoder,
        safety: root.section("safety").map_or(NO_SAFETY, read_safety),
        homing: read_homing(&root, &encoder),
        compensation,
        control,
        loop_delay_cycles: root.integer_or("loop_delay_cycles", 1..=2, 1),
        drive: root.optional_section("drive").map(read_drive),
        timing: read_timing(&root, period_ns),
        pressure_drop: read_profile(&root, "pressure_drop", Dimension::Pressure, PRESSURE, 0.0),
        oil_temperature: read_profile(
            &root,
            "oil_temperature",
            Dimension::Temperature,
            TEMPERATURE,
            DEFAULT_OIL_TEMPERATURE_C,
        ),
        set_points: read_set_points(&root, &frame),
    };
    root.finish();
    scenario
}

// Placeholders for sections that are missing and reported; NaN and zero keep later checks silent.
const NO_LIMITS: MotionLimits = MotionLimits {
    min_angle_rad: None,
    max_angle_rad: None,
    max_speed_rad_per_s: f64::NAN,
    max_acceleration_rad_per_s2: f64::NAN,
    max_jerk_rad_per_s3: f64::NAN,
    unhomed_speed_rad_per_s: f64::NAN,
};
const NO_DRIVER: Driver = Driver {
    max_pulse_rate_hz: f64::NAN,
    max_pulse_acceleration_hz_per_s: f64::NAN,
    quick_stop_deceleration_hz_per_s: f64::NAN,
    after_stop: AfterStop::Hold,
    holds_when_disarmed: false,
    energise_time_s: 0.0,
};
const NO_SAFETY: Safety = Safety {
    silence_cycles: 0,
    max_following_error_rad: f64::NAN,
    following_error_per_speed_s: 0.0,
    lost_steps: LostSteps::Fault,
};

/// What a scenario without `[encoder]` means.
const NO_ENCODER: Encoder = Encoder {
    fitted: false,
    counts_per_turn: DEFAULT_COUNTS_PER_TURN,
    noise_rad: 0.0,
    delay_cycles: 0,
    absolute: false,
};

/// The period in nanoseconds; 0 if refused.
fn read_period_ns(root: &Section<'_>) -> u64 {
    let Some(field) = root.find("period") else { return (DEFAULT_PERIOD_S * 1e9) as u64 };
    let period_us = field.quantity(Dimension::Time, PERIOD) * 1e6;
    if period_us.is_nan() {
        return 0;
    }
    // A decimal such as 0.0003 is no exact double: a nano-part of a microsecond is what reading it costs.
    if (period_us - period_us.round()).abs() > 1e-6 {
        field.refuse("a whole number of microseconds");
        return 0;
    }
    period_us.round() as u64 * 1000
}

fn read_duration_s(root: &Section<'_>, period_ns: u64) -> f64 {
    let Some(field) = root.require("duration", &DURATION.describe(Dimension::Time)) else { return f64::NAN };
    let duration_s = field.quantity(Dimension::Time, DURATION);
    if duration_s < period_ns as f64 / 1e9 {
        let period = Dimension::Time.display(period_ns as f64 / 1e9);
        field.refuse(format!("at least one cycle of {period}"));
    }
    duration_s
}

fn read_initial_angle_rad(root: &Section<'_>, limits: &MotionLimits) -> f64 {
    let Some(field) = root.find("initial_angle") else {
        if !limits.contain_angle(0.0) {
            root.require("initial_angle", &checks::angle_within(limits));
        }
        return 0.0;
    };
    let angle_rad = field.quantity(Dimension::Angle, ANGLE);
    checks::refuse_angle_outside(&field, angle_rad, limits);
    angle_rad
}

fn read_limits(section: Section<'_>) -> MotionLimits {
    let min_angle_rad = section.optional_quantity("min_angle", Dimension::Angle, ANGLE);
    let max_angle = section.find("max_angle");
    let max_angle_rad = max_angle.as_ref().map(|field| field.quantity(Dimension::Angle, ANGLE));
    if let (Some(field), Some(min), Some(max)) = (max_angle, min_angle_rad, max_angle_rad)
        && max <= min
    {
        field.refuse(format!("an angle above min_angle, {}", Dimension::Angle.display(min)));
    }
    let max_speed_rad_per_s = section.quantity("max_speed", Dimension::Speed, SPEED);
    let unhomed = section.optional_quantity("unhomed_speed", Dimension::Speed, SPEED);
    let limits = MotionLimits {
        min_angle_rad,
        max_angle_rad,
        max_speed_rad_per_s,
        unhomed_speed_rad_per_s: unhomed.unwrap_or(DEFAULT_UNHOMED_SPEED_RAD_PER_S).min(max_speed_rad_per_s),
        max_acceleration_rad_per_s2: section.quantity(
            "max_acceleration",
            Dimension::Acceleration,
            ACCELERATION,
        ),
        max_jerk_rad_per_s3: section.quantity("max_jerk", Dimension::Jerk, JERK),
    };
    section.finish();
    limits
}

fn read_driver(section: Section<'_>, limits: &MotionLimits) -> Driver {
    let ramp = |key| section.quantity(key, Dimension::PulseAcceleration, PULSE_ACCELERATION);
    let driver = Driver {
        max_pulse_rate_hz: section.quantity("max_pulse_rate", Dimension::PulseRate, PULSE_RATE),
        max_pulse_acceleration_hz_per_s: ramp("max_pulse_acceleration"),
        quick_stop_deceleration_hz_per_s: ramp("quick_stop_deceleration"),
        after_stop: read_after_stop(&section, limits),
        holds_when_disarmed: section.find("holds_when_disarmed").is_some_and(|field| field.boolean()),
        energise_time_s: section
            .optional_quantity("energise_time", Dimension::Time, ENERGISE_TIME)
            .unwrap_or(0.0),
    };
    section.finish();
    driver
}

fn read_after_stop(section: &Section<'_>, limits: &MotionLimits) -> AfterStop {
    const NEUTRAL_KEYS: [&str; 2] = ["neutral_angle", "neutral_speed"];
    let words = [("de-energise", Some(AfterStop::DeEnergise)), ("neutral", None)];
    let field = section.require("after_stop", "\"hold\", \"de-energise\" or \"neutral\"");
    let chosen = field.and_then(|field| field.choice(("hold", Some(AfterStop::Hold)), &words));
    let Some(None) = chosen else {
        for key in section.present(&NEUTRAL_KEYS) {
            section.refuse_key(key, "a neutral angle", "none unless after_stop is \"neutral\"");
        }
        return chosen.flatten().unwrap_or(AfterStop::Hold);
    };
    if limits.min_angle_rad.is_none() || limits.max_angle_rad.is_none() {
        let expected = "min_angle and max_angle in [limits]: the way to the neutral angle has to have an end";
        section.refuse_key("after_stop", "\"neutral\" for a valve that turns without end", expected);
    }
    let angle_rad = section.quantity("neutral_angle", Dimension::Angle, ANGLE);
    if let Some(field) = section.find("neutral_angle") {
        checks::refuse_angle_outside(&field, angle_rad, limits);
    }
    let most = if limits.max_speed_rad_per_s > 0.0 { limits.max_speed_rad_per_s } else { 1e4 };
    let speed_rad_per_s = section.quantity("neutral_speed", Dimension::Speed, Bounds::within(1e-4, most));
    AfterStop::Neutral { angle_rad, speed_rad_per_s }
}

fn read_encoder(section: Section<'_>) -> Encoder {
    let encoder = Encoder {
        fitted: section.require("fitted", "true or false").is_some_and(|field| field.boolean()),
        counts_per_turn: section.integer_or("counts_per_turn", 4..=1 << 32, DEFAULT_COUNTS_PER_TURN),
        noise_rad: section.optional_quantity("noise", Dimension::Angle, NOISE).unwrap_or(0.0),
        delay_cycles: section.integer_or("delay_cycles", 0..=LARGEST_ENCODER_DELAY_CYCLES, 0),
        absolute: section.find("absolute").is_some_and(|field| field.boolean()),
    };
    section.finish();
    encoder
}

fn read_drive(section: Section<'_>) -> Drive {
    let drive = Drive {
        file: section.text("file", "the path of a drive file"),
        interface: section.text("interface", "the name of a network interface"),
    };
    section.finish();
    drive
}

fn read_safety(section: Section<'_>) -> Safety {
    let safety = Safety {
        silence_cycles: section.integer_or("silence_cycles", 1..=100_000, DEFAULT_SILENCE_CYCLES),
        max_following_error_rad: section.quantity("max_following_error", Dimension::Angle, FOLLOWING_ERROR),
        following_error_per_speed_s: section
            .optional_quantity("following_error_per_speed", Dimension::Time, PER_SPEED)
            .unwrap_or(0.0),
        lost_steps: section
            .find("lost_steps")
            .and_then(|field| {
                field.choice(("fault", LostSteps::Fault), &[("resynchronise", LostSteps::Resynchronise)])
            })
            .unwrap_or(LostSteps::Fault),
    };
    section.finish();
    safety
}

fn read_profile(
    root: &Section<'_>,
    key: &str,
    dimension: Dimension,
    bounds: Bounds,
    default: f64,
) -> Profile {
    let Some(field) = root.find(key) else { return Profile::constant(default) };
    if !field.is_array() {
        return Profile::constant(field.quantity(dimension, bounds));
    }
    let elements = field.elements();
    if elements.is_empty() {
        field.refuse_as("an empty list", "at least one { time, value }");
    }
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(elements.len());
    for element in elements {
        let Some(section) = element.section("{ time = …, value = … }") else { continue };
        let time = section.require("time", &TIME.describe(Dimension::Time));
        let time_s = time.as_ref().map_or(f64::NAN, |time| time.quantity(Dimension::Time, TIME));
        if let (Some(time), Some(&(before_s, _))) = (time, points.last())
            && time_s <= before_s
        {
            time.refuse(format!("a time after the point before, {}", Dimension::Time.display(before_s)));
        }
        points.push((time_s, section.quantity("value", dimension, bounds)));
        section.finish();
    }
    Profile { points }
}
