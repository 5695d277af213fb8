//! The reference on its way to the command: what arrived, how fast it may run, shaped, and re-entered after a stop.

pub(crate) mod re_entry;
pub(crate) mod shaper;
pub(crate) mod time_scale;
pub(crate) mod window;
