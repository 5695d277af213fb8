//! A planned motion as pieces of constant jerk, relative to the angle where it starts.
//!
//! The planner's result is integrated anew from its times and jerks, so that the pieces join without a gap, and is
//! checked as a whole: a plan that leaves a limit anywhere is not used, whatever the planner says of it.

use crate::Limits;
use signals::Kinematics;

/// Pieces a plan can have: three of a change of speed, and seven of a motion from rest to rest.
const MAX_PIECES: usize = 10;

/// Relative tolerance of the check against the limits; the planner works to 1e-12.
const LIMIT_TOLERANCE: f64 = 1e-10;

/// A stretch of constant jerk.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Piece {
    duration_s: f64,
    start: Kinematics,
}

impl Piece {
    /// Lowest and highest value of a quantity with the given value and slope at the piece's ends, quadratic with its
    /// vertex where the slope passes zero: only ends and vertex can be extreme.
    fn extremes(&self, value: impl Fn(&Kinematics) -> f64, stationary_s: [Option<f64>; 2]) -> (f64, f64) {
        let start = value(&self.start);
        let end = value(&self.start.after(self.duration_s));
        let mut range = (start.min(end), start.max(end));
        for time_s in stationary_s.into_iter().flatten() {
            if time_s > 0.0 && time_s < self.duration_s {
                let there = value(&self.start.after(time_s));
                range = (range.0.min(there), range.1.max(there));
            }
        }
        range
    }

    /// When the acceleration is zero.
    fn level_speed_s(&self) -> [Option<f64>; 2] {
        let Kinematics { acceleration_rad_per_s2: acceleration, jerk_rad_per_s3: jerk, .. } = self.start;
        [(jerk != 0.0).then(|| -acceleration / jerk), None]
    }

    /// When the speed is zero: the roots of v + a·t + j·t²/2.
    fn turning_s(&self) -> [Option<f64>; 2] {
        let Kinematics { speed_rad_per_s: speed, acceleration_rad_per_s2: acceleration, .. } = self.start;
        let jerk = self.start.jerk_rad_per_s3;
        let root = acceleration * acceleration - 2.0 * jerk * speed;
        if root < 0.0 {
            return [None, None];
        }
        // The form that does not cancel: one root from the sum of equal signs, the other from the product of both.
        let sum = -(acceleration + root.sqrt().copysign(acceleration));
        let first = (jerk != 0.0).then(|| sum / jerk);
        let second = (sum != 0.0).then(|| 2.0 * speed / sum);
        [first, second]
    }
}

/// A planned motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Profile {
    pieces: [Piece; MAX_PIECES],
    count: usize,
    duration_s: f64,
    end: Kinematics,
    /// Added to the angle in proportion to time, so that the motion ends where it should to the last bit.
    correction_rad_per_s: f64,
}

impl Profile {
    /// A motion of no length, to which pieces are added; its angles count from 0.
    pub fn starting(at: Kinematics) -> Self {
        let end = Kinematics { angle_rad: 0.0, jerk_rad_per_s3: 0.0, ..at };
        let pieces = [Piece::default(); MAX_PIECES];
        Self { pieces, count: 0, duration_s: 0.0, end, correction_rad_per_s: 0.0 }
    }

    /// Adds a piece at the end; one without length is left out. `None` when the numbers make no piece.
    pub fn push(&mut self, duration_s: f64, jerk_rad_per_s3: f64) -> Option<()> {
        if !(duration_s >= 0.0 && duration_s.is_finite() && jerk_rad_per_s3.is_finite()) {
            return None;
        }
        if duration_s == 0.0 {
            return Some(());
        }
        let start = Kinematics { jerk_rad_per_s3, ..self.end };
        *self.pieces.get_mut(self.count)? = Piece { duration_s, start };
        self.count += 1;
        self.duration_s += duration_s;
        self.end = Kinematics { jerk_rad_per_s3: 0.0, ..start.after(duration_s) };
        Some(())
    }

    /// Adds another motion's pieces; `None` when they are too many.
    pub fn append(&mut self, other: &Self) -> Option<()> {
        other.pieces().try_for_each(|piece| self.push(piece.duration_s, piece.start.jerk_rad_per_s3))
    }

    /// The same, at its end exactly at this speed and without acceleration: a remainder in the last bit would grow
    /// with all that is added.
    pub fn ending_at_speed(self, speed_rad_per_s: f64) -> Self {
        let end = Kinematics { speed_rad_per_s, acceleration_rad_per_s2: 0.0, ..self.end };
        Self { end, ..self }
    }

    /// The same, ending exactly at this angle. What is missing, the planner's tolerance at most, is spread over the
    /// whole motion rather than left as a jump at its end; speeds are not touched.
    pub fn ending_at_angle(self, angle_rad: f64) -> Self {
        if self.duration_s == 0.0 {
            return self;
        }
        let correction_rad_per_s = (angle_rad - self.end.angle_rad) / self.duration_s;
        Self { end: Kinematics { angle_rad, ..self.end }, correction_rad_per_s, ..self }
    }

    /// Length of the motion, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The state at the motion's end.
    pub fn end(&self) -> &Kinematics {
        &self.end
    }

    fn pieces(&self) -> impl Iterator<Item = &Piece> {
        self.pieces.iter().take(self.count)
    }

    /// The state at `time_s` after the start; beyond the end it goes on with the end's speed.
    pub fn at(&self, time_s: f64) -> Kinematics {
        let mut rest_s = time_s;
        for piece in self.pieces() {
            if rest_s < piece.duration_s {
                let state = piece.start.after(rest_s);
                let angle_rad = state.angle_rad + self.correction_rad_per_s * time_s;
                return Kinematics { angle_rad, ..state };
            }
            rest_s -= piece.duration_s;
        }
        let angle_rad = self.end.angle_rad + self.end.speed_rad_per_s * (time_s - self.duration_s);
        Kinematics { angle_rad, acceleration_rad_per_s2: 0.0, ..self.end }
    }

    /// The lowest and the highest angle of the whole motion, relative to its start, rad.
    pub fn reach_rad(&self) -> (f64, f64) {
        self.pieces().fold((0.0, 0.0), |(low, high), piece| {
            let (lowest, highest) = piece.extremes(|state| state.angle_rad, piece.turning_s());
            (f64::min(low, lowest), f64::max(high, highest))
        })
    }

    /// Whether speed, acceleration and jerk stay within the limits all the way.
    pub fn keeps(&self, limits: &Limits) -> bool {
        let within = |range: (f64, f64), limit: f64| {
            let limit = limit * (1.0 + LIMIT_TOLERANCE);
            range.0 >= -limit && range.1 <= limit
        };
        self.pieces().all(|piece| {
            let speeds = piece.extremes(|state| state.speed_rad_per_s, piece.level_speed_s());
            let accelerations = piece.extremes(|state| state.acceleration_rad_per_s2, [None, None]);
            let jerk = piece.start.jerk_rad_per_s3;
            within(speeds, limits.max_speed_rad_per_s)
                && within(accelerations, limits.max_acceleration_rad_per_s2)
                && within((jerk, jerk), limits.max_jerk_rad_per_s3)
        })
    }
}
