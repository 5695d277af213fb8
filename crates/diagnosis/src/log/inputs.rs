//! What a piece's torque or angle is predicted from.

use crate::log::course::WholeRun;
use crate::log::driven::Driven;
use crate::log::past::Before;
use crate::log::predictions::Stretch;
use crate::log::work::Work;
use std::ops::Range;
use std::sync::Arc;
use valve_model::MotionSample;

/// The inputs of a piece's prediction.
pub(crate) struct Inputs<'a> {
    pub driven: &'a Driven,
    /// The motion of each sample in a torque log, of the first in an angle log.
    pub motions: &'a [MotionSample],
    /// Standard deviation of the measured angles, rad.
    pub deviation_rad: f64,
    pub past: Before,
    /// What is predicted, if it will be asked for again; `None` of a motion that was made up.
    pub stretch: Option<Stretch>,
    /// The piece's run and its rows in it, if the run is predicted as a whole.
    pub whole_run: Option<(&'a Arc<WholeRun>, &'a Range<usize>)>,
    pub work: &'a Work,
}
