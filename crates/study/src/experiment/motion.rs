//! Motions that an experiment is made of, as angles over time.

use std::f64::consts::TAU;

/// A motion about, or from, a middle angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// A sine that fades in over its first period.
    Sine { amplitude_rad: f64, frequency_hz: f64, for_s: f64 },
    /// There and back at constant speed, as often as time allows; each way is so long, and begins and ends with a ramp.
    BothWays { speed_rad_per_s: f64, acceleration_rad_per_s2: f64, way_rad: f64, for_s: f64 },
    /// On in one direction, at constant speed behind a ramp.
    OneWay { speed_rad_per_s: f64, acceleration_rad_per_s2: f64, for_s: f64 },
    /// Moves to and fro with rests before each.
    StartStop { rest_s: f64, way_rad: f64, speed_rad_per_s: f64, acceleration_rad_per_s2: f64, for_s: f64 },
}

impl Motion {
    /// How long it takes, s.
    pub fn takes_s(&self) -> f64 {
        match *self {
            Self::Sine { for_s, .. }
            | Self::BothWays { for_s, .. }
            | Self::OneWay { for_s, .. }
            | Self::StartStop { for_s, .. } => for_s,
        }
    }

    /// The angle from the middle, rad, `time_s` after its beginning.
    pub fn at(&self, time_s: f64) -> f64 {
        match *self {
            Self::Sine { amplitude_rad, frequency_hz, .. } => {
                let part = (time_s * frequency_hz).clamp(0.0, 1.0);
                let risen = part * part * (3.0 - 2.0 * part);
                risen * amplitude_rad * (TAU * frequency_hz * time_s).sin()
            }
            Self::BothWays { speed_rad_per_s, acceleration_rad_per_s2, way_rad, .. } => {
                to_and_fro(time_s, 0.0, &Ramp::new(way_rad, speed_rad_per_s, acceleration_rad_per_s2))
            }
            Self::OneWay { speed_rad_per_s, acceleration_rad_per_s2, .. } => {
                let rising_s = speed_rad_per_s / acceleration_rad_per_s2;
                let rising = time_s.min(rising_s);
                0.5 * acceleration_rad_per_s2 * rising * rising + speed_rad_per_s * (time_s - rising)
            }
            Self::StartStop { rest_s, way_rad, speed_rad_per_s, acceleration_rad_per_s2, .. } => {
                to_and_fro(time_s, rest_s, &Ramp::new(way_rad, speed_rad_per_s, acceleration_rad_per_s2))
            }
        }
    }

    /// What it is called in a plan.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Sine { .. } => "sine",
            Self::BothWays { .. } => "both-ways",
            Self::OneWay { .. } => "one-way",
            Self::StartStop { .. } => "start-stop",
        }
    }

    /// Its numbers, by key with their unit.
    pub fn numbers(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Sine { amplitude_rad, frequency_hz, for_s } => {
                vec![("amplitude_rad", amplitude_rad), ("frequency_hz", frequency_hz), ("for_s", for_s)]
            }
            Self::BothWays { speed_rad_per_s, acceleration_rad_per_s2, way_rad, for_s } => vec![
                ("speed_rad_per_s", speed_rad_per_s),
                ("acceleration_rad_per_s2", acceleration_rad_per_s2),
                ("way_rad", way_rad),
                ("for_s", for_s),
            ],
            Self::OneWay { speed_rad_per_s, acceleration_rad_per_s2, for_s } => vec![
                ("speed_rad_per_s", speed_rad_per_s),
                ("acceleration_rad_per_s2", acceleration_rad_per_s2),
                ("for_s", for_s),
            ],
            Self::StartStop { rest_s, way_rad, speed_rad_per_s, acceleration_rad_per_s2, for_s } => vec![
                ("rest_s", rest_s),
                ("way_rad", way_rad),
                ("speed_rad_per_s", speed_rad_per_s),
                ("acceleration_rad_per_s2", acceleration_rad_per_s2),
                ("for_s", for_s),
            ],
        }
    }
}

