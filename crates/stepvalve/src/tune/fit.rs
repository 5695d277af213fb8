//! LuGre's parameters from command and angle: the model is driven by the recorded command, and its angle fitted to the
//! encoder's by damped least squares (Levenberg and Marquardt) in the parameters' logarithms.

use super::motion::Sample;
use super::torque::{friction_seen, residual as torque_residual};
use nalgebra::{DMatrix, DVector};
use valve_model::{
    FrictionParams, LuGreParams, Model, ParamError, ValveInput, ValveParams, ValveState, step,
};

/// Parameters fitted.
pub const COUNT: usize = 6;

/// Their keys in a model file, in the order of the fit.
pub const KEYS: [&str; COUNT] = [
    "coulomb_torque_nm",
    "static_torque_nm",
    "stribeck_velocity_rad_per_s",
    "bristle_stiffness_nm_per_rad",
    "bristle_damping_nm_s_per_rad",
    "viscous_nm_s_per_rad",
];

/// Step of the derivatives, and the change at which the search ends, in logarithms.
const STEP: f64 = 1e-3;
const ENOUGH: f64 = 1e-6;

/// The most that a parameter changes in one step of the search, in logarithms.
const STRIDE: f64 = 0.5;

const ATTEMPTS: usize = 60;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub friction: LuGreParams,
    /// Standard error of each, in the order of [`KEYS`] and in its unit; infinite where the motion does not show it.
    pub std_errors: [f64; COUNT],
    /// RMS of encoder minus model before and after, rad.
    pub rms_before_rad: f64,
    /// The same with the parameters found, rad.
    pub rms_after_rad: f64,
    /// Steps of the search.
    pub steps: usize,
}

/// Fits the friction of `model`, whose law must be LuGre, to a record: first its torque, then the valve's angle.
///
/// # Errors
/// A model that is none.
pub fn fit(model: &Model, start: &LuGreParams, record: &[Sample], period_s: f64) -> Result<Fit, ParamError> {
    let angle = |logs: &[f64; COUNT]| angle_residual(model, start, logs, record, period_s);
    let rms_before_rad = rms(&angle(&logs_of(start))?);
    let seen = friction_seen(model, record, period_s).unwrap_or_default();
    let torque = |logs: &[f64; COUNT]| {
        Ok(DVector::from_iterator(
            seen.len().saturating_sub(1),
            torque_residual(&params_of(start, logs), &seen, period_s),
        ))
    };
    let coarse = search(logs_of(start), &torque)?;
    let fine = search(coarse.logs, &angle)?;
    let friction = params_of(start, &fine.logs);
    let std_errors = std_errors(&fine.jacobian, &fine.residual, &friction);
    let steps = coarse.steps + fine.steps;
    Ok(Fit { friction, std_errors, rms_before_rad, rms_after_rad: rms(&fine.residual), steps })
}

/// Where a search ended.
struct Found {
    logs: [f64; COUNT],
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
    steps: usize,
}

