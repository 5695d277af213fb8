//! Parameters changed while the controller runs: checked, taken over between two cycles, kept until it ends.

use crate::observer::riccati::Filter;
use crate::observer::{LARGEST_HZ, Observer, SLOWEST_HZ};
use crate::params::{Compensation, Params};
use serde::{Deserialize, Serialize};
use signals::{ControlParameter, OperatorResult};

/// The smallest limit of the following error that can be set, rad.
const SMALLEST_ERROR_RAD: f64 = 1e-9;

/// What was changed; all else is as in [`Params`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tuning {
    compensation: Option<Compensation>,
    filter: Option<Filter>,
    observer_limit_nm: Option<f64>,
    max_following_error_rad: Option<f64>,
    following_error_per_speed_s: Option<f64>,
}

impl Tuning {
    /// Changes a parameter, or says that it can't have this value.
    pub(crate) fn set(&mut self, params: &Params, parameter: ControlParameter, value: f64) -> OperatorResult {
        let is_within = |(low, high): (f64, f64)| (low..=high).contains(&value);
        let value_within = params.range(parameter).filter(|range| is_within(*range)).map(|_| value);
        let taken = match parameter {
            ControlParameter::None => false,
            ControlParameter::CompensationLevel => put(&mut self.compensation, level(value)),
            ControlParameter::ObserverBandwidth => {
                let retuned = |observer: &Observer| observer.retuned(self.filter(observer), value);
                let filter = value_within.and(params.observer.as_ref()).map(retuned);
                put(&mut self.filter, filter)
            }
            ControlParameter::ObserverLimit => put(&mut self.observer_limit_nm, value_within),
            ControlParameter::MaxFollowingError => put(&mut self.max_following_error_rad, value_within),
            ControlParameter::FollowingErrorPerSpeed => {
                put(&mut self.following_error_per_speed_s, value_within)
            }
        };
        if taken { OperatorResult::Done } else { OperatorResult::Refused }
    }

    /// A cycle later: the observer's gain follows its new bandwidth.
    pub(crate) fn settle(&mut self, observer: &Observer) {
        if let Some(filter) = &mut self.filter {
            observer.settle(filter);
        }
    }

    pub(crate) fn compensation(&self, params: &Params) -> Compensation {
        self.compensation.unwrap_or(params.compensation)
    }

    pub(crate) fn filter(&self, observer: &Observer) -> Filter {
        self.filter.unwrap_or(observer.filter)
    }

    pub(crate) fn observer_limit_nm(&self, observer: &Observer) -> f64 {
        self.observer_limit_nm.unwrap_or(observer.settings.torque_limit_nm)
    }

    /// Following error that is a fault at a speed, rad.
    pub(crate) fn following_error_limit_rad(&self, params: &Params, speed_rad_per_s: f64) -> f64 {
        let at_rest = self.max_following_error_rad.unwrap_or(params.max_following_error_rad);
        let per_speed = self.following_error_per_speed_s.unwrap_or(params.following_error_per_speed_s);
        at_rest + per_speed * speed_rad_per_s.abs()
    }
}

impl Params {
    /// What a parameter may be, SI, both ends included; `None` where this controller doesn't have it.
    pub fn range(&self, parameter: ControlParameter) -> Option<(f64, f64)> {
        match parameter {
            ControlParameter::None => None,
            ControlParameter::CompensationLevel => Some((0.0, (LEVELS.len() - 1) as f64)),
            ControlParameter::ObserverBandwidth => self.observer.as_ref().map(|_| (SLOWEST_HZ, LARGEST_HZ)),
            ControlParameter::ObserverLimit => {
                self.observer.as_ref().map(|_| (0.0, self.motor.holding_torque_nm))
            }
            // The scenario's value is the upper limit: what stops the valve can be tightened remotely, never widened.
            ControlParameter::MaxFollowingError => Some((SMALLEST_ERROR_RAD, self.max_following_error_rad)),
            ControlParameter::FollowingErrorPerSpeed => Some((0.0, self.following_error_per_speed_s)),
        }
    }
}

/// Stores a value if there is one; returns whether there is.
fn put<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    let taken = value.is_some();
    if taken {
        *place = value;
    }
    taken
}

/// By their codes.
const LEVELS: [Compensation; 4] =
    [Compensation::None, Compensation::CoulombViscous, Compensation::Full, Compensation::FullWithEffects];

fn level(value: f64) -> Option<Compensation> {
    LEVELS.into_iter().zip(0_u8..).find(|(_, code)| f64::from(*code) == value).map(|(level, _)| level)
}
