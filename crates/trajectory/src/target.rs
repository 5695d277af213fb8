//! From a set-point in its own quantity to an angle.

use signals::{HeldFlow, SetPoint, SetPointKind, SetPointRefusal};
use valve_model::OrificeError;

use crate::Params;

/// The angle that an angle, opening or flow set-point stands for; `None` for the other kinds.
///
/// # Errors
/// Why there is no such angle within the limits of motion.
pub(crate) fn target_angle(
    params: &Params,
    set_point: &SetPoint,
    measured_pressure_drop_pa: Option<f64>,
) -> Result<Option<f64>, SetPointRefusal> {
    let angle_rad = match SetPointKind::from_code(set_point.kind) {
        Some(SetPointKind::Angle) => set_point.value,
        Some(SetPointKind::Opening) => angle_for_opening(params, set_point.value)?,
        Some(SetPointKind::Flow) => {
            let given = (set_point.pressure_given == 1).then_some(set_point.pressure_drop_pa);
            angle_for_flow(params, set_point.value, given.or(measured_pressure_drop_pa))?
        }
        _ => return Ok(None),
    };
    if within_limits(params, angle_rad) { Ok(Some(angle_rad)) } else { Err(SetPointRefusal::AngleLimit) }
}

/// The part of the orifice's travel that a flow out of reach comes back within before it counts as held again: a
/// pressure drop that is measured with noise would else be told of over and over.
const BACK_WITHIN: f64 = 0.01;

/// Where a flow that is held leads while the pressure drop changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reached {
    /// The angle, as near as the limits of motion let it come where the flow is out of reach; `None` where the
    /// measured pressure drop says nothing about it.
    pub angle_rad: Option<f64>,
    pub held: HeldFlow,
}

/// The angle for a flow that is held, and whether it gives that flow. `before`: what became of it in the last cycle.
pub(crate) fn held_flow(
    params: &Params,
    flow_m3_per_s: f64,
    pressure_drop_pa: Option<f64>,
    before: HeldFlow,
) -> Reached {
    let Some(pressure_drop_pa) = pressure_drop_pa else {
        return Reached { angle_rad: None, held: HeldFlow::NoPressure };
    };
    let out_of_reach = |angle_rad| Reached { angle_rad, held: HeldFlow::OutOfReach };
    let Some((orifice, density)) = params.orifice.zip(params.oil_density_kg_per_m3) else {
        return out_of_reach(None);
    };
    let limits = &params.limits;
    let lowest = limits.min_angle_rad.unwrap_or(f64::NEG_INFINITY);
    let highest = limits.max_angle_rad.unwrap_or(f64::INFINITY);
    let within = |angle_rad: f64| angle_rad.max(lowest).min(highest);
    match orifice.angle_for_flow(flow_m3_per_s, pressure_drop_pa, density) {
        Ok(angle_rad) => {
            let travel_rad = orifice.open_angle_rad - orifice.closed_angle_rad;
            let margin_rad = if before == HeldFlow::OutOfReach { BACK_WITHIN * travel_rad } else { 0.0 };
            let fully_open_rad = highest.min(orifice.open_angle_rad);
            let is_held = angle_rad >= lowest && angle_rad <= fully_open_rad - margin_rad;
            let held = if is_held { HeldFlow::Held } else { HeldFlow::OutOfReach };
            Reached { angle_rad: Some(within(angle_rad)), held }
        }
        // Without any pressure drop no angle is nearer than another.
        Err(OrificeError::TooMuch { most_m3_per_s, .. }) if most_m3_per_s != 0.0 => {
            out_of_reach(Some(within(orifice.open_angle_rad)))
        }
        Err(_) => out_of_reach(None),
    }
}

/// Whether the limits of motion hold this angle.
pub(crate) fn within_limits(params: &Params, angle_rad: f64) -> bool {
    let limits = &params.limits;
    angle_rad.abs() <= signals::MAX_ANGLE_RAD
        && limits.min_angle_rad.is_none_or(|lowest| angle_rad >= lowest)
        && limits.max_angle_rad.is_none_or(|highest| angle_rad <= highest)
}

fn angle_for_opening(params: &Params, opening: f64) -> Result<f64, SetPointRefusal> {
    let orifice = params.orifice.ok_or(SetPointRefusal::NoOrifice)?;
    if !(0.0..=1.0).contains(&opening) {
        return Err(SetPointRefusal::AngleLimit);
    }
    Ok(orifice.angle_for_opening(opening))
}

fn angle_for_flow(
    params: &Params,
    flow_m3_per_s: f64,
    pressure_drop_pa: Option<f64>,
) -> Result<f64, SetPointRefusal> {
    let (orifice, density) =
        params.orifice.zip(params.oil_density_kg_per_m3).ok_or(SetPointRefusal::NoOrifice)?;
    let pressure_drop_pa = pressure_drop_pa.ok_or(SetPointRefusal::NoPressure)?;
    orifice.angle_for_flow(flow_m3_per_s, pressure_drop_pa, density).map_err(|_| SetPointRefusal::Flow)
}
