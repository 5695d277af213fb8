//! What can only be checked with the models at hand: whether the valve has what the scenario asks of it.

use valve_model::{Model, MotorParams};

use crate::error::ConfigErrors;
use crate::reachable::check_set_points;
use crate::reader::{Section, parse_document};
use crate::scenario::{Compensation, Scenario};
use crate::source::Source;
use crate::units::Dimension;

/// Checks a scenario against the models that it names. `text` and `file` are the scenario's, for the places of errors.
///
/// # Errors
/// A model without motor or load; motors of different resolution; a pulse rate beyond the motor's; limits of motion
/// beyond the driver's; an opening or flow without an orifice, or one that the orifice or the limits do not allow.
pub fn check_against_models(
    scenario: &Scenario,
    truth: &Model,
    belief: &Model,
    text: &str,
    file: &str,
) -> Result<(), ConfigErrors> {
    let source = Source::new(text, file);
    if let Some(document) = parse_document(text, &source) {
        let root = Section::root(&source, &document);
        check_sections(&root, "truth", truth);
        check_sections(&root, "belief", belief);
        if let (Some(truth_motor), Some(belief_motor)) = (&truth.motor, &belief.motor) {
            check_resolution(&root, truth_motor, belief_motor);
            check_motor_rate(&root, scenario, truth_motor, belief_motor);
            check_driver(&root, scenario, belief_motor.microstep_angle_rad());
        }
        check_set_points(&root, scenario, belief);
    }
    if source.is_clean() { Ok(()) } else { Err(source.into_errors()) }
}

/// The part of its holding torque that a motor is asked for: the sine of 70°, short of where it falls out of step.
const MOST_TORQUE: f64 = 0.94;

/// How near a cycle must be to whole periods of the resonance, in periods, for the kicks of one cycle and the next to add up: at a tenth
/// two of them make 1.9 times one's ringing.
const IN_STEP: f64 = 0.1;
/// With so many counts of the encoder for each of the motor's teeth no run of docs/robustness.md (20,000 counts a turn, 50 teeth) was worse than
/// without compensation; with a fifth of them one was.
const SEES_RINGING: u64 = 400;

/// What a belief allows but may surprise: one sentence each.
#[must_use]
pub fn belief_warnings(scenario: &Scenario, belief: &Model) -> Vec<String> {
    [beyond_the_motor(scenario, belief), in_step_with_the_resonance(scenario, belief)]
        .into_iter()
        .flatten()
        .collect()
}

fn beyond_the_motor(scenario: &Scenario, belief: &Model) -> Option<String> {
    let motor = belief.motor.as_ref()?;
    let speed = scenario.limits.max_speed_rad_per_s;
    let (starting_nm, sliding_nm) =
        (belief.friction.steady_torque(f64::MIN_POSITIVE), belief.friction.steady_torque(speed));
    let (friction_nm, most_nm) = (starting_nm.max(sliding_nm), MOST_TORQUE * motor.holding_torque_nm);
    (friction_nm > most_nm).then(|| {
        format!(
            "the belief's friction takes up to {friction_nm:.2} N·m, and the motor is asked for {most_nm:.2} N·m at most: \
             compensation will be cut, and motion slowed down"
        )
    })
}

/// What friction changes in the command at each cycle makes the rotor ring, most of all if each finds it where the last one did;
/// docs/robustness.md has the runs.
fn in_step_with_the_resonance(scenario: &Scenario, belief: &Model) -> Option<String> {
    let teeth = belief.motor.map_or(0, |motor| u64::from(motor.rotor_teeth));
    let sees_it = scenario.encoder.fitted && scenario.encoder.counts_per_turn >= SEES_RINGING * teeth;
    if scenario.compensation == Compensation::None || sees_it {
        return None;
    }
    let resonance_hz = belief.resonance_hz()?;
    let periods = scenario.period_s() * resonance_hz;
    (periods > 0.5 && (periods - periods.round()).abs() < IN_STEP).then(|| {
        format!(
            "a cycle of {:.3} ms is {periods:.2} periods of the resonance at {resonance_hz:.0} Hz: without an encoder of {} counts a turn a \
             peak of the following error may be larger than without compensation; a cycle of {:.3} ms is not in step with it",
            1e3 * scenario.period_s(),
            SEES_RINGING * teeth,
            0.5e3 / resonance_hz
        )
    })
}