/// From rest to rest at constant speed between two ramps, or as fast as these allow.
struct Ramp {
    way_rad: f64,
    speed_rad_per_s: f64,
    acceleration_rad_per_s2: f64,
}

impl Ramp {
    fn new(way_rad: f64, speed_rad_per_s: f64, acceleration_rad_per_s2: f64) -> Self {
        let most_rad_per_s = (acceleration_rad_per_s2 * way_rad).sqrt();
        Self { way_rad, speed_rad_per_s: speed_rad_per_s.min(most_rad_per_s), acceleration_rad_per_s2 }
    }

    fn takes_s(&self) -> f64 {
        self.way_rad / self.speed_rad_per_s + self.speed_rad_per_s / self.acceleration_rad_per_s2
    }

    /// How far it has come, rad.
    fn at(&self, time_s: f64) -> f64 {
        let ramp_s = self.speed_rad_per_s / self.acceleration_rad_per_s2;
        let within = |time_s: f64| 0.5 * self.acceleration_rad_per_s2 * time_s * time_s;
        let left_s = self.takes_s() - time_s;
        if time_s <= 0.0 {
            0.0
        } else if time_s < ramp_s {
            within(time_s)
        } else if left_s > ramp_s {
            within(ramp_s) + self.speed_rad_per_s * (time_s - ramp_s)
        } else {
            self.way_rad - within(left_s.max(0.0))
        }
    }
}

/// Ways to and fro about the middle, with a rest before each.
fn to_and_fro(time_s: f64, rest_s: f64, ramp: &Ramp) -> f64 {
    let one_s = rest_s + ramp.takes_s();
    // Both of one number: a remainder may be of the way before where the quotient is of the next.
    let number = (time_s / one_s).floor();
    let within_s = (time_s - number * one_s).clamp(0.0, one_s);
    let moved = ramp.at(within_s - rest_s);
    if number % 2.0 == 0.0 { moved - 0.5 * ramp.way_rad } else { 0.5 * ramp.way_rad - moved }
}

/// What motions must keep within.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The whole range of the angle, rad.
    pub range_rad: f64,
    pub speed_rad_per_s: f64,
    pub acceleration_rad_per_s2: f64,
    /// How far the contact gives before it slides, rad; 0 where the model has no such thing.
    pub presliding_rad: f64,
    /// The finest motion that the encoder shows, rad.
    pub finest_rad: f64,
    /// Between samples, s.
    pub step_s: f64,
}

/// Frequencies of sines, Hz, and how long each lasts, in s.
const SINES: [(f64, f64); 5] = [(0.5, 4.0), (2.0, 2.0), (5.0, 1.5), (15.0, 1.0), (40.0, 1.0)];
/// A period has so many samples at least: what moves between two samples is an error of the measured motion.
const SAMPLES_A_PERIOD: f64 = 25.0;
/// Small sines, in parts of the presliding range; their frequency, Hz, and length, s.
const SMALL: [f64; 3] = [0.5, 1.0, 3.0];
const SMALL_HZ: f64 = 2.0;
const SMALL_S: f64 = 3.0;
/// Speeds in parts of the largest.
const SPEEDS: [f64; 5] = [0.01, 0.05, 0.2, 0.5, 1.0];
/// Rests before starts, s, and how many starts: what grows at rest shows in break-aways alone, one a start.
const RESTS: [(f64, usize); 3] = [(0.1, 8), (1.0, 6), (4.0, 4)];
/// A motion at constant speed lasts so long, s.
const LONG_S: f64 = 4.0;

