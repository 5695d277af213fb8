//! State of the contact before each piece: time at rest, distance travelled, and the side it came from. From the angles alone.
//!
//! A bristle that saturates at the break-away deflection (Prandtl's element) separates slip from presliding.

use log_data::{Log, Run};
use prediction::Noise;
use valve_model::{ContactPast, FrictionLaw, Model};

/// The state of the contact before a piece.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Before {
    pub contact: ContactPast,
    /// The bristles' deflection as a fraction of the break-away deflection, −1 to 1.
    pub side: f64,
}

/// Follows the contact through the log.
pub(crate) struct Follower {
    most_rad: f64,
    slip_length_rad: f64,
    bristle_rad: f64,
    rest_s: f64,
    distance_rad: f64,
    /// The longest rest so far, s.
    pub longest_rest_s: f64,
}

impl Follower {
    pub fn new(model: &Model) -> Self {
        let law = FrictionLaw::new(&model.friction);
        let most_rad = law.break_away_deflection_rad().max(1e-6);
        Self {
            most_rad,
            slip_length_rad: most_rad,
            bristle_rad: 0.0,
            rest_s: 0.0,
            distance_rad: 0.0,
            longest_rest_s: 0.0,
        }
    }

    /// A rest between runs.
    pub fn rest(&mut self, duration_s: f64) {
        self.rest_s += duration_s.max(0.0);
        self.longest_rest_s = self.longest_rest_s.max(self.rest_s);
    }

    /// Follows a run. Returns the state before each of the `rows`, which must be in ascending order.
    pub fn run(&mut self, run: &Run, noise: Noise, rows: &[usize]) -> Vec<Before> {
        let play_rad = 3.0 * noise.beyond_quantisation_rad() + 0.5 * noise.step_rad;
        let mut drawn = run.angle_rad.first().copied().unwrap_or(0.0);
        let mut before_s = run.start_s();
        let mut wanted = rows.iter().copied().peekable();
        let mut found = Vec::with_capacity(rows.len());
        for (index, (time_s, angle_rad)) in run.time_s.iter().zip(&run.angle_rad).enumerate() {
            while wanted.next_if(|row| *row == index).is_some() {
                let contact = ContactPast {
                    rest_s: self.rest_s,
                    distance_rad: self.distance_rad,
                    ..ContactPast::default()
                };
                found.push(Before { contact, side: self.bristle_rad / self.most_rad });
            }
            let now = drawn.max(angle_rad - play_rad).min(angle_rad + play_rad);
            self.travel(now - drawn, time_s - before_s);
            (drawn, before_s) = (now, *time_s);
        }
        found
    }

    fn travel(&mut self, turn_rad: f64, dt_s: f64) {
        self.distance_rad += turn_rad.abs();
        let bristle = (self.bristle_rad + turn_rad).clamp(-self.most_rad, self.most_rad);
        let slip_rad = (turn_rad - (bristle - self.bristle_rad)).abs();
        self.bristle_rad = bristle;
        self.rest_s = self.rest_s * (-slip_rad / self.slip_length_rad).exp() + dt_s;
        if slip_rad == 0.0 {
            self.longest_rest_s = self.longest_rest_s.max(self.rest_s);
        }
    }

    /// The distance so far, rad.
    pub fn distance_rad(&self) -> f64 {
        self.distance_rad
    }
}

/// The log's runs in order of time, each with the rest before it, s; zero if the runs have clocks of their own.
pub(crate) fn in_order(log: &Log) -> Vec<(usize, f64)> {
    let one_clock = log.is_on_one_clock();
    let mut order: Vec<usize> = (0..log.runs.len()).collect();
    let start = |index: &usize| log.runs.get(*index).map_or(0.0, Run::start_s);
    order.sort_by(|a, b| start(a).total_cmp(&start(b)));
    let mut ended_s = f64::NAN;
    let mut found = Vec::new();
    for index in order {
        let rest_s = if one_clock && ended_s.is_finite() { start(&index) - ended_s } else { 0.0 };
        ended_s = log.runs.get(index).map_or(f64::NAN, Run::end_s);
        found.push((index, rest_s));
    }
    found
}
