//! A controller beside a drive that does what it is told: message in, message out, no valve.
#![allow(dead_code, missing_docs)]

use signals::{
    ControllerState, FaultCode, Feedback, OperatorCommand, OperatorKind, OperatorResult, Reference, validity,
};
use std::collections::VecDeque;
use step_control::{Compensation, Input, LostSteps, Output, Params, ReferenceLimits, State, step};

mod bench_rig;
pub use bench_rig::{MOTOR, params};

pub const HOLDS: u64 = validity::STANDSTILL | validity::ENERGISED | validity::HOMED;

pub fn order(id: u64, kind: OperatorKind) -> OperatorCommand {
    OperatorCommand { id, kind: kind.code(), valid_until_cycle: u64::MAX, ..OperatorCommand::default() }
}

/// A controller, and a drive that accepts every command in its cycle.
pub struct Bench {
    pub params: Params,
    pub state: State,
    pub cycle: u64,
    /// Flags that the drive sends.
    pub validity: u64,
    pub drive_fault: FaultCode,
    /// What the encoder adds to the angle of the accepted command, where one is fitted.
    pub rotor_rad: f64,
    pub reference: Option<Reference>,
    pub silent: bool,
    /// What the drive says instead of its position.
    pub wrong_position: Option<i64>,
    sent: VecDeque<i64>,
}

impl Bench {
    pub fn new(params: Params) -> Self {
        params.validate().unwrap();
        let cycles = params.loop_delay_cycles as usize + 1;
        Self {
            params,
            state: State::new(0),
            cycle: 0,
            validity: HOLDS,
            drive_fault: FaultCode::None,
            rotor_rad: 0.0,
            reference: Some(Reference::default()),
            silent: false,
            wrong_position: None,
            sent: VecDeque::from(vec![0; cycles]),
        }
    }

    /// One that runs, at rest at zero.
    pub fn running(params: Params) -> Self {
        let mut bench = Self::new(params);
        bench.step(Some(order(1, OperatorKind::Arm)));
        assert_eq!(bench.machine(), ControllerState::Running);
        bench
    }

    pub fn machine(&self) -> ControllerState {
        self.state.machine()
    }

    pub fn step(&mut self, order: Option<OperatorCommand>) -> Output {
        let accepted = self.sent.pop_front().unwrap();
        let accepted_rad = accepted as f64 * MOTOR.microstep_angle_rad();
        let seen = self.validity & validity::ENCODER != 0;
        let feedback = Feedback {
            angle_rad: if seen { self.rotor_rad } else { accepted_rad },
            accepted_microsteps: self.wrong_position.unwrap_or(accepted),
            validity: self.validity,
            drive_fault: self.drive_fault.code(),
            ..Feedback::default()
        };
        let feedback = (!self.silent).then_some(feedback);
        let input =
            Input { feedback: feedback.as_ref(), reference: self.reference.as_ref(), order: order.as_ref() };
        let output = step(&self.params, &mut self.state, self.cycle, &input);
        self.cycle += 1;
        self.sent.push_back(output.command.position_microsteps);
        output
    }

    /// Gives an order; what is answered.
    pub fn ask(&mut self, id: u64, kind: OperatorKind) -> OperatorResult {
        let status = self.step(Some(order(id, kind))).status;
        assert_eq!(status.operator_id, id);
        OperatorResult::from_code(status.operator_result).unwrap()
    }

    /// The reference of the next cycles.
    pub fn refer(&mut self, angle_rad: f64, speed_rad_per_s: f64, acceleration_rad_per_s2: f64) {
        self.reference =
            Some(Reference { angle_rad, speed_rad_per_s, acceleration_rad_per_s2, ..Reference::default() });
    }
}
