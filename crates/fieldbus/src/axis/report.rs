//! What the axis says of itself: Feedback, and the motions under way that it speaks of.

use super::{Axis, Phase, Zero};
use crate::cia402::DriveState;
use crate::drive_file::Homing;
use drive::Sensors;
use signals::{FaultCode, Feedback, validity};

/// The home switch in 0x60FD.
const HOME_SWITCH: u32 = 1 << 2;

/// A cycle's motion of the guard, on its way through the bus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moved {
    end: i64,
    pulse_rate_hz: f64,
    flags: u64,
    fault: FaultCode,
    command_cycle: u64,
    zero: Zero,
}

impl Moved {
    pub(super) fn new(output: drive::Output, guard: &drive::State, zero: Zero) -> Self {
        Self {
            end: output.end.round(),
            pulse_rate_hz: output.pulse_rate_hz,
            flags: output.flags,
            fault: output.fault,
            command_cycle: guard.command_cycle(),
            zero,
        }
    }

    pub(super) fn at_rest(count: i64, zero: Zero) -> Self {
        Self {
            end: count,
            pulse_rate_hz: 0.0,
            flags: validity::STANDSTILL,
            fault: FaultCode::None,
            command_cycle: 0,
            zero,
        }
    }

    /// The same after a frame that nobody confirmed: the drive stays where it was.
    pub(super) fn not_done(self, end: i64, zero: Zero) -> Self {
        Self { end, zero, pulse_rate_hz: 0.0, flags: self.flags | validity::COMMAND_MISSED, ..self }
    }

    pub(super) fn end(&self) -> i64 {
        self.end
    }

    pub(super) fn zero(&self) -> Zero {
        self.zero
    }
}

impl Axis {
    /// What the guard is told of the valve.
    pub(super) fn sensors(&self) -> Sensors {
        let angle_rad = self.encoder_angle_rad(self.zero);
        let encoder_rad = (self.measured() && !self.needs_bring_up()).then_some(angle_rad);
        Sensors { encoder_rad, homed: self.homed() }
    }

    /// Whether the count is measured, not the command's echo.
    fn measured(&self) -> bool {
        self.params.position_is_measured && self.counter.is_some()
    }

    fn homed(&self) -> bool {
        let absolute = matches!(self.params.homing, Homing::Absolute { .. });
        let known = absolute || self.found_zero;
        self.counter.is_some() && !self.needs_bring_up() && known && !self.zero_in_doubt
    }

    /// What the encoder reads, from a zero.
    fn encoder_angle_rad(&self, zero: Zero) -> f64 {
        self.count() as f64 * self.params.drive.microstep_angle_rad + zero.encoder_rad
    }

    /// Feedback k, with the motion that ended at t_k.
    pub(super) fn feedback(&self, cycle: u64, arrived: &Moved) -> Feedback {
        let failed = matches!(self.phase, Phase::Failed { .. });
        let enabled = self.phase == Phase::Enabled;
        let accepted = if enabled { arrived.end } else { self.count() + arrived.zero.microsteps };
        let measured = self.measured();
        let microstep_rad = self.params.drive.microstep_angle_rad;
        let own = arrived.flags & !(validity::ENERGISED | validity::STANDSTILL);
        let bits = [
            (validity::ENCODER, measured && !self.needs_bring_up()),
            (validity::HOMED, self.homed()),
            (validity::ENERGISED, enabled && arrived.flags & validity::ENERGISED != 0),
            (validity::STANDSTILL, self.stands(cycle, arrived)),
            (validity::STOPPED_ITSELF, failed),
            (validity::HOME_SWITCH, self.inputs.digital_inputs & HOME_SWITCH != 0),
        ];
        let flags = bits.iter().filter(|(_, set)| *set).fold(own, |flags, (bit, _)| flags | bit);
        Feedback {
            encoder_counts: if measured { self.count() } else { 0 },
            angle_rad: if measured {
                self.encoder_angle_rad(arrived.zero)
            } else {
                accepted as f64 * microstep_rad
            },
            zero_id: arrived.zero.id,
            accepted_microsteps: accepted,
            pulse_rate_hz: if enabled { arrived.pulse_rate_hz } else { 0.0 },
            validity: flags,
            drive_fault: if failed { self.fault } else { arrived.fault }.code(),
            status_word: self.status_word(),
            digital_inputs: u64::from(self.inputs.digital_inputs),
            command_cycle: arrived.command_cycle,
            phase_correction_ns: self.phase_correction_ns,
            ..Feedback::default()
        }
    }

    /// Bits 0 to 15: status word; 16 to 31: error code; 32 to 39: mode; 40 to 47: AL status; 48 to 63: AL code.
    fn status_word(&self) -> u64 {
        let (al_status, al_code) = self.al;
        u64::from(self.inputs.status)
            | u64::from(self.inputs.error_code) << 16
            | u64::from(self.inputs.mode.cast_unsigned()) << 32
            | u64::from(al_status & 0xFF) << 40
            | u64::from(al_code) << 48
    }

    /// Cycles after a fault within which the drive's own ramp is over.
    pub(super) fn ramp_cycles(&self) -> u64 {
        drive::stop_cycles_bound(&self.params.drive) + self.params.judge.bus_lost_cycles + 2
    }

    /// Whether the drive stands. One that can't be heard stands once its own ramp must be over.
    fn stands(&self, cycle: u64, arrived: &Moved) -> bool {
        match self.phase {
            Phase::Failed { at_cycle } => {
                let ramps = matches!(
                    DriveState::of(self.inputs.status),
                    DriveState::OperationEnabled
                        | DriveState::QuickStopActive
                        | DriveState::FaultReactionActive
                );
                cycle.saturating_sub(at_cycle) > self.ramp_cycles()
                    || !ramps && self.judge.missing_cycles() == 0
            }
            Phase::Enabled => arrived.flags & validity::STANDSTILL != 0,
            // In homing the drive moves by itself, where its method says so.
            Phase::Homing { .. } => false,
            Phase::Off | Phase::Enabling { .. } => true,
        }
    }
}
