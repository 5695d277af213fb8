//! A controller of the bench rig, which the crate's tests begin from: those beside the code and those in this folder.
#![allow(clippy::unwrap_used)]

// Named by the module above: the crate itself, or a test of it.
use super::{Compensation, LostSteps, Params, ReferenceLimits};
use valve_model::{FrictionLaw, LuGreParams, Model, MotionParams, MotorParams};

pub const MOTOR: MotorParams = MotorParams::BENCH_RIG;

/// Settings without friction compensation, observer and homing.
pub fn params() -> Params {
    let belief = Model::bench_rig();
    Params {
        period_s: 1e-3,
        loop_delay_cycles: 1,
        motor: MOTOR,
        inertia_kg_m2: 5e-4,
        friction: FrictionLaw::new(&belief.friction),
        with_effects: MotionParams::new(&belief).unwrap(),
        coulomb_torque_nm: LuGreParams::BENCH_RIG.coulomb_torque_nm,
        viscous_nm_s_per_rad: LuGreParams::BENCH_RIG.viscous_nm_s_per_rad,
        compensation: Compensation::None,
        observer: None,
        shaper: None,
        encoder_delay_cycles: 0,
        lost_steps: LostSteps::Fault,
        homing: None,
        holds_when_disarmed: false,
        drive: drive::Params {
            period_s: 1e-3,
            microstep_angle_rad: MOTOR.microstep_angle_rad(),
            max_pulse_rate_hz: 600e3,
            max_pulse_acceleration_hz_per_s: 400e6,
            quick_stop_deceleration_hz_per_s: 10e6,
            after_stop: drive::AfterStop::Hold,
            silence_cycles: 3,
            energise_cycles: 0,
            lowest_angle_rad: None,
            highest_angle_rad: None,
            standstill_rad: 1e-4,
        },
        reference_limits: ReferenceLimits {
            min_angle_rad: Some(-0.5),
            max_angle_rad: Some(0.5),
            max_speed_rad_per_s: 10.0,
            unhomed_speed_rad_per_s: 0.2,
        },
        max_following_error_rad: 0.05,
        following_error_per_speed_s: 0.0,
        arm_at_cycle: None,
        disarm_at_cycle: None,
    }
}
