//! Whether the set-points can be reached with the orifice and motor that the controller believes in.

use valve_model::Model;

use crate::reader::{Field, Section};
use crate::scenario::{
    FlowPressure, Scenario, ScheduledSetPoint, SetPoint, angle_outside, angle_within, refuse_sine_outside,
};
use crate::units::Dimension;

/// Checks each set-point against the belief: it is what the trajectory computes angles with.
pub(crate) fn check_set_points(root: &Section<'_>, scenario: &Scenario, belief: &Model) {
    let mut rest_angle_rad = Some(scenario.initial_angle_rad);
    for (field, set_point) in root.list("set_point").iter().zip(&scenario.set_points) {
        let Some(section) = field.section("a table [[set_point]]") else { continue };
        check_set_point(&section, scenario, belief, set_point, rest_angle_rad);
        rest_angle_rad = rest_after(&set_point.set_point, belief, rest_angle_rad);
    }
}

fn check_set_point(
    section: &Section<'_>,
    scenario: &Scenario,
    belief: &Model,
    set_point: &ScheduledSetPoint,
    rest_angle_rad: Option<f64>,
) {
    match set_point.set_point {
        SetPoint::Opening { opening } => check_opening(section, scenario, belief, opening),
        SetPoint::Flow { flow_m3_per_s, pressure_drop } => {
            let pressure_drop_pa = match pressure_drop {
                FlowPressure::Given(pressure_drop_pa) => pressure_drop_pa,
                FlowPressure::Measured => scenario.pressure_drop.at(set_point.time_s),
            };
            check_flow(section, scenario, belief, flow_m3_per_s, pressure_drop_pa);
        }
        SetPoint::PulseRate { pulse_rate_hz } => check_pulse_rate(section, scenario, belief, pulse_rate_hz),
        SetPoint::Sine { amplitude_rad, .. } => {
            if let (Some(field), Some(centre_rad)) = (section.find("sine"), rest_angle_rad) {
                refuse_sine_outside(&field, centre_rad, amplitude_rad, &scenario.limits);
            }
        }
        SetPoint::Angle { .. } | SetPoint::Speed { .. } | SetPoint::Hold => {}
    }
}

/// Where the valve rests after a set-point, as far as that is known beforehand.
fn rest_after(set_point: &SetPoint, belief: &Model, before_rad: Option<f64>) -> Option<f64> {
    match *set_point {
        SetPoint::Angle { angle_rad } => Some(angle_rad),
        SetPoint::Opening { opening } => belief.orifice.map(|orifice| orifice.angle_for_opening(opening)),
        SetPoint::Hold => before_rad,
        _ => None,
    }
}

fn refuse_angle(field: &Field<'_>, scenario: &Scenario, angle_rad: f64) {
    if angle_outside(angle_rad, &scenario.limits) {
        let found = format!("{}, which is at {}", field.found(), Dimension::Angle.display(angle_rad));
        field.refuse_as(found, angle_within(&scenario.limits));
    }
}

fn check_opening(section: &Section<'_>, scenario: &Scenario, belief: &Model, opening: f64) {
    let Some(field) = section.find("opening") else { return };
    match belief.orifice {
        Some(orifice) => refuse_angle(&field, scenario, orifice.angle_for_opening(opening)),
        None => field.refuse_as("an opening", "a belief with [orifice], or an angle"),
    }
}

fn check_flow(
    section: &Section<'_>,
    scenario: &Scenario,
    belief: &Model,
    flow_m3_per_s: f64,
    pressure_drop_pa: f64,
) {
    let Some(field) = section.find("flow") else { return };
    let (Some(orifice), Some(oil)) = (belief.orifice, belief.oil) else {
        field.refuse_as("a flow", "a belief with [orifice] and [oil], or an angle");
        return;
    };
    let density = oil.density_kg_per_m3;
    match orifice.angle_for_flow(flow_m3_per_s, pressure_drop_pa, density) {
        Ok(angle_rad) => refuse_angle(&field, scenario, angle_rad),
        Err(_) => {
            let most_m3_per_s = orifice.flow_m3_per_s(orifice.open_angle_rad, pressure_drop_pa, density);
            let pressure = Dimension::Pressure.display(pressure_drop_pa);
            let most = Dimension::Flow.display(most_m3_per_s);
            field.refuse(format!("at most {most}, all that the open orifice lets through at {pressure}"));
        }
    }
}

fn check_pulse_rate(section: &Section<'_>, scenario: &Scenario, belief: &Model, pulse_rate_hz: f64) {
    let (Some(field), Some(motor)) = (section.find("pulse_rate"), belief.motor) else { return };
    // Exactly as the trajectory compares: a scenario that passes here is not refused while it runs.
    let speed_rad_per_s = pulse_rate_hz.abs() * motor.microstep_angle_rad();
    let limit = scenario.limits.max_speed_rad_per_s;
    if speed_rad_per_s > limit {
        let found = format!("{}, {} on the shaft", field.found(), Dimension::Speed.display(speed_rad_per_s));
        field.refuse_as(
            found,
            format!("a speed within limits.max_speed, {}", Dimension::Speed.display(limit)),
        );
    }
}
