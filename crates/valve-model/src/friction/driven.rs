//! A law driven by a given motion: one scalar equation, dz/dt at a speed that is linear in time.
//!
//! Rodas3 (Sandu and others, Atmospheric Environment 31, 1997) with sub-steps chosen by its embedded error, cut where the speed changes sign;
//! after a bounded number of attempts the rest goes in one step at the mean speed, which is stable for any length.

use super::curve::Levels;
use super::law::{Law, Point, sign};
use super::maxwell::Memory;
use super::prepared::{AnyLaw, FrictionLaw};
use super::state::FrictionState;

/// Attempts at a sub-step on either side of a change of sign.
const ATTEMPTS: usize = 48;
/// Change of speed in a sub-step, in parts of the speed or of the Stribeck velocity, whichever is more.
const LEAP: f64 = 0.5;
/// Error accepted in one sub-step, in parts of the Coulomb torque.
const TOLERANCE: f64 = 2e-5;

/// A motion: the speed, and the speed at which the steady curve is read, go linearly from start to end (rad/s).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep {
    pub start: f64,
    pub end: f64,
    pub curve_start: f64,
    pub curve_end: f64,
    pub dt_s: f64,
}

impl Sweep {
    /// A motion whose friction doesn't lag.
    pub fn plain(start: f64, end: f64, dt_s: f64) -> Self {
        Self { start, end, curve_start: start, curve_end: end, dt_s }
    }

    /// The part between two times from its start.
    fn part(&self, from_s: f64, to_s: f64) -> Self {
        let per_s = 1.0 / self.dt_s;
        let speed = |time_s: f64| self.start + (self.end - self.start) * per_s * time_s;
        let curve = |time_s: f64| self.curve_start + (self.curve_end - self.curve_start) * per_s * time_s;
        Self {
            start: speed(from_s),
            end: speed(to_s),
            curve_start: curve(from_s),
            curve_end: curve(to_s),
            dt_s: to_s - from_s,
        }
    }

    /// The parts before and after a change of sign; the second is `None` where there is none.
    ///
    /// A part too short to be told from no time is left out: the reciprocal of its length need not be a number.
    fn halves(self) -> (Self, Option<Self>) {
        if self.start * self.end >= 0.0 {
            return (self, None);
        }
        let turn_s = self.dt_s * self.start / (self.start - self.end);
        let instant_s = self.dt_s * f64::EPSILON;
        if turn_s <= instant_s {
            return (Self { start: 0.0, ..self }, None);
        }
        if self.dt_s - turn_s <= instant_s {
            return (Self { end: 0.0, ..self }, None);
        }
        let before = Self { end: 0.0, ..self.part(0.0, turn_s) };
        let after = Self { start: 0.0, ..self.part(turn_s, self.dt_s) };
        (before, Some(after))
    }
}

impl FrictionState {
    /// Moves through `dt_s` with a speed that goes linearly from `start_rad_per_s` to `end_rad_per_s`; the friction
    /// torque at the end, N·m, positive against positive speed.
    ///
    /// Stable for any step, with a bound on its cost; third order in smooth motion.
    pub fn step(&mut self, law: &FrictionLaw, start_rad_per_s: f64, end_rad_per_s: f64, dt_s: f64) -> f64 {
        self.sweep(law, Sweep::plain(start_rad_per_s, end_rad_per_s, dt_s), &Levels::NOMINAL)
    }

    pub(crate) fn sweep(&mut self, law: &FrictionLaw, sweep: Sweep, levels: &Levels) -> f64 {
        match &law.law {
            AnyLaw::Stribeck(law) => drive(law, sweep, levels, self),
            AnyLaw::Dahl(law) => drive(law, sweep, levels, self),
            AnyLaw::LuGre(law) => drive(law, sweep, levels, self),
            AnyLaw::Leuven(law) => drive(law, sweep, levels, self),
        }
    }
}

/// Moves the state through the sweep; the torque at its end, N·m.
fn drive<L: Law>(law: &L, sweep: Sweep, levels: &Levels, state: &mut FrictionState) -> f64 {
    let (before, after) = sweep.halves();
    drive_one_way(law, &before, levels, state);
    if let Some(after) = after {
        drive_one_way(law, &after, levels, state);
    }
    let end =
        Point { speed: sweep.end, curve_speed: sweep.curve_end, z: state.z, direction: sign(sweep.end) };
    law.flow(end, levels, &state.memory).torque_nm
}

