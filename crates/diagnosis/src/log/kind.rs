//! Torque logs and angle logs: the numbers in which their diagnosis differs. Where a step is another one altogether, it asks
//! `motion_is_measured`.

use crate::numerics::loss::Loss;
use log_data::Channel;
use valve_model::SeenIn;

/// What a log lets the model predict, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LogKind {
    /// The channel that the model predicts.
    pub channel: Channel,
    /// Whether the motion is measured and the torque follows from it; else the motion itself is predicted, from the command.
    pub motion_is_measured: bool,
    /// The effects that no log of this kind shows.
    pub unseen: SeenIn,
    /// How groups of samples count in a fit.
    pub loss: Loss,
    /// A log of so many samples is fitted whole ...
    pub most_fitted_whole: usize,
    /// ... and of a longer one so many.
    pub fitted_of_more: usize,
    /// Of more fitted samples than this the screening looks at some of the folds alone.
    pub most_screened_whole: usize,
    /// So many samples are simulated at most before a diagnosis concludes, one of bristles counted four times: about 40 s of torques or of
    /// angles, on two cores.
    pub most_simulated: u64,
    /// The part of these that the first search has, so that something is left for those after it.
    pub first_search: f64,
    /// Gauss-Newton steps in which a piece's start converges; angle logs search for it separately.
    pub settling_steps: usize,
    /// Other starts that are tried of a piece that fits badly, in standard deviations of the encoder: a rotor close to breaking away
    /// slips or holds by less than that.
    pub other_starts: &'static [f64],
}

impl LogKind {
    const TORQUE: Self = Self {
        channel: Channel::Torque,
        motion_is_measured: true,
        unseen: SeenIn::AngleLogs,
        loss: Loss::Squares,
        most_fitted_whole: 80_000,
        fitted_of_more: 60_000,
        most_screened_whole: 60_000,
        most_simulated: 480_000_000,
        first_search: 0.6,
        settling_steps: 4,
        other_starts: &[],
    };
    /// A sample of an angle costs ten times as much as one of a torque.
    const ANGLE: Self = Self {
        channel: Channel::Angle,
        motion_is_measured: false,
        unseen: SeenIn::TorqueLogs,
        loss: Loss::OwnNoise,
        most_fitted_whole: 64_000,
        fitted_of_more: 32_000,
        most_screened_whole: 16_000,
        most_simulated: 60_000_000,
        first_search: 1.0,
        settling_steps: 2,
        other_starts: &[-4.0, -2.0, -1.0, 1.0, 2.0, 4.0],
    };

    /// By the channel that the model predicts: torque where it was measured, else the angle.
    pub fn predicting(channel: Channel) -> Self {
        if channel == Channel::Torque { Self::TORQUE } else { Self::ANGLE }
    }

    /// How many samples of a log that has `total` are fitted.
    pub fn fitted_samples(&self, total: usize) -> usize {
        if total <= self.most_fitted_whole { total } else { self.fitted_of_more }
    }
}