/// Least squares by Levenberg and Marquardt.
fn search(
    mut logs: [f64; COUNT],
    residual: &impl Fn(&[f64; COUNT]) -> Result<DVector<f64>, ParamError>,
) -> Result<Found, ParamError> {
    let mut now = residual(&logs)?;
    let (mut damping, mut steps) = (1e-3, 0);
    let mut jacobian = derivatives(&logs, &now, residual)?;
    for _ in 0..ATTEMPTS {
        let normal = jacobian.tr_mul(&jacobian);
        let lift = normal.diagonal().add_scalar(f64::MIN_POSITIVE) * damping;
        let Some(solver) = (&normal + DMatrix::from_diagonal(&lift)).cholesky() else {
            damping *= 10.0;
            continue;
        };
        let change = solver.solve(&jacobian.tr_mul(&now)).map(|change| (-change).clamp(-STRIDE, STRIDE));
        let tried = std::array::from_fn(|index| {
            logs.get(index).zip(change.get(index)).map_or(0.0, |(log, by)| log + by)
        });
        let next = residual(&tried)?;
        if next.norm_squared() < now.norm_squared() {
            (logs, now, steps) = (tried, next, steps + 1);
            damping = (damping * 0.2_f64).max(1e-12);
            if change.amax() < ENOUGH {
                break;
            }
            jacobian = derivatives(&logs, &now, residual)?;
        } else {
            damping *= 5.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Ok(Found { logs, residual: now, jacobian, steps })
}

/// Model minus encoder, rad, sample by sample.
fn angle_residual(
    model: &Model,
    start: &LuGreParams,
    logs: &[f64; COUNT],
    record: &[Sample],
    period_s: f64,
) -> Result<DVector<f64>, ParamError> {
    let friction = FrictionParams::LuGre(params_of(start, logs));
    let params = ValveParams::new(&Model { friction, ..model.clone() })?;
    let mut state = ValveState::at_rest(record.first().map_or(0.0, |first| first.angle_rad));
    let mut residual = DVector::zeros(record.len());
    for ((pair, slot), begin) in record.windows(2).zip(residual.iter_mut().skip(1)).zip(record) {
        let Some(end) = pair.last() else { break };
        let input = ValveInput {
            command_start_rad: begin.command_rad,
            command_end_rad: end.command_rad,
            pressure_drop_pa: begin.pressure_drop_pa,
            oil_temperature_c: begin.oil_temperature_c,
            current_ratio: 1.0,
        };
        *slot = step(&params, &mut state, &input, period_s).encoder_angle_rad - end.angle_rad;
    }
    Ok(residual)
}

fn derivatives(
    logs: &[f64; COUNT],
    now: &DVector<f64>,
    residual: &impl Fn(&[f64; COUNT]) -> Result<DVector<f64>, ParamError>,
) -> Result<DMatrix<f64>, ParamError> {
    let mut columns = Vec::with_capacity(COUNT);
    for moved in 0..COUNT {
        let shifted = std::array::from_fn(|index| {
            logs.get(index).copied().unwrap_or_default() + if index == moved { STEP } else { 0.0 }
        });
        columns.push((residual(&shifted)? - now) / STEP);
    }
    Ok(DMatrix::from_columns(&columns))
}

/// T_s as its excess over T_c, which keeps it above; all as logarithms, which keeps them positive.
fn logs_of(params: &LuGreParams) -> [f64; COUNT] {
    let excess = (params.static_torque_nm / params.coulomb_torque_nm - 1.0).max(1e-3);
    [
        params.coulomb_torque_nm,
        excess,
        params.stribeck_velocity_rad_per_s,
        params.bristle_stiffness_nm_per_rad,
        params.bristle_damping_nm_s_per_rad.max(1e-6),
        params.viscous_nm_s_per_rad.max(1e-7),
    ]
    .map(f64::ln)
}

fn params_of(start: &LuGreParams, logs: &[f64; COUNT]) -> LuGreParams {
    let [coulomb, excess, velocity, stiffness, damping, viscous] = logs.map(f64::exp);
    LuGreParams {
        coulomb_torque_nm: coulomb,
        static_torque_nm: coulomb * (1.0 + excess),
        stribeck_velocity_rad_per_s: velocity,
        bristle_stiffness_nm_per_rad: stiffness,
        bristle_damping_nm_s_per_rad: damping,
        viscous_nm_s_per_rad: viscous,
        ..*start
    }
}

/// From the curvature of the sum of squares at its minimum, in the parameters' units.
fn std_errors(jacobian: &DMatrix<f64>, residual: &DVector<f64>, params: &LuGreParams) -> [f64; COUNT] {
    let variance = residual.norm_squared() / (residual.len().saturating_sub(COUNT).max(1)) as f64;
    let Some(covariance) = jacobian.tr_mul(jacobian).try_inverse() else { return [f64::INFINITY; COUNT] };
    let covariance = covariance * variance;
    let entry = |row: usize, column: usize| covariance.get((row, column)).copied().unwrap_or(f64::INFINITY);
    let excess_nm = params.static_torque_nm - params.coulomb_torque_nm;
    // T_s = T_c·(1 + excess): both logarithms move it.
    let (by_coulomb, by_excess) = (params.static_torque_nm, excess_nm);
    let static_variance = by_coulomb * by_coulomb * entry(0, 0)
        + 2.0 * by_coulomb * by_excess * entry(0, 1)
        + by_excess * by_excess * entry(1, 1);
    let of = |index: usize, value: f64| value * entry(index, index).max(0.0).sqrt();
    [
        of(0, params.coulomb_torque_nm),
        static_variance.max(0.0).sqrt(),
        of(2, params.stribeck_velocity_rad_per_s),
        of(3, params.bristle_stiffness_nm_per_rad),
        of(4, params.bristle_damping_nm_s_per_rad),
        of(5, params.viscous_nm_s_per_rad),
    ]
}

fn rms(residual: &DVector<f64>) -> f64 {
    (residual.norm_squared() / residual.len().max(1) as f64).sqrt()
}
