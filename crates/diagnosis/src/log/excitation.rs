//! What a log's motion excites: presliding swings, reversals, inertia behind a spring, frequencies. This decides which
//! twins the data tell apart.

use crate::log::campaign::Campaign;
use crate::log::facts::{Excitation, Facts};
use crate::log::piece::Piece;
use std::collections::BTreeMap;

/// A swing up to this multiple of the break-away deflection counts as presliding.
const WITHIN: f64 = 6.0;
/// Least swing between reversals: this part of the break-away deflection, and this multiple of the angle's noise.
const TURN: f64 = 0.1;
const TURN_NOISE: f64 = 5.0;
/// A log moves both ways if at least one in this many moving samples goes the rarer way.
const BOTH_WAYS: f64 = 20.0;
/// Window for a frequency, samples.
const WINDOW: usize = 64;
/// Frequencies closer than this factor count as one.
const APART: f64 = 1.5;

/// The excitation of a campaign; `noise` is that of the predicted channel.
pub(crate) fn excitation(campaign: &Campaign, noise: f64) -> Excitation {
    let facts = &campaign.facts;
    let mut found = Excitation::default();
    let mut rates = Vec::new();
    let mut ringing = 0.0;
    let mut ways = (0, 0);
    for piece in &campaign.pieces {
        let course = DrivingMotion::of(piece, facts);
        let angle_noise_rad = if facts.kind.motion_is_measured {
            ringing += ringing_of(&course, facts, noise);
            rates.extend(rate_of(&course, facts, noise));
            0.0
        } else {
            found.near_resonance += near_resonance(&course, facts, noise);
            noise
        };
        ways.0 += course.speed.iter().filter(|speed| **speed > 0.0).count();
        ways.1 += course.speed.iter().filter(|speed| **speed < 0.0).count();
        let (small, turns) = swings(&course.angle_rad, facts, angle_noise_rad);
        found.small_swings += small;
        found.turns += turns;
    }
    found.ringing = ringing.sqrt();
    found.both_ways = BOTH_WAYS * ways.0.min(ways.1) as f64 >= (ways.0 + ways.1) as f64;
    found.frequencies = distinct(rates);
    found.drift_with_pressure = drift(campaign, |piece| piece.driven.pressure_pa());
    found.drift_with_temperature = drift(campaign, |piece| piece.driven.temperature_c());
    found
}

/// The motion that drives a piece: measured in a torque log, commanded in an angle log.
struct DrivingMotion {
    angle_rad: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
}

impl DrivingMotion {
    fn of(piece: &Piece, facts: &Facts) -> Self {
        if facts.kind.motion_is_measured {
            return Self {
                angle_rad: piece.motions.iter().map(|motion| motion.angle_rad).collect(),
                speed: piece.motions.iter().map(|motion| motion.speed_rad_per_s).collect(),
                acceleration: piece.motions.iter().map(|motion| motion.acceleration_rad_per_s2).collect(),
            };
        }
        let speed = slopes(piece.driven.command_rad(), piece.driven.time_s());
        let acceleration = slopes(&speed, piece.driven.time_s());
        Self { angle_rad: piece.driven.command_rad().to_vec(), speed, acceleration }
    }
}

fn slopes(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let pair = |pair: &[f64]| pair.iter().fold(0.0, |before, after| after - before);
    let slope = |(values, times): (&[f64], &[f64])| pair(values) / pair(times);
    values.windows(2).zip(time_s.windows(2)).map(slope).collect()
}

/// The deflection of bristles, and in angle logs of the motor, at break-away, rad.
fn reach_rad(facts: &Facts) -> f64 {
    let static_nm = facts.static_nm.unwrap_or(facts.coulomb_nm);
    let bristles = facts.stiffness.map_or(0.0, |stiffness| static_nm / stiffness);
    bristles + facts.rotor().map_or(0.0, |(holding_nm, teeth)| static_nm / (holding_nm * teeth))
}

/// Counts the presliding swings, and the reversals.
fn swings(angle_rad: &[f64], facts: &Facts, noise_rad: f64) -> (usize, usize) {
    let reach = reach_rad(facts);
    let least = (TURN * reach).max(TURN_NOISE * noise_rad).max(1e-9);
    let (mut small, mut turns) = (0, 0);
    let Some(&first) = angle_rad.first() else { return (0, 0) };
    let (mut low, mut high, mut way, mut turned_at) = (first, first, 0.0, first);
    for &angle in angle_rad {
        (low, high) = (low.min(angle), high.max(angle));
        let turned = if way >= 0.0 && high - angle > least { Some((-1.0, high)) } else { None };
        let turned = turned.or((way <= 0.0 && angle - low > least).then_some((1.0, low)));
        let Some((new_way, turn)) = turned else { continue };
        if way != 0.0 {
            turns += 1;
            small += usize::from((turn - turned_at).abs() < WITHIN * reach);
        }
        (way, turned_at, low, high) = (new_way, turn, angle, angle);
    }
    (small, turns)
}