fn drive_one_way<L: Law>(law: &L, sweep: &Sweep, levels: &Levels, state: &mut FrictionState) {
    if sweep.dt_s <= 0.0
        || law.relative_stiffness_per_rad() == 0.0
        || (sweep.start == 0.0 && sweep.end == 0.0)
    {
        return;
    }
    let (mut time_s, mut next_s) = (0.0, sweep.dt_s);
    for _ in 0..ATTEMPTS {
        let left_s = sweep.dt_s - time_s;
        let step_s = next_s.min(most_s(law, sweep, time_s)).min(left_s);
        let piece = sweep.part(time_s, time_s + step_s);
        let (z, error) = attempt(law, &piece, state.z, levels, &state.memory);
        if error <= 1.0 {
            state.z = z;
            let end = Point { speed: piece.end, curve_speed: piece.curve_end, z, direction: sign(piece.end) };
            law.remember(end, levels, &mut state.memory);
            if step_s == left_s {
                return;
            }
            time_s += step_s;
        }
        let change = (0.85 / error.max(1e-6).cbrt()).clamp(0.1, 4.0);
        next_s = if error.is_nan() { 0.1 * step_s } else { step_s * change };
    }
    let rest = sweep.part(time_s, sweep.dt_s);
    let curve_speed = 0.5 * (rest.curve_start + rest.curve_end);
    let speed = 0.5 * (rest.start + rest.end);
    let at = Point { speed, curve_speed, z: state.z, direction: sign(speed) };
    state.z = law.frozen(at, rest.dt_s, levels, &state.memory);
    law.remember(Point { z: state.z, ..at }, levels, &mut state.memory);
}

/// The longest sub-step from `time_s` on that the error estimate is asked about: it sees both ends alone, so the speed
/// may not leap over the curve's fall in between.
fn most_s<L: Law>(law: &L, sweep: &Sweep, time_s: f64) -> f64 {
    let acceleration = (sweep.curve_end - sweep.curve_start).abs() / sweep.dt_s;
    let speed = sweep.curve_start + (sweep.curve_end - sweep.curve_start) * time_s / sweep.dt_s;
    LEAP * speed.abs().max(law.stribeck_velocity()) / acceleration
}

/// One sub-step of Rodas3: z at its end and the size of its error, 1 at the tolerance.
fn attempt<L: Law>(law: &L, piece: &Sweep, z: f64, levels: &Levels, memory: &Memory) -> (f64, f64) {
    // The direction of a piece that begins or ends at zero speed is that of its middle.
    let direction = sign(piece.start + piece.end);
    let begin = law.linearise(
        Point { speed: piece.start, curve_speed: piece.curve_start, z, direction },
        levels,
        memory,
    );
    let per_step = 1.0 / piece.dt_s;
    let per_pivot = 1.0 / (2.0 * per_step - begin.rate_by_z);
    // dt · ∂(dz/dt)/∂t
    let by_time = begin.rate_by_speed * (piece.end - piece.start)
        + begin.rate_by_curve_speed * (piece.curve_end - piece.curve_start);

    let first = per_pivot * (begin.flow.rate + 0.5 * by_time);
    let second = per_pivot * (begin.flow.rate + 4.0 * per_step * first + 1.5 * by_time);
    let drift = per_step * (first - second);
    let at_end = Point { speed: piece.end, curve_speed: piece.curve_end, z: z + 2.0 * first, direction };
    let third = per_pivot * (law.flow(at_end, levels, memory).rate + drift);
    let embedded = Point { z: at_end.z + third, ..at_end };
    let rate = law.flow(embedded, levels, memory).rate;
    let error = per_pivot * (rate + drift - 8.0 / 3.0 * per_step * third);
    // What an error of z makes of the torque, through the spring and through the damping of dz/dt.
    let relative = law.relative_stiffness_per_rad().max(begin.torque_by_z.abs() / law.coulomb_nm());
    (embedded.z + error, error.abs() * relative / TOLERANCE)
}
