//! The plant's role: drive, valve and sensors. StepCommand in; Feedback and, for the recorder alone, PlantTruth out.

use crate::encoder::{Encoder, EncoderParams};
use crate::marks::Marks;
use crate::plant_start::PlantStart;
use crate::pulses::Pulses;
use crate::timeline::Timeline;
use config::Profile;
use drive::{Microsteps, Sensors};
use serde::{Deserialize, Serialize};
use signals::{Feedback, PlantTruth, StepCommand, validity};
use valve_model::{MotorParams, ValveInput, ValveOutput, ValveParams, ValveState};

/// What the plant simulator is told: the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantPart {
    /// The run's cycles.
    pub timeline: Timeline,
    /// The valve as it is.
    pub valve: ValveParams,
    /// Its motor.
    pub motor: MotorParams,
    /// The driver's limits and reactions.
    pub drive: drive::Params,
    /// The encoder, where one is fitted.
    pub encoder: Option<EncoderParams>,
    /// Cycles from Feedback to the beginning of the command's cycle, 1 or 2.
    pub loop_delay_cycles: u64,
    /// How the valve stands at the start.
    pub start: PlantStart,
    /// What homing meets.
    pub marks: Marks,
    /// Pressure drop over scenario time, Pa.
    pub pressure_drop_pa: Profile,
    /// Oil temperature over scenario time, °C.
    pub oil_temperature_c: Profile,
}

/// The plant at the beginning of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantSample {
    /// For the controller and the trajectory.
    pub feedback: Feedback,
    /// For the recorder.
    pub truth: PlantTruth,
}

/// The plant between two cycles.
#[derive(Debug, Clone)]
pub struct PlantRole {
    part: PlantPart,
    drive: drive::State,
    valve: ValveState,
    encoder: Option<Encoder>,
    // The command of the last cycle, which a loop with two cycles of delay follows in this one.
    delayed: Option<StepCommand>,
    motion: Option<drive::Output>,
    output: Option<ValveOutput>,
    // Of the last cycle.
    pulses: Pulses,
    index_rad: Option<f64>,
    lost_steps_at_start: i64,
    encoder_zero_rad: f64,
    homed: bool,
}

impl PlantRole {
    /// A plant at rest where its part says.
    pub fn new(part: PlantPart) -> Self {
        let start = part.start;
        let drive = if start.energised {
            drive::State::at_rest_energised(start.count_microsteps)
        } else {
            drive::State::at_rest(start.count_microsteps)
        };
        let encoder = part.encoder.map(|params| Encoder::new(params, start.angle_rad));
        let valve = ValveState::holding(&part.valve, start.angle_rad, start.friction_torque_nm);
        let mut role = Self {
            part,
            drive: drive.with_zero(start.zero_id, start.rebased_microsteps),
            valve,
            encoder,
            delayed: None,
            motion: None,
            output: None,
            pulses: Pulses::default(),
            index_rad: None,
            lost_steps_at_start: 0,
            encoder_zero_rad: start.encoder_zero_rad,
            homed: start.homed,
        };
        role.lost_steps_at_start = role.lost_steps();
        role
    }

    /// Feedback k and PlantTruth k: the plant at t_k.
    pub fn sample(&self, cycle: u64) -> PlantSample {
        let time_s = self.part.timeline.scenario_time_s(cycle);
        let pressure_drop_pa = self.part.pressure_drop_pa.at(time_s);
        let oil_temperature_c = self.part.oil_temperature_c.at(time_s);
        PlantSample { feedback: self.feedback(pressure_drop_pa, oil_temperature_c), truth: self.truth() }
    }

    /// Moves through cycle k, with StepCommand k where it came in time.
    pub fn advance(&mut self, cycle: u64, command: Option<&StepCommand>) {
        let effective = if self.part.loop_delay_cycles <= 1 {
            command.copied()
        } else {
            std::mem::replace(&mut self.delayed, command.copied())
        };
        let motion = self.drive_step(cycle, effective.as_ref());
        let time_s = self.part.timeline.scenario_time_s(cycle);
        let own_rad = |position: Microsteps| {
            (position.0 - self.drive.rebased_microsteps() as f64) * self.part.drive.microstep_angle_rad
        };
        let input = ValveInput {
            command_start_rad: own_rad(motion.start),
            command_end_rad: own_rad(motion.end),
            pressure_drop_pa: self.part.pressure_drop_pa.at(time_s),
            oil_temperature_c: self.part.oil_temperature_c.at(time_s),
            current_ratio: if motion.energised { motion.current_ratio } else { 0.0 },
        };
        let before_rad = self.valve.angle_rad;
        let output =
            valve_model::step(&self.part.valve, &mut self.valve, &input, self.part.timeline.period_s());
        let free_rad = self.valve.angle_rad;
        self.part.marks.stop(&mut self.valve);
        let pushed_back_rad = self.valve.angle_rad - free_rad;
        self.index_rad = self.part.marks.index_passed(before_rad, self.valve.angle_rad);
        if let Some(encoder) = &mut self.encoder {
            encoder.sample(output.encoder_angle_rad + pushed_back_rad);
        }
        self.pulses = Pulses::between(motion.start, motion.end, self.part.timeline.period_ns);
        self.motion = Some(motion);
        self.output = Some(output);
    }

