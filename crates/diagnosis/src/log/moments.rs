//! What a piece's motion is at each sample, with the rest and the distance before it.

use crate::log::piece::Piece;
use valve_model::Covariate;

/// A spool slower than this rests, rad/s.
pub(crate) const RESTS: f64 = 1e-3;

/// One sample's motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub time_s: f64,
    pub angle_rad: f64,
    pub speed_rad_per_s: f64,
    pub acceleration_rad_per_s2: f64,
    /// Time at rest so far.
    pub rest_s: f64,
    /// Distance travelled over the log so far.
    pub distance_rad: f64,
}

/// What laws are functions of, at each sample of a piece, in the order of [`Covariate::ALL`].
pub(crate) fn covariates(piece: &Piece) -> impl Iterator<Item = [f64; 8]> + '_ {
    moments(piece).enumerate().map(|(index, at)| {
        let (pressure_pa, temperature_c) = piece.driven.conditions(index + piece.driven.lead());
        Covariate::ALL.map(|of| match of {
            Covariate::Angle => at.angle_rad,
            Covariate::Speed => at.speed_rad_per_s,
            Covariate::Acceleration => at.acceleration_rad_per_s2,
            Covariate::Time => at.time_s,
            Covariate::PressureDrop => pressure_pa,
            Covariate::OilTemperature => temperature_c,
            Covariate::TimeAtRest => at.rest_s,
            Covariate::Distance => at.distance_rad,
        })
    })
}

/// The samples of a piece, in order.
pub(crate) fn moments(piece: &Piece) -> impl Iterator<Item = Moment> + '_ {
    let (mut rest_s, mut before_s) = (0.0, f64::NAN);
    let mut distance_rad = piece.past.contact.distance_rad;
    piece.driven.time_s().iter().enumerate().map(move |(index, time_s)| {
        let dt_s = if before_s.is_finite() { time_s - before_s } else { 0.0 };
        before_s = *time_s;
        let (angle_rad, speed_rad_per_s, acceleration_rad_per_s2) = piece.kinematics(index);
        rest_s = if speed_rad_per_s.abs() > RESTS { 0.0 } else { rest_s + dt_s };
        distance_rad += speed_rad_per_s.abs() * dt_s;
        Moment { time_s: *time_s, angle_rad, speed_rad_per_s, acceleration_rad_per_s2, rest_s, distance_rad }
    })
}
