//! A run's motion: constant speeds joined by smooth ramps, tones under an envelope, or both.

use crate::jet::Jet;

/// A tone of an angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tone {
    pub amplitude_rad: f64,
    pub frequency_hz: f64,
    pub phase_rad: f64,
}

/// An angle over time; at rest before zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct Motion {
    pub start_rad: f64,
    /// When a speed begins to change, by how much (rad/s), and how long that takes.
    ramps: Vec<(f64, f64, f64)>,
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
        if self.tones.is_empty() { ramps } else { ramps.max(self.envelope.1) }
    }

    /// Angle, speed and acceleration.
    pub fn at(&self, time_s: f64) -> Jet {
        let mut angle = Jet::constant(self.start_rad);
        for &(from, change, length) in &self.ramps {
            angle = angle + Jet::ramp(change, from, length, time_s);
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
