//! A run's motion: constant speeds joined by smooth ramps, tones under an envelope, or both.

use crate::jet::Jet;

/// A tone of an angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tone {
    pub amplitude_rad: f64,
    pub frequency_hz: f64,
    pub phase_rad: f64,
}

/// One of many changes of speed, none of which begins before the last one ended.
#[derive(Debug, Clone, Copy)]
struct Leg {
    from_s: f64,
    angle_rad: f64,
    speed_rad_per_s: f64,
    change: f64,
    length_s: f64,
}

/// An angle over time; at rest before zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct Motion {
    pub start_rad: f64,
    /// When a speed begins to change, by how much (rad/s), and how long that takes.
    ramps: Vec<(f64, f64, f64)>,
    /// The same with where each begins: of many only the one that acts is looked at.
    legs: Vec<Leg>,
    tones: Vec<Tone>,
    /// When the tones begin and end, and how long their envelope takes to rise and to fall.
    envelope: (f64, f64, f64),
}

impl Motion {
    /// Constant speeds (rad/s), each held for a time (s); at rest before and after.
    pub fn speeds(speeds: &[(f64, f64)], ramp_s: f64, lead_s: f64) -> Self {
        let mut motion = Self::default();
        let (mut at, mut last) = (lead_s, 0.0);
        for &(speed, hold_s) in speeds.iter().chain(&[(0.0, 0.0)]) {
            if speed != last {
                motion.ramps.push((at, speed - last, ramp_s));
                at += ramp_s;
            }
            at += hold_s;
            last = speed;
        }
        motion
    }

    /// The same as [`Self::speeds`] for any number of them.
    pub fn legs(speeds: &[(f64, f64)], ramp_s: f64, lead_s: f64) -> Self {
        let mut motion = Self::default();
        let (mut at_s, mut speed, mut angle_rad) = (lead_s, 0.0, 0.0);
        for &(next, hold_s) in speeds.iter().chain(&[(0.0, 0.0)]) {
            let change = next - speed;
            motion.legs.push(Leg {
                from_s: at_s,
                angle_rad,
                speed_rad_per_s: speed,
                change,
                length_s: ramp_s,
            });
            angle_rad += ramp_s * 0.5 * (speed + next) + hold_s * next;
            at_s += ramp_s + hold_s;
            speed = next;
        }
        motion
    }

    /// Tones from `lead_s` on, for `length_s`.
    pub fn tones(tones: Vec<Tone>, lead_s: f64, length_s: f64, rise_s: f64) -> Self {
        Self { tones, envelope: (lead_s, lead_s + length_s, rise_s), ..Self::default() }
    }

    /// The same with a further motion on top.
    pub fn with(mut self, other: Self) -> Self {
        self.ramps.extend(other.ramps);
        if self.tones.is_empty() {
            self.tones = other.tones;
            self.envelope = other.envelope;
        }
        self
    }

    /// When the last speed is reached, or the last tone has died away, s.
    pub fn end_s(&self) -> f64 {
        let ramps = self.ramps.iter().map(|(from, _, length)| from + length).fold(0.0, f64::max);
        let ramps = self.legs.last().map_or(ramps, |leg| leg.from_s + leg.length_s);
        if self.tones.is_empty() { ramps } else { ramps.max(self.envelope.1) }
    }

    /// The shortest time in which it changes its speed, s: a ramp's, or a quarter of a tone's period.
    pub fn quickest_s(&self) -> f64 {
        let ramps = self.ramps.iter().map(|(_, _, length)| *length);
        let legs = self.legs.iter().map(|leg| leg.length_s);
        let tones = self.tones.iter().map(|tone| 0.25 / tone.frequency_hz);
        ramps.chain(legs).chain(tones).fold(f64::INFINITY, f64::min)
    }

    /// Angle, speed and acceleration.
    pub fn at(&self, time_s: f64) -> Jet {
        let mut angle = Jet::constant(self.start_rad);
        for &(from, change, length) in &self.ramps {
            angle = angle + Jet::ramp(change, from, length, time_s);
        }
        if let Some(leg) = self.legs[..self.legs.partition_point(|leg| leg.from_s <= time_s)].last() {
            let since_s = time_s - leg.from_s;
            let steady = Jet {
                value: leg.angle_rad + leg.speed_rad_per_s * since_s,
                rate: leg.speed_rad_per_s,
                second: 0.0,
            };
            angle = angle + steady + Jet::ramp(leg.change, leg.from_s, leg.length_s, time_s);
        }
        let (begin, end, rise) = self.envelope;
        if self.tones.is_empty() || time_s <= begin || time_s >= end {
            return angle;
        }
        let mut sum = Jet::default();
        for tone in &self.tones {
            let one = Jet::tone(tone.frequency_hz, tone.phase_rad, time_s - begin);
            sum = sum + Jet::constant(tone.amplitude_rad) * one;
        }
        let fall = Jet::constant(1.0) + Jet::constant(-1.0) * Jet::rise(end - rise, rise, time_s);
        angle + sum * Jet::rise(begin, rise, time_s) * fall
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_legs_move_as_few_ramps_do() {
        let speeds = [(2.0, 0.3), (0.0, 0.1), (-1.0, 0.4), (3.0, 0.0)];
        let (ramps, legs) = (Motion::speeds(&speeds, 0.08, 0.1), Motion::legs(&speeds, 0.08, 0.1));
        assert!((ramps.end_s() - legs.end_s()).abs() < 1e-12);
        for k in 0..200 {
            let (a, b) = (ramps.at(0.01 * f64::from(k)), legs.at(0.01 * f64::from(k)));
            for (a, b) in [(a.value, b.value), (a.rate, b.rate), (a.second, b.second)] {
                assert!((a - b).abs() < 1e-9, "at {k}: {a} and {b}");
            }
        }
    }
}
