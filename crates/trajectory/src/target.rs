//! From a set-point in its own quantity to an angle.

use signals::{SetPoint, SetPointKind, SetPointRefusal};
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

/// The angle for a flow that is held while the pressure drop changes: where the flow is out of reach it is as near
/// as the limits of motion let it come. `None` where the measured pressure drop says nothing about the angle.
pub(crate) fn held_flow_angle(params: &Params, flow_m3_per_s: f64, pressure_drop_pa: f64) -> Option<f64> {
    let (orifice, density) = params.orifice.zip(params.oil_density_kg_per_m3)?;
    let angle_rad = match orifice.angle_for_flow(flow_m3_per_s, pressure_drop_pa, density) {
        Ok(angle_rad) => angle_rad,
        // Without any pressure drop no angle is nearer than another.
        Err(OrificeError::TooMuch { most_m3_per_s, .. }) if most_m3_per_s != 0.0 => orifice.open_angle_rad,
        Err(_) => return None,
    };
    let limits = &params.limits;
    let lowest = limits.min_angle_rad.unwrap_or(f64::NEG_INFINITY);
    Some(angle_rad.max(lowest).min(limits.max_angle_rad.unwrap_or(f64::INFINITY)))
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
