//! The library of terms that the regression chooses from, by the causes that they stand for.
//!
//! σ0·z is the nominal bristle torque, computed along the measured motion; every friction level scales with it.

use log_data::{Log, Run};
use prediction::{Noise, Past, Smoother, predict};
use std::sync::LazyLock;
use valve_model::{EffectId, FrictionLaw, FrictionParams, FrictionState, LuGreParams, Model};

/// The causes that have terms, with how many each has, in the order of a row.
pub static CAUSES: LazyLock<Vec<(EffectId, usize)>> = LazyLock::new(|| {
    let count = |id: &EffectId| (*id, terms_of(*id, &Sample::default()).len());
    EffectId::ALL.iter().map(count).filter(|(_, terms)| *terms > 0).collect()
});

/// Orders of the angle.
const ORDERS: usize = 4;
/// How fast stiction is taken to grow, s.
const GROWTH_S: f64 = 1.0;

/// A run's residual and terms, row by row.
pub struct Terms {
    /// Measured less predicted torque, N·m.
    pub residual: Vec<f64>,
    /// One row of terms for each sample.
    pub rows: Vec<Vec<f64>>,
}

/// The terms of each run, in the order of time; `None` where a run or the model is of another kind.
pub fn terms(log: &Log, model: &Model) -> Option<Vec<Terms>> {
    let FrictionParams::LuGre(lugre) = model.friction else { return None };
    let (mut distance_rad, mut rest_s, mut ended_s) = (0.0, 0.0, None);
    log.runs_in_time()
        .into_iter()
        .map(|run| {
            rest_s += ended_s.map_or(0.0, |ended_s| run.start_s() - ended_s);
            let terms = of_run(run, model, &lugre, &mut distance_rad, &mut rest_s);
            ended_s = Some(run.end_s());
            terms
        })
        .collect()
}

/// The nominal model along a run.
#[derive(Default)]
struct Sample {
    angle: f64,
    speed: f64,
    acceleration: f64,
    bristle_nm: f64,
    /// Part of the Stribeck excess that is there at this speed.
    fall: f64,
    /// That by which the Stribeck velocity's logarithm changes it.
    fall_by_velocity: f64,
    /// The bristles' torque over that of steady sliding, at most 1.
    reached: f64,
    /// How much a lag of friction takes away, per second of it, N·m/s.
    lag_nm_per_s: f64,
    predicted_nm: f64,
    slope_nm_per_s: f64,
    bend_nm_per_s2: f64,
    pressure_mpa: f64,
    warmer_k: f64,
    distance_rad: f64,
    grown: f64,
}

fn of_run(
    run: &Run,
    model: &Model,
    lugre: &LuGreParams,
    distance_rad: &mut f64,
    rest_s: &mut f64,
) -> Option<Terms> {
    let mut predicted = run.clone();
    predict(&mut predicted, model, &Past::default()).ok()?;
    let (measured, predicted) = (run.torque_nm.as_ref()?, predicted.torque_nm?);
    let mut smoother = Smoother::new(&run.time_s, &run.angle_rad, Noise::of(&run.angle_rad));
    let law = FrictionLaw::new(&model.friction);
    let mut state = FrictionState::default();
    let mut before: Option<(f64, f64)> = None;
    let mut terms = Terms { residual: Vec::new(), rows: Vec::new() };
    for (index, (time_s, torque)) in run.time_s.iter().zip(measured).enumerate() {
        let motion = smoother.motion(index);
        let (speed, z_before) = (motion.speed_rad_per_s, state.bristle_deflection_rad());
        let (dt_s, start) = before.map_or((1e-9, speed), |(time, speed)| (time_s - time, speed));
        state.step(&law, start, speed, dt_s);
        before = Some((*time_s, speed));
        let z = state.bristle_deflection_rad();
        let travel = 0.5 * (start + speed) * dt_s;
        *distance_rad += travel.abs();
        let slip =
            (travel - (z - z_before)).abs() * lugre.bristle_stiffness_nm_per_rad / lugre.coulomb_torque_nm;
        *rest_s = *rest_s * (-slip).exp() + dt_s;
        let around = |k: usize| predicted.get(k).copied().unwrap_or(0.0);
        let (past, here, next) =
            (around(index.saturating_sub(1)), around(index), around((index + 1).min(predicted.len() - 1)));
        let at = |values: &Option<Vec<f64>>| values.as_ref().and_then(|values| values.get(index)).copied();
        terms.residual.push(torque - here);
        let bristle_nm = lugre.bristle_stiffness_nm_per_rad * z;
        let ratio = (speed / lugre.stribeck_velocity_rad_per_s).abs();
        let fall = (-ratio.powf(lugre.stribeck_exponent)).exp();
        let excess_nm = lugre.static_torque_nm - lugre.coulomb_torque_nm;
        let falling = excess_nm * fall * ratio / lugre.stribeck_velocity_rad_per_s;
        terms.rows.push(row(&Sample {
            angle: motion.angle_rad,
            speed,
            acceleration: motion.acceleration_rad_per_s2,
            bristle_nm,
            fall,
            fall_by_velocity: fall * ratio.powf(lugre.stribeck_exponent),
            reached: (bristle_nm / (lugre.coulomb_torque_nm + excess_nm * fall)).abs().min(1.0),
            lag_nm_per_s: motion.acceleration_rad_per_s2 * (lugre.viscous_nm_s_per_rad - falling),
            predicted_nm: here,
            slope_nm_per_s: (next - past) / (2.0 * dt_s.max(1e-5)),
            bend_nm_per_s2: (next - 2.0 * here + past) / (dt_s * dt_s).max(1e-10),
            pressure_mpa: at(&run.pressure_drop_pa).unwrap_or(0.0) / 1e6,
            warmer_k: at(&run.oil_temperature_c).unwrap_or(40.0) - model.reference_temperature_c(),
            distance_rad: *distance_rad,
            grown: 1.0 - (-*rest_s / GROWTH_S).exp(),
        }));
    }
    Some(terms)
}

