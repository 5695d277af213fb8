//! Where the search begins: friction's torque from lag and motion, and the law driven by the measured motion.
//!
//! T_f = T_hold·sin(N_r·(θ_cmd − θ)) − D·ω − J·ω̇, with ω and ω̇ from a parabola through seven readings. It is blurred by
//! the encoder's counts, but unlike the angle of a simulated valve it can't run away where sliding is unstable.

use super::motion::Sample;
use valve_model::{FrictionLaw, FrictionParams, FrictionState, LuGreParams, Model};

/// Readings on either side of the one that a parabola is laid through.
const SIDE: usize = 3;
/// Σ i² and Σ i⁴ over them, and their number.
const SQUARES: f64 = 28.0;
const FOURTHS: f64 = 196.0;
const NUMBER: f64 = 7.0;

/// Speed and torque of friction at one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    speed_rad_per_s: f64,
    torque_nm: f64,
}

/// Friction as a record shows it; `None` without motor and load.
pub fn friction_seen(model: &Model, record: &[Sample], period_s: f64) -> Option<Vec<Seen>> {
    let (motor, load) = (model.motor?, model.load?);
    let inertia = motor.rotor_inertia_kg_m2 + load.inertia_kg_m2;
    let seen = record.windows(2 * SIDE + 1).filter_map(|window| {
        let centre = window.get(SIDE)?;
        let (mut slope, mut bend, mut sum) = (0.0, 0.0, 0.0);
        for (sample, index) in window.iter().zip(-(SIDE as i32)..) {
            let (index, angle_rad) = (f64::from(index), sample.angle_rad - centre.angle_rad);
            slope += index * angle_rad;
            bend += index * index * angle_rad;
            sum += angle_rad;
        }
        let speed_rad_per_s = slope / (SQUARES * period_s);
        let curvature = (NUMBER * bend - SQUARES * sum) / (NUMBER * FOURTHS - SQUARES * SQUARES);
        let acceleration = 2.0 * curvature / (period_s * period_s);
        let motor_nm = motor.torque_nm(centre.command_rad, centre.angle_rad, speed_rad_per_s);
        Some(Seen { speed_rad_per_s, torque_nm: motor_nm - inertia * acceleration })
    });
    Some(seen.collect())
}

/// The law's torque minus the one seen, N·m, reading by reading.
pub fn residual(friction: &LuGreParams, seen: &[Seen], period_s: f64) -> impl Iterator<Item = f64> {
    let law = FrictionLaw::new(&FrictionParams::LuGre(*friction));
    let mut state = FrictionState::default();
    seen.windows(2).map(move |pair| match pair {
        [begin, end] => {
            let torque_nm = state.step(&law, begin.speed_rad_per_s, end.speed_rad_per_s, period_s);
            torque_nm - end.torque_nm
        }
        _ => 0.0,
    })
}