/// Every motion that could be made within bounds.
pub fn motions(bounds: &Bounds) -> Vec<Motion> {
    let mut all = Vec::new();
    let quickest_hz = 1.0 / (SAMPLES_A_PERIOD * bounds.step_s);
    for (frequency_hz, for_s) in SINES.into_iter().filter(|(frequency_hz, _)| *frequency_hz <= quickest_hz) {
        let turning = TAU * frequency_hz;
        let most = (bounds.speed_rad_per_s / turning)
            .min(bounds.acceleration_rad_per_s2 / (turning * turning))
            .min(0.5 * bounds.range_rad);
        if most > bounds.finest_rad {
            all.push(Motion::Sine { amplitude_rad: most, frequency_hz, for_s });
        }
    }
    for part in SMALL {
        let amplitude_rad = part * bounds.presliding_rad;
        if amplitude_rad > bounds.finest_rad && amplitude_rad < 0.5 * bounds.range_rad {
            all.push(Motion::Sine { amplitude_rad, frequency_hz: SMALL_HZ, for_s: SMALL_S });
        }
    }
    let whole_turns = bounds.range_rad >= TAU;
    let acceleration_rad_per_s2 = bounds.acceleration_rad_per_s2;
    for part in SPEEDS {
        let speed_rad_per_s = part * bounds.speed_rad_per_s;
        let way_rad = bounds.range_rad.min(if whole_turns { TAU } else { f64::INFINITY });
        let way_rad = way_rad.min(0.5 * LONG_S * speed_rad_per_s);
        if way_rad > 10.0 * bounds.finest_rad {
            all.push(Motion::BothWays { speed_rad_per_s, acceleration_rad_per_s2, way_rad, for_s: LONG_S });
        }
        if whole_turns && speed_rad_per_s * LONG_S <= bounds.range_rad && part > 0.1 {
            all.push(Motion::OneWay { speed_rad_per_s, acceleration_rad_per_s2, for_s: LONG_S });
        }
    }
    for (rest_s, starts) in RESTS {
        let speed_rad_per_s = 0.1 * bounds.speed_rad_per_s;
        let way_rad = (0.3 * speed_rad_per_s).min(bounds.range_rad);
        let one_s = rest_s + Ramp::new(way_rad, speed_rad_per_s, acceleration_rad_per_s2).takes_s();
        let for_s = starts as f64 * one_s;
        all.push(Motion::StartStop { rest_s, way_rad, speed_rad_per_s, acceleration_rad_per_s2, for_s });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_keeps_within_its_bounds() {
        for range_rad in [0.3, 2.0, 20.0] {
            let bounds = Bounds {
                range_rad,
                speed_rad_per_s: 5.0,
                acceleration_rad_per_s2: 300.0,
                presliding_rad: 1e-3,
                finest_rad: 1e-4,
                step_s: 1e-3,
            };
            let all = motions(&bounds);
            assert!(all.len() > 8, "{}", all.len());
            for motion in all {
                let samples = (motion.takes_s() * 1e4) as usize;
                let angles: Vec<f64> = (0..samples).map(|row| motion.at(1e-4 * row as f64)).collect();
                let (least, most) = angles.iter().fold((0.0, 0.0), |(least, most), angle| {
                    (f64::min(least, *angle), f64::max(most, *angle))
                });
                assert!(most - least <= range_rad * 1.0001, "{motion:?}: {least} to {most}");
                let fastest =
                    angles.windows(2).map(|pair| (pair[1] - pair[0]).abs() / 1e-4).fold(0.0, f64::max);
                // A sine is a little faster while it fades in.
                assert!(fastest < 1.3 * bounds.speed_rad_per_s, "{motion:?}: {fastest} rad/s");
                let rise = |three: &[f64]| (three[2] - 2.0 * three[1] + three[0]).abs() / 1e-8;
                let steepest = angles.windows(3).map(rise).fold(0.0, f64::max);
                assert!(
                    steepest < 1.6 * bounds.acceleration_rad_per_s2,
                    "{motion:?}: {steepest} rad/s², though a sine fades in"
                );
            }
        }
    }
}
