//! The state of homing, and its readings so far.

use crate::homing_params::Homing;
use crate::params::Params;
use drive::Microsteps;
use serde::{Deserialize, Serialize};
use signals::{Feedback, HomingPhase};

/// Rests on the way through an electrical period; the first ten orders of a micro-step error average out over them.
pub(crate) const POINTS: usize = 16;

/// The state of homing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct HomingState {
    pub phase: HomingPhase,
    /// Where the command is to go.
    pub goal: Microsteps,
    /// Where the search began.
    pub origin: Microsteps,
    /// Angle at which the mark was met, in the frame of the present zero, rad.
    pub mark_rad: f64,
    /// Rests taken of the alignment, cycles since the command came to rest, and the sum of readings there, rad.
    pub point: usize,
    pub rested_cycles: u64,
    pub sum_rad: f64,
    pub readings: u64,
    /// Reading minus command at each dwell: of the forward pass, then forward and reverse summed.
    pub lag_rad: [f64; POINTS],
    /// Towards a hard stop: where the phase began, the command's lead in sliding, rad, the furthest angle so far, rad, and
    /// command and reading at the last look, rad, with the cycles since then.
    pub from: Microsteps,
    pub sliding_lead_rad: Option<f64>,
    pub furthest_rad: f64,
    pub looked_at_rad: (f64, f64),
    pub looked_cycles: u64,
    /// Encoder's angle minus the one that the teeth hold, rad, and the largest distance of a rest from it, rad.
    pub offset_rad: f64,
    pub spread_rad: f64,
    /// What the drive is asked to shift its zero by.
    pub shift: ZeroShift,
}

/// A new zero for the drive: counts and encoder shift by these.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ZeroShift {
    /// Counts up with each homing; 0: no shift.
    pub id: u64,
    pub angle_rad: f64,
    pub microsteps: i64,
}

impl HomingState {
    /// No homing yet.
    pub(crate) fn none() -> Self {
        Self {
            phase: HomingPhase::None,
            goal: Microsteps::default(),
            origin: Microsteps::default(),
            mark_rad: 0.0,
            point: 0,
            rested_cycles: 0,
            sum_rad: 0.0,
            readings: 0,
            lag_rad: [0.0; POINTS],
            from: Microsteps::default(),
            sliding_lead_rad: None,
            furthest_rad: 0.0,
            looked_at_rad: (0.0, 0.0),
            looked_cycles: 0,
            offset_rad: 0.0,
            spread_rad: 0.0,
            shift: ZeroShift::default(),
        }
    }

    /// Begins where the drive holds the motor.
    pub(crate) fn begun(self, params: &Params, homing: &Homing, feedback: &Feedback) -> Self {
        let microstep_rad = params.drive.microstep_angle_rad;
        let position = Microsteps::from(feedback.accepted_microsteps);
        let way = (homing.longest_rad / microstep_rad).copysign(homing.speed_rad_per_s);
        Self {
            phase: HomingPhase::Seek,
            goal: Microsteps(position.0 + way),
            origin: position,
            from: position,
            furthest_rad: feedback.angle_rad,
            looked_at_rad: (position.0 * microstep_rad, feedback.angle_rad),
            // The drive may have a zero from before this controller was restarted.
            shift: ZeroShift { id: feedback.zero_id, ..ZeroShift::default() },
            ..Self::none()
        }
    }
}
