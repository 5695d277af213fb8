//! A record of command and angle as a torque log: the motor is its own transducer.
//!
//! The shaft feels T_hold·sin(N_r·(θ_cmd − θ)) − D·ω − J_rotor·ω̇, with ω and ω̇ from the smoothed angle. The encoder's steps blur
//! it, but unlike a predicted angle it depends smoothly on every number of the model: no rotor slips elsewhere.

use crate::workers::{Workers, map};
use log_data::{Log, Run, bridged};
use prediction::{Noise, Smoother};
use valve_model::{Model, MotorParams};

/// The torque log of a record; `None` without a motor, or where a run has no command.
pub(super) fn as_torques(log: &Log, model: &Model, workers: &dyn Workers) -> Option<Log> {
    let motor = model.motor?;
    let (log, _) = bridged(log);
    let runs = map(workers, log.runs.len(), |index| log.runs.get(index).and_then(|run| of_run(run, &motor)));
    let runs: Option<Vec<Run>> = runs.into_iter().collect();
    Some(Log { runs: runs?, ..log.into_owned() })
}

fn of_run(run: &Run, motor: &MotorParams) -> Option<Run> {
    let command = run.angle_command_rad.as_ref()?;
    let mut smoother = Smoother::new(&run.time_s, &run.angle_rad, Noise::of(&run.angle_rad));
    let torque = |(index, command_rad): (usize, &f64)| {
        let motion = smoother.motion(index);
        let motor_nm = motor.torque_nm(*command_rad, motion.angle_rad, motion.speed_rad_per_s);
        motor_nm - motor.rotor_inertia_kg_m2 * motion.acceleration_rad_per_s2
    };
    let torque_nm = command.iter().enumerate().map(torque).collect();
    Some(Run { torque_nm: Some(torque_nm), angle_command_rad: None, ..run.clone() })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::workers::OneAfterTheOther;
    use valve_model::Model;

    #[test]
    fn a_rotor_that_is_pulled_back_shows_the_torque_that_holds_it() {
        let model = Model::bench_rig();
        let motor = model.motor.unwrap();
        let time_s: Vec<f64> = (0..200).map(|row| 1e-3 * f64::from(row)).collect();
        let behind_rad = 0.3 / f64::from(motor.rotor_teeth);
        let run = Run {
            angle_rad: vec![0.0; 200],
            angle_command_rad: Some(vec![behind_rad; 200]),
            time_s,
            ..Run::default()
        };
        let log = as_torques(&Log { runs: vec![run], ..Log::default() }, &model, &OneAfterTheOther).unwrap();
        let torque_nm = log.runs[0].torque_nm.as_ref().unwrap();
        let expected_nm = motor.holding_torque_nm * 0.3_f64.sin();
        assert!(torque_nm.iter().all(|torque_nm| (torque_nm - expected_nm).abs() < 1e-12), "{torque_nm:?}");
        assert!(log.runs[0].angle_command_rad.is_none());
    }
}