fn rms_about_mean(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// RMS of the acceleration and the rate (rad/s) at which a stretch swings.
fn swing(speed: &[f64], acceleration: &[f64]) -> (f64, f64) {
    let acceleration = rms_about_mean(acceleration);
    (acceleration, acceleration / rms_about_mean(speed).max(f64::MIN_POSITIVE))
}

/// Squared signal-to-noise ratio of the torque that a spring as stiff as the bristles would add to the inertia's,
/// summed over samples.
fn ringing_of(course: &DrivingMotion, facts: &Facts, noise_nm: f64) -> f64 {
    let (Some(inertia), Some(stiffness)) = (facts.load_inertia, facts.stiffness) else { return 0.0 };
    let windows = course.speed.chunks(WINDOW).zip(course.acceleration.chunks(WINDOW));
    windows
        .map(|(speed, acceleration)| {
            let (acceleration, rate) = swing(speed, acceleration);
            let torque_nm = inertia * acceleration;
            // An inertia torque within the noise may be the encoder's error.
            let part = if torque_nm > noise_nm { rate * rate * inertia / stiffness } else { 0.0 };
            speed.len() as f64 * (part * torque_nm / noise_nm).powi(2)
        })
        .sum()
}

/// The rate, rad/s, at which a piece swings; `None` if the inertia's torque is within the noise.
fn rate_of(course: &DrivingMotion, facts: &Facts, noise_nm: f64) -> Option<f64> {
    let (acceleration, rate) = swing(&course.speed, &course.acceleration);
    (facts.load_inertia? * acceleration * (course.speed.len() as f64).sqrt() > 5.0 * noise_nm).then_some(rate)
}

fn distinct(mut rates: Vec<f64>) -> usize {
    rates.sort_by(f64::total_cmp);
    let mut last = 0.0;
    rates.retain(|rate| {
        let apart = *rate > APART * last;
        if apart {
            last = *rate;
        }
        apart
    });
    rates.len()
}

/// Counts samples in windows whose command moves at more than a third of the motor's resonance, with an amplitude above
/// noise.
fn near_resonance(course: &DrivingMotion, facts: &Facts, noise_rad: f64) -> usize {
    let Some((holding_nm, teeth)) = facts.motor else { return 0 };
    let inertia = facts.load_inertia.unwrap_or(0.0) + facts.rotor_inertia;
    let resonance = (holding_nm * teeth / inertia).sqrt();
    let windows = course.speed.chunks(WINDOW).zip(course.acceleration.chunks(WINDOW));
    let near = windows.filter(|(speed, acceleration)| {
        let (acceleration, rate) = swing(speed, acceleration);
        rate > resonance / 3.0 && acceleration / (rate * rate) > noise_rad
    });
    near.map(|(speed, _)| speed.len()).sum()
}

/// The correlation of a channel's mean over a run with the distance travelled before it.
fn drift(campaign: &Campaign, channel: impl Fn(&Piece) -> &[f64]) -> f64 {
    let mut runs: BTreeMap<usize, (f64, f64, f64)> = BTreeMap::new();
    for piece in campaign.pieces.iter().filter(|piece| !channel(piece).is_empty()) {
        let run = runs.entry(piece.run).or_insert((piece.past.contact.distance_rad, 0.0, 0.0));
        run.1 += channel(piece).iter().sum::<f64>();
        run.2 += channel(piece).len() as f64;
    }
    let points: Vec<(f64, f64)> = runs.values().map(|run| (run.0, run.1 / run.2)).collect();
    let count = points.len().max(1) as f64;
    let mean =
        points.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
    let products = points.iter().fold((0.0, 0.0, 0.0), |sum: (f64, f64, f64), point| {
        let (x, y) = (point.0 - mean.0, point.1 - mean.1);
        (sum.0 + x * x, sum.1 + x * y, sum.2 + y * y)
    });
    let scale = (products.0 * products.2).sqrt();
    if scale > 0.0 { products.1 / scale } else { 0.0 }
}
