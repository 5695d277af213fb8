//! The library of terms that the regression chooses from, by the causes that they stand for.
//!
//! σ0·z is the nominal bristle torque, computed along the measured motion; every friction level scales with it.

use log_data::{Log, Run};
use prediction::{Noise, Past, Smoother, predict};
use valve_model::{EffectId, FrictionLaw, FrictionParams, FrictionState, LuGreParams, Model};

/// The causes, with how many terms each has.
pub const CAUSES: &[(EffectId, usize)] = &[
    (EffectId::TorqueOffset, 1),
    (EffectId::TorqueGain, 1),
    (EffectId::CoulombLevel, 1),
    (EffectId::StaticLevel, 1),
    (EffectId::ViscousLevel, 1),
    (EffectId::StribeckVelocity, 1),
    (EffectId::BristleStiffness, 1),
    (EffectId::LoadInertia, 1),
    (EffectId::PressureDependentFriction, 1),
    (EffectId::TemperatureDependentViscosity, 1),
    (EffectId::TemperatureDependentFriction, 1),
    (EffectId::AngleDependentFriction, 2 * ORDERS),
    (EffectId::DirectionAsymmetry, 2),
    (EffectId::DwellStiction, 1),
    (EffectId::HydraulicLock, 1),
    (EffectId::FrictionLag, 1),
    (EffectId::PreslidingHysteresis, 1),
    (EffectId::WearDrift, 1),
    (EffectId::FlowTorque, 2 * ORDERS),
    (EffectId::PressureTorque, 1),
    (EffectId::PositionTorque, 2 * ORDERS),
    (EffectId::SensorDelay, 1),
    (EffectId::CouplingCompliance, 1),
];

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
struct Sample {
    angle: f64,
    speed: f64,
    acceleration: f64,
    bristle_nm: f64,
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
        terms.rows.push(row(
            &Sample {
                angle: motion.angle_rad,
                speed,
                acceleration: motion.acceleration_rad_per_s2,
                bristle_nm: lugre.bristle_stiffness_nm_per_rad * z,
                predicted_nm: here,
                slope_nm_per_s: (next - past) / (2.0 * dt_s.max(1e-5)),
                bend_nm_per_s2: (next - 2.0 * here + past) / (dt_s * dt_s).max(1e-10),
                pressure_mpa: at(&run.pressure_drop_pa).unwrap_or(0.0) / 1e6,
                warmer_k: at(&run.oil_temperature_c).unwrap_or(40.0) - model.reference_temperature_c(),
                distance_rad: *distance_rad,
                grown: 1.0 - (-*rest_s / GROWTH_S).exp(),
            },
            lugre,
        ));
    }
    Some(terms)
}

/// One sample's terms in the order of [`CAUSES`].
fn row(at: &Sample, lugre: &LuGreParams) -> Vec<f64> {
    let ratio = (at.speed / lugre.stribeck_velocity_rad_per_s).abs();
    let fall = (-ratio.powf(lugre.stribeck_exponent)).exp();
    let excess_nm = lugre.static_torque_nm - lugre.coulomb_torque_nm;
    let steady_nm = lugre.coulomb_torque_nm + excess_nm * fall;
    let reached = (at.bristle_nm / steady_nm).abs().min(1.0);
    let bristle = at.bristle_nm;
    let waves = |scale: f64| {
        (1..=ORDERS)
            .flat_map(move |k| [scale * (k as f64 * at.angle).cos(), scale * (k as f64 * at.angle).sin()])
    };
    let mut row = vec![
        1.0,
        at.predicted_nm,
        bristle,
        bristle * fall,
        at.speed,
        bristle * fall * ratio.powf(lugre.stribeck_exponent),
        bristle * (1.0 - reached),
        at.acceleration,
        at.pressure_mpa * bristle,
        at.warmer_k * at.speed,
        at.warmer_k * bristle,
    ];
    row.extend(waves(bristle));
    let lag = at.acceleration
        * (lugre.viscous_nm_s_per_rad - excess_nm * fall * ratio / lugre.stribeck_velocity_rad_per_s);
    row.extend([
        bristle.abs(),
        at.speed.abs(),
        bristle * fall * at.grown,
        bristle * at.pressure_mpa * at.grown,
        lag,
        bristle * reached * (1.0 - reached),
        bristle * at.distance_rad,
    ]);
    row.extend(waves(at.pressure_mpa));
    row.push(at.pressure_mpa);
    row.extend(waves(1.0));
    row.extend([at.slope_nm_per_s, at.bend_nm_per_s2]);
    row
}
