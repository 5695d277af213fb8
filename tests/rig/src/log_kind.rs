//! The two kinds of logs.

use serde::{Deserialize, Serialize};

/// Which channel the log has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum LogKind {
    /// `torque` and `angle`.
    Torque,
    /// `angle_command` and `angle`.
    Angle,
}