/// One sample's terms in the order of [`CAUSES`].
fn row(at: &Sample) -> Vec<f64> {
    CAUSES.iter().flat_map(|(id, _)| terms_of(*id, at)).collect()
}

/// The terms that stand for a cause; none for one that a torque log doesn't show, or no term says to first order.
fn terms_of(id: EffectId, at: &Sample) -> Vec<f64> {
    let waves = |scale: f64| -> Vec<f64> {
        let of = |k: usize| [(k as f64 * at.angle).cos(), (k as f64 * at.angle).sin()];
        (1..=ORDERS).flat_map(of).map(|wave| scale * wave).collect()
    };
    let bristle = at.bristle_nm;
    match id {
        EffectId::TorqueOffset => vec![1.0],
        EffectId::TorqueGain => vec![at.predicted_nm],
        EffectId::CoulombLevel => vec![bristle],
        EffectId::StaticLevel => vec![bristle * at.fall],
        EffectId::ViscousLevel => vec![at.speed],
        EffectId::StribeckVelocity => vec![bristle * at.fall_by_velocity],
        EffectId::BristleStiffness => vec![bristle * (1.0 - at.reached)],
        EffectId::LoadInertia => vec![at.acceleration],
        EffectId::PressureDependentFriction => vec![at.pressure_mpa * bristle],
        EffectId::TemperatureDependentViscosity => vec![at.warmer_k * at.speed],
        EffectId::TemperatureDependentFriction => vec![at.warmer_k * bristle],
        EffectId::AngleDependentFriction => waves(bristle),
        EffectId::DirectionAsymmetry => vec![bristle.abs(), at.speed.abs()],
        EffectId::DwellStiction => vec![bristle * at.fall * at.grown],
        EffectId::HydraulicLock => vec![bristle * at.pressure_mpa * at.grown],
        EffectId::FrictionLag => vec![at.lag_nm_per_s],
        EffectId::PreslidingHysteresis => vec![bristle * at.reached * (1.0 - at.reached)],
        EffectId::WearDrift => vec![bristle * at.distance_rad],
        EffectId::FlowTorque => waves(at.pressure_mpa),
        EffectId::PressureTorque => vec![at.pressure_mpa],
        EffectId::PositionTorque => waves(1.0),
        EffectId::SensorDelay => vec![at.slope_nm_per_s],
        EffectId::CouplingCompliance => vec![at.bend_nm_per_s2],
        // Never a cause.
        EffectId::BristleDamping | EffectId::RotorInertia | EffectId::MotorDamping => Vec::new(),
        EffectId::HoldingTorqueLevel
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::Backlash
        | EffectId::MissedSteps
        | EffectId::EncoderEccentricity
        | EffectId::Custom(_) => Vec::new(),
    }
}
