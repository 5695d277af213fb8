//! What an axis is set to.

use crate::drive_file::{Homing, Profile};
use crate::judge::JudgeParams;
use serde::{Deserialize, Serialize};

/// What an axis is set to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AxisParams {
    /// The guard's limits and reactions.
    pub drive: drive::Params,
    /// How the drive is spoken to.
    pub profile: Profile,
    /// 1, or −1 where the drive's counts go the other way than the valve's angle.
    pub direction: i64,
    /// Whether the position on the bus is measured; else it is the command.
    pub position_is_measured: bool,
    /// How the zero is found.
    pub homing: Homing,
    /// How long enabling may take, cycles.
    pub enable_cycles: u64,
    /// When the bus is lost.
    pub judge: JudgeParams,
}

impl AxisParams {
    /// Counts of a turn of the encoder that the drive has on the bus: one a micro-step; `None` where its position is the command.
    pub fn counts_per_turn(&self) -> Option<f64> {
        self.position_is_measured.then(|| std::f64::consts::TAU / self.drive.microstep_angle_rad)
    }
}