    /// The work of a cycle to come on copies of the state, as if nothing moved: its code and data lie in the caches then. Nothing
    /// comes of it.
    pub fn rehearse(&self, cycle: u64, command: Option<&StepCommand>) {
        let PlantSample { feedback, .. } = std::hint::black_box(self.sample(cycle));
        let sensors = Sensors { encoder_rad: Some(feedback.angle_rad), homed: self.homed };
        std::hint::black_box(drive::step(
            &self.part.drive,
            &mut self.drive.clone(),
            cycle,
            command,
            &sensors,
        ));
        let command_rad = self.command_rad();
        let input = ValveInput {
            command_start_rad: command_rad,
            command_end_rad: command_rad,
            pressure_drop_pa: feedback.pressure_drop_pa,
            oil_temperature_c: feedback.oil_temperature_c,
            current_ratio: 1.0,
        };
        let mut valve = self.valve;
        let period_s = self.part.timeline.period_s();
        std::hint::black_box(valve_model::step(&self.part.valve, &mut valve, &input, period_s));
    }

    /// Runs the guard's cycle. A new zero shifts the encoder's zero and homes the valve; the controller's doubt un-homes it, and
    /// without an encoder so does switching the current off.
    fn drive_step(&mut self, cycle: u64, command: Option<&StepCommand>) -> drive::Output {
        let (zero_id, had_current) = (self.drive.zero_id(), self.drive.energised());
        let encoder_rad = self.encoder.as_ref().map(|encoder| encoder.reading().1 + self.encoder_zero_rad);
        let sensors = Sensors { encoder_rad, homed: self.homed };
        let motion = drive::step(&self.part.drive, &mut self.drive, cycle, command, &sensors);
        if let Some(command) = command.filter(|_| self.drive.zero_id() != zero_id) {
            self.encoder_zero_rad += command.zero_shift_rad;
            self.homed = true;
        }
        if command.is_some_and(|command| command.zero_in_doubt == 1) {
            self.homed = false;
        }
        // Nobody sees where the rotor goes.
        if self.encoder.is_none() && had_current && !self.drive.energised() {
            self.homed = false;
        }
        motion
    }

    /// Whether the drive stands still.
    pub fn at_standstill(&self) -> bool {
        self.motion.is_none_or(|motion| motion.flags & validity::STANDSTILL != 0)
    }

    /// The angle that the drive's count says, rad.
    fn count_rad(&self) -> f64 {
        self.drive.accepted_microsteps() as f64 * self.part.drive.microstep_angle_rad
    }

    /// The angle that the current's phase stands for, rad.
    fn command_rad(&self) -> f64 {
        let own = self.drive.accepted_microsteps().saturating_sub(self.drive.rebased_microsteps());
        own as f64 * self.part.drive.microstep_angle_rad
    }

    fn lost_steps(&self) -> i64 {
        self.part.motor.lost_steps(self.command_rad(), self.valve.angle_rad)
    }

    fn feedback(&self, pressure_drop_pa: f64, oil_temperature_c: f64) -> Feedback {
        let sensors = validity::PRESSURE
            | validity::TEMPERATURE
            | flag(validity::HOMED, self.homed)
            | flag(validity::HOME_SWITCH, self.part.marks.switch_is_on(self.valve.angle_rad))
            | flag(validity::INDEX, self.index_rad.is_some() && self.encoder.is_some());
        let at_first = validity::STANDSTILL | flag(validity::ENERGISED, self.drive.energised());
        let drive_flags = self.motion.map_or(at_first, |motion| motion.flags);
        let (encoder_flag, encoder_counts, angle_rad) = match &self.encoder {
            Some(encoder) => {
                let (counts, angle_rad) = encoder.reading();
                (validity::ENCODER, counts, angle_rad + self.encoder_zero_rad)
            }
            None => (0, 0, self.count_rad()),
        };
        Feedback {
            encoder_counts,
            angle_rad,
            accepted_microsteps: self.drive.accepted_microsteps(),
            pulse_rate_hz: self.motion.map_or(0.0, |motion| motion.pulse_rate_hz),
            pressure_drop_pa,
            oil_temperature_c,
            validity: sensors | drive_flags | encoder_flag,
            drive_fault: self.motion.map_or(0, |motion| motion.fault.code()),
            command_cycle: self.drive.command_cycle(),
            zero_id: self.drive.zero_id(),
            index_angle_rad: self.index_rad.map_or(0.0, |index_rad| index_rad + self.encoder_zero_rad),
            ..Feedback::default()
        }
    }

    fn truth(&self) -> PlantTruth {
        let at_rest = PlantTruth {
            angle_rad: self.valve.angle_rad,
            speed_rad_per_s: self.valve.speed_rad_per_s,
            command_angle_rad: self.command_rad(),
            encoder_zero_rad: self.encoder_zero_rad,
            lost_teeth: self.lost_steps() - self.lost_steps_at_start,
            pulses: self.pulses.count,
            first_pulse_ns: self.pulses.first_ns,
            last_pulse_ns: self.pulses.last_ns,
            ..PlantTruth::default()
        };
        self.output.map_or(at_rest, |output| PlantTruth {
            motor_torque_nm: output.motor_torque_nm,
            friction_torque_nm: output.friction_torque_nm,
            other_torque_nm: output.other_torque_nm,
            load_torque_nm: output.load_torque_nm,
            bristle_deflection_rad: output.bristle_deflection_rad,
            flow_m3_per_s: output.flow_m3_per_s,
            ..at_rest
        })
    }
}

fn flag(bit: u64, set: bool) -> u64 {
    if set { bit } else { 0 }
}
