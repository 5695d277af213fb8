//! `[[set_point]]`: what the valve shall do, by time.

use crate::bounds::{ANGLE, Bounds, PRESSURE};
use crate::reader::{Field, Section};
use crate::scenario::{FlowPressure, MotionLimits, ScheduledSetPoint, SetPoint, checks};
use crate::units::Dimension;

const KINDS: &[&str] = &["angle", "opening", "flow", "speed", "pulse_rate", "sine", "hold"];
const TIME: Bounds = Bounds::within(0.0, 30.0 * 86_400.0);
const OPENING: Bounds = Bounds::within(0.0, 1.0);
const FLOW: Bounds = Bounds::within(0.0, 1.0);
const SPEED: Bounds = Bounds::either_sign(1e4);
const PULSE_RATE: Bounds = Bounds::either_sign(1e7);
const AMPLITUDE: Bounds = Bounds::positive(1e6);
const FREQUENCY: Bounds = Bounds::positive(5e3);

/// What set-points are checked against.
pub(super) struct Frame {
    pub(super) period_ns: u64,
    pub(super) duration_s: f64,
    pub(super) limits: MotionLimits,
    pub(super) max_pulse_rate_hz: f64,
    pub(super) initial_angle_rad: f64,
}

/// Reads all set-points, in the order of their times.
pub(super) fn read_set_points(root: &Section<'_>, frame: &Frame) -> Vec<ScheduledSetPoint> {
    let mut set_points = Vec::new();
    let mut before_s = f64::NEG_INFINITY;
    let mut rest_angle_rad = Some(frame.initial_angle_rad);
    for field in root.list("set_point") {
        let Some(section) = field.section("a table [[set_point]]") else { continue };
        let time_s = read_time_s(&section, before_s, frame.duration_s);
        if let Some(set_point) = read_set_point(&section, frame, rest_angle_rad) {
            rest_angle_rad = rest_after(&set_point, rest_angle_rad);
            set_points.push(ScheduledSetPoint { time_s, set_point, line: field.line() });
        }
        section.finish();
        before_s = before_s.max(time_s);
    }
    set_points
}

/// Where the valve rests after a set-point, as far as that is known without the models.
fn rest_after(set_point: &SetPoint, before_rad: Option<f64>) -> Option<f64> {
    match *set_point {
        SetPoint::Angle { angle_rad } => Some(angle_rad),
        SetPoint::Hold => before_rad,
        _ => None,
    }
}

fn read_time_s(section: &Section<'_>, before_s: f64, duration_s: f64) -> f64 {
    let Some(field) = section.require("time", &TIME.describe(Dimension::Time)) else { return f64::NAN };
    let time_s = field.quantity(Dimension::Time, TIME);
    if time_s <= before_s {
        field.refuse(format!("a time after the set-point before, {}", Dimension::Time.display(before_s)));
    } else if time_s >= duration_s {
        field.refuse(format!("a time before the scenario's end, {}", Dimension::Time.display(duration_s)));
    }
    time_s
}

fn read_set_point(section: &Section<'_>, frame: &Frame, rest_angle_rad: Option<f64>) -> Option<SetPoint> {
    let present = section.present(KINDS);
    let [kind] = present.as_slice() else {
        let found = if present.is_empty() { "nothing".to_owned() } else { present.join(" and ") };
        section.refuse(found, format!("exactly one of {}", KINDS.join(", ")));
        section.find("pressure_drop");
        return None;
    };
    let field = section.find(kind)?;
    let pressure = section.find("pressure_drop");
    if let (Some(pressure), true) = (&pressure, *kind != "flow") {
        pressure.refuse_as(format!("a pressure drop beside {kind}"), "one beside flow only");
    }
    match *kind {
        "angle" => Some(read_angle(&field, frame)),
        "opening" => Some(SetPoint::Opening { opening: field.quantity(Dimension::Ratio, OPENING) }),
        "flow" => Some(read_flow(&field, pressure.as_ref())),
        "speed" => Some(read_speed(&field, frame)),
        "pulse_rate" => Some(read_pulse_rate(&field, frame)),
        "sine" => read_sine(&field, frame, rest_angle_rad),
        _ => read_hold(&field),
    }
}

fn read_angle(field: &Field<'_>, frame: &Frame) -> SetPoint {
    let angle_rad = field.quantity(Dimension::Angle, ANGLE);
    checks::refuse_angle_outside(field, angle_rad, &frame.limits);
    SetPoint::Angle { angle_rad }
}

fn read_flow(field: &Field<'_>, pressure: Option<&Field<'_>>) -> SetPoint {
    let given = |field: &Field<'_>| FlowPressure::Given(field.quantity(Dimension::Pressure, PRESSURE));
    SetPoint::Flow {
        flow_m3_per_s: field.quantity(Dimension::Flow, FLOW),
        pressure_drop: pressure.map_or(FlowPressure::Measured, given),
    }
}

fn refuse_rotation_in_limits(field: &Field<'_>, limits: &MotionLimits) {
    if limits.position_limited() {
        field.refuse_as(
            format!("rotation without end at {}", field.found()),
            "no min_angle and no max_angle in [limits], or a set-point of another kind",
        );
    }
}

fn read_speed(field: &Field<'_>, frame: &Frame) -> SetPoint {
    let speed_rad_per_s = field.quantity(Dimension::Speed, SPEED);
    refuse_rotation_in_limits(field, &frame.limits);
    let limit = frame.limits.max_speed_rad_per_s;
    if speed_rad_per_s.abs() > limit {
        field.refuse(format!("a speed within limits.max_speed, {}", Dimension::Speed.display(limit)));
    }
    SetPoint::Speed { speed_rad_per_s }
}

fn read_pulse_rate(field: &Field<'_>, frame: &Frame) -> SetPoint {
    let pulse_rate_hz = field.quantity(Dimension::PulseRate, PULSE_RATE);
    refuse_rotation_in_limits(field, &frame.limits);
    let limit = frame.max_pulse_rate_hz;
    if pulse_rate_hz.abs() > limit {
        field.refuse(format!(
            "a pulse rate within driver.max_pulse_rate, {}",
            Dimension::PulseRate.display(limit)
        ));
    }
    SetPoint::PulseRate { pulse_rate_hz }
}

fn read_sine(field: &Field<'_>, frame: &Frame, rest_angle_rad: Option<f64>) -> Option<SetPoint> {
    let section = field.section("{ amplitude = …, frequency = … }")?;
    let amplitude_rad = section.quantity("amplitude", Dimension::Angle, AMPLITUDE);
    let frequency_hz = section.quantity("frequency", Dimension::Frequency, FREQUENCY);
    section.finish();
    for (found, expected) in checks::sine_beyond_limits(amplitude_rad, frequency_hz, &frame.limits) {
        field.refuse_as(found, expected);
    }
    if frequency_hz * frame.period_ns as f64 / 1e9 > 0.1 {
        field
            .refuse_as("a sine with fewer than ten cycles a period", "a lower frequency or a shorter period");
    }
    if let Some(centre_rad) = rest_angle_rad {
        checks::refuse_sine_outside(field, centre_rad, amplitude_rad, &frame.limits);
    }
    Some(SetPoint::Sine { amplitude_rad, frequency_hz })
}

fn read_hold(field: &Field<'_>) -> Option<SetPoint> {
    let hold = field.boolean();
    if !hold {
        field.refuse("true");
    }
    hold.then_some(SetPoint::Hold)
}
