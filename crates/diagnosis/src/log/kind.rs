//! Torque logs and angle logs: everything in which their diagnosis differs, with the reasons.

use crate::numerics::loss::Loss;
use log_data::Channel;
use valve_model::SeenIn;

/// Least variance of a torque, (N·m)²: without it, simulated torques would be taken as exact.
const LEAST_NM2: f64 = 1e-9;
/// Least standard deviation of an angle, rad: the finest encoders' own errors. Without it, simulated angles would be taken as exact.
const FINEST_RAD: f64 = 1e-7;

/// What a log lets the model predict, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LogKind {
    /// The channel that the model predicts.
    pub channel: Channel,
    /// Whether the motion is measured and the torque follows from it; else the motion itself is predicted, from the command.
    pub motion_is_measured: bool,
    /// True if predictions depend smoothly on the model's parameters, however poor the fit. Torques along a measured motion do;
    /// a predicted rotor slips at another moment instead.
    pub smooth: bool,
    /// Whether errors of the measured motion are in the prediction, so that the residual's noise depends on the model.
    pub motion_errs: bool,
    /// The effects that no log of this kind shows.
    pub unseen: SeenIn,
    /// How groups of samples count in a fit.
    pub loss: Loss,
    /// A log of up to this many samples is fitted whole ...
    pub most_fitted_whole: usize,
    /// ... and of a longer one this many samples.
    pub fitted_of_more: usize,
    /// Whether pieces that are not fitted but stand out are fitted too. Of an angle log a seventh may be fitted, in pieces of a second or so; of
    /// torques more, in whole runs, and those that stand out are mostly the ones with the worst noise or a zero of their own.
    pub fits_what_stands_out: bool,
    /// If more samples than this are fitted, the screening uses only some of the folds.
    pub most_screened_whole: usize,
    /// Most samples that are simulated before a diagnosis concludes; a torque sample with bristles counts four times. It is
    /// about 20 s of torques, 40 s of angles, on two cores.
    pub most_simulated: u64,
    /// Most orders above the low ones that are searched for at once in a torque over the angle.
    pub most_high_orders: usize,
    /// The fraction of `most_simulated` that the first search may use, so that some is left for later ones.
    pub first_search: f64,
    /// The fraction of `most_simulated` that the fits of a conclusion may use beyond it: a search that was ended is judged at the best
    /// numbers of the causes it has, not at those where it was ended.
    pub reserve: f64,
    /// The same for one search for laws that the list lacks: hundreds of them are screened.
    pub for_laws: f64,
    /// Gauss-Newton steps in which a piece's start converges; angle logs search for it separately.
    pub settling_steps: usize,
    /// Other initial angles that are tried for a badly fitted piece, in standard deviations of the encoder: a rotor close to
    /// break-away slips or holds for differences smaller than that.
    pub other_starts: &'static [f64],
}

impl LogKind {
    const TORQUE: Self = Self {
        channel: Channel::Torque,
        motion_is_measured: true,
        smooth: true,
        motion_errs: true,
        unseen: SeenIn::AngleLogs,
        loss: Loss::Squares,
        most_fitted_whole: 80_000,
        fitted_of_more: 60_000,
        fits_what_stands_out: false,
        most_screened_whole: 60_000,
        most_simulated: 480_000_000,
        most_high_orders: 12,
        first_search: 0.6,
        reserve: 0.15,
        for_laws: 0.3,
        settling_steps: 4,
        other_starts: &[],
    };
    /// A sample of an angle costs ten times as much as one of a torque.
    const ANGLE: Self = Self {
        channel: Channel::Angle,
        motion_is_measured: false,
        smooth: false,
        motion_errs: false,
        unseen: SeenIn::TorqueLogs,
        loss: Loss::OwnNoise,
        most_fitted_whole: 64_000,
        fitted_of_more: 32_000,
        fits_what_stands_out: true,
        most_screened_whole: 16_000,
        most_simulated: 60_000_000,
        most_high_orders: 4,
        first_search: 1.0,
        reserve: 0.15,
        for_laws: 0.15,
        settling_steps: 2,
        other_starts: &[-4.0, -2.0, -1.0, 1.0, 2.0, 4.0],
    };

    /// By the channel that the model predicts: torque where it was measured, else the angle.
    pub fn predicting(channel: Channel) -> Self {
        if channel == Channel::Torque { Self::TORQUE } else { Self::ANGLE }
    }

    /// Whether the residual is a torque, which has a zero of its own and may be a function of the angle.
    pub fn residual_is_torque(&self) -> bool {
        self.channel == Channel::Torque
    }

    /// Least variance of the measured channel's own noise, for an encoder with this step.
    pub fn least_variance(&self, step_rad: f64) -> f64 {
        match self.channel {
            Channel::Torque => LEAST_NM2,
            _ => (step_rad * step_rad / 12.0).max(FINEST_RAD * FINEST_RAD),
        }
    }

    /// How many samples of a log that has `total` are fitted.
    pub fn fitted_samples(&self, total: usize) -> usize {
        if total <= self.most_fitted_whole { total } else { self.fitted_of_more }
    }
}
