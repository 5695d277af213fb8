//! What a page may ask for. Nothing of it reaches the loop: set-points and orders go over the instance's own socket.

use crate::trigger::Settings;
use serde::Deserialize;

/// A request.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Request {
    /// Send these signals from now on, and their past.
    Show { signals: Vec<String> },
    /// Wait for this trigger, or for none.
    Trigger { settings: Option<Settings> },
    /// Wait again.
    Arm,
    /// Capture now.
    Force,
    /// Save every triggered capture, up to the limit.
    AutoSave { on: bool },
    /// Save these cycles; `zero` is what the time axis counts from.
    Save { from: u64, to: u64, zero: u64 },
    /// Save a capture that is held.
    SaveCapture { id: u64 },
    /// Send the samples of a capture that is held.
    Samples { id: u64 },
    /// Open a saved capture.
    Open { file: String },
    /// Answer with the loop's clock.
    Ping { t: f64 },
}
