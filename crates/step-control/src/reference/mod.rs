//! The reference on its way to the command: what has arrived, its time scale, shaping, and re-entry after an interruption.

pub(crate) mod re_entry;
pub(crate) mod shaper;
pub(crate) mod time_scale;
pub(crate) mod window;