fn microsteps_per_turn(motor: &MotorParams) -> f64 {
    f64::from(motor.full_steps_per_rev) * f64::from(motor.microsteps_per_full_step)
}

/// Reports something at a key of the root, or of a section of it.
fn refuse(root: &Section<'_>, section: Option<&str>, key: &str, found: String, expected: String) {
    let field = match section {
        Some(section) => root.optional_section(section).and_then(|section| section.find(key)),
        None => root.find(key),
    };
    match field {
        Some(field) => field.refuse_as(found, expected),
        None => root.refuse_key(key, found, expected),
    }
}

fn check_sections(root: &Section<'_>, key: &str, model: &Model) {
    let sections = [("[motor]", model.motor.is_some()), ("[load]", model.load.is_some())];
    for (section, _) in sections.into_iter().filter(|(_, present)| !present) {
        let found = format!("a model without {section} ({})", model.name);
        refuse(root, None, key, found, "a model with [motor] and [load]".to_owned());
    }
}

fn check_resolution(root: &Section<'_>, truth: &MotorParams, belief: &MotorParams) {
    let (true_steps, believed_steps) = (microsteps_per_turn(truth), microsteps_per_turn(belief));
    if true_steps != believed_steps {
        let found = format!("a motor of {believed_steps} micro-steps a turn");
        refuse(
            root,
            None,
            "belief",
            found,
            format!("{true_steps} as in the truth: the driver has one resolution"),
        );
    }
}

fn check_motor_rate(root: &Section<'_>, scenario: &Scenario, truth: &MotorParams, belief: &MotorParams) {
    let highest_hz = truth.max_pulse_rate_hz.min(belief.max_pulse_rate_hz);
    let rate_hz = scenario.driver.max_pulse_rate_hz;
    if rate_hz > highest_hz {
        let expected =
            format!("at most the motor's max_pulse_rate_hz, {}", Dimension::PulseRate.display(highest_hz));
        refuse(root, Some("driver"), "max_pulse_rate", Dimension::PulseRate.display(rate_hz), expected);
    }
}

/// A limit in degrees or radians is seldom a round pulse rate: the hair that it exceeds the driver's by is no error.
const DRIVER_TOLERANCE: f64 = 1e-4;

/// The trajectory may not ask for more than the driver gives, else the driver's limit would bend every fast motion.
fn check_driver(root: &Section<'_>, scenario: &Scenario, microstep_rad: f64) {
    let (limits, driver) = (&scenario.limits, &scenario.driver);
    let pairs = [
        (
            ("max_speed", limits.max_speed_rad_per_s, Dimension::Speed),
            ("max_pulse_rate", driver.max_pulse_rate_hz, Dimension::PulseRate),
        ),
        (
            ("max_acceleration", limits.max_acceleration_rad_per_s2, Dimension::Acceleration),
            ("max_pulse_acceleration", driver.max_pulse_acceleration_hz_per_s, Dimension::PulseAcceleration),
        ),
    ];
    for ((key, limit, dimension), (driver_key, driver_limit, pulse_dimension)) in pairs {
        let in_pulses = limit / microstep_rad;
        if in_pulses > driver_limit * (1.0 + DRIVER_TOLERANCE) {
            let found =
                format!("{}, {} in pulses", dimension.display(limit), pulse_dimension.display(in_pulses));
            let highest = dimension.display(driver_limit * microstep_rad);
            let driver_limit = pulse_dimension.display(driver_limit);
            let expected = format!("at most {highest}, driver.{driver_key} being {driver_limit}");
            refuse(root, Some("limits"), key, found, expected);
        }
    }
}
