//! Laws that no list of causes has: simple functions of what surrounds the spool, and products of two of them.

use crate::forms::Wave;
use crate::surroundings::Surroundings;
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Speeds within this change a law's sign smoothly, as a part of the fastest.
const TURNING: f64 = 1e-3;
/// What a law counts in.
const USUAL_MPA: f64 = 5.0;
const USUAL_K: f64 = 15.0;
const USUAL_RAD_PER_S2: f64 = 100.0;

/// What it acts on: a torque of its own, the levels, or the viscous part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ActsOn {
    Torque,
    Levels,
    Viscous,
}

/// A function of one quantity, of about one where valves are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Of {
    /// Speed to the power 3/2 or 3, with its sign.
    SpeedToThreeHalves,
    SpeedCubed,
    SpeedSquared,
    Speed,
    /// How far the speed is above a tenth of the fastest, saturating.
    Fast,
    Acceleration,
    AccelerationEitherWay,
    AccelerationSquared,
    /// A wave of order 1 to 3, and a load within a sector of the turn.
    Angle,
    Sector,
    Pressure,
    RootOfPressure,
    PressureSquared,
    Warmth,
    WarmthSquared,
    /// A tone of 11 to 53 Hz.
    Tone,
    /// A wave that is no whole number of times in a turn.
    Gear,
}

/// A law's form.
pub(crate) type Form = (ActsOn, &'static [Of]);

/// Those of motion and angle alone, then those with pressure, with temperature, and with both.
const FORMS: [&[Form]; 4] = [
    &[
        (ActsOn::Torque, &[Of::SpeedSquared]),
        (ActsOn::Torque, &[Of::SpeedToThreeHalves]),
        (ActsOn::Torque, &[Of::SpeedCubed]),
        (ActsOn::Torque, &[Of::AccelerationEitherWay]),
        (ActsOn::Torque, &[Of::AccelerationSquared]),
        (ActsOn::Torque, &[Of::Speed, Of::Angle]),
        (ActsOn::Torque, &[Of::Tone]),
        (ActsOn::Torque, &[Of::Gear]),
        (ActsOn::Torque, &[Of::SpeedSquared, Of::Sector]),
        (ActsOn::Levels, &[Of::Fast]),
        (ActsOn::Levels, &[Of::AccelerationEitherWay]),
    ],
    &[
        (ActsOn::Torque, &[Of::RootOfPressure, Of::Angle]),
        (ActsOn::Torque, &[Of::Pressure, Of::Speed]),
        (ActsOn::Torque, &[Of::PressureSquared]),
        (ActsOn::Levels, &[Of::Pressure, Of::Angle]),
        (ActsOn::Levels, &[Of::RootOfPressure, Of::Sector]),
        (ActsOn::Viscous, &[Of::RootOfPressure]),
    ],
    &[
        (ActsOn::Torque, &[Of::SpeedSquared, Of::Warmth]),
        (ActsOn::Torque, &[Of::Warmth]),
        (ActsOn::Levels, &[Of::WarmthSquared]),
        (ActsOn::Levels, &[Of::Warmth, Of::Angle]),
        (ActsOn::Torque, &[Of::Acceleration, Of::Warmth]),
    ],
    &[
        (ActsOn::Levels, &[Of::Pressure, Of::Warmth]),
        (ActsOn::Torque, &[Of::Pressure, Of::Warmth]),
        (ActsOn::Viscous, &[Of::Pressure, Of::Warmth]),
    ],
];

/// A law with its numbers.
#[derive(Debug, Clone)]
pub(crate) struct Law {
    form: Form,
    /// N·m, or a part of the levels or of the viscous part.
    pub size: f64,
    pub fastest_rad_per_s: f64,
    pub reference_c: f64,
    pub wave: Wave,
    pub sector: Wave,
    pub tone_hz: f64,
    pub gear: f64,
    pub phase: f64,
}

impl Law {
    /// One of a group's forms, chosen by a number from 0 to 1.
    pub fn choose(group: usize, choice: f64) -> Form {
        let forms = FORMS[group];
        forms[((choice * forms.len() as f64) as usize).min(forms.len() - 1)]
    }

    pub fn new(
        form: Form,
        size: f64,
        (fastest_rad_per_s, reference_c): (f64, f64),
        draws: &[f64; 6],
    ) -> Self {
        let order = 1.0 + (3.0 * draws[1]).floor();
        Self {
            form,
            size,
            fastest_rad_per_s,
            reference_c,
            wave: Wave::Sines(vec![(order, 1.0, TAU * draws[2])]),
            sector: Wave::bump(1.0, TAU * draws[2], 0.8 + draws[3]),
            tone_hz: 11.0 + 42.0 * draws[1],
            gear: 2.3 + 0.4 * draws[1],
            phase: TAU * draws[4],
        }
    }

    /// Its value where it acts on this, else none.
    pub fn at(&self, acts_on: ActsOn, at: &Surroundings) -> f64 {
        if self.form.0 != acts_on {
            return 0.0;
        }
        self.form.1.iter().map(|of| self.factor(*of, at)).product::<f64>() * self.size
    }

    fn factor(&self, of: Of, at: &Surroundings) -> f64 {
        let speed = at.speed_rad_per_s / self.fastest_rad_per_s;
        let way = (speed / TURNING).tanh();
        let acceleration = at.acceleration_rad_per_s2 / USUAL_RAD_PER_S2;
        let pressure = at.pressure_mpa.abs() / USUAL_MPA;
        let warmth = (at.celsius - self.reference_c) / USUAL_K;
        match of {
            Of::Speed => speed,
            Of::SpeedToThreeHalves => way * speed.abs().powf(1.5),
            Of::SpeedSquared => way * speed * speed,
            Of::SpeedCubed => speed.powi(3),
            Of::Fast => (10.0 * speed.abs()).tanh(),
            Of::Acceleration => acceleration,
            Of::AccelerationEitherWay => acceleration.abs(),
            Of::AccelerationSquared => acceleration * acceleration.abs(),
            Of::Angle => self.wave.at(at.angle_rad),
            Of::Sector => self.sector.at(at.angle_rad),
            Of::Pressure => pressure,
            Of::RootOfPressure => pressure.sqrt(),
            Of::PressureSquared => pressure * pressure,
            Of::Warmth => warmth,
            Of::WarmthSquared => warmth * warmth,
            Of::Tone => (TAU * self.tone_hz * at.clock_s + self.phase).sin(),
            Of::Gear => (self.gear * at.angle_rad + self.phase).sin(),
        }
    }

    /// For truth.json.
    pub fn told(&self) -> Value {
        let depends_on: Vec<&str> = self.form.1.iter().map(|of| quantity(*of)).collect();
        json!({
            "acts_on": format!("{:?}", self.form.0), "form": format!("{:?}", self.form.1),
            "depends_on": depends_on, "size": self.size,
        })
    }
}

/// The quantity that a function is of, by the product's name for it.
fn quantity(of: Of) -> &'static str {
    match of {
        Of::Speed | Of::SpeedToThreeHalves | Of::SpeedSquared | Of::SpeedCubed | Of::Fast => "speed",
        Of::Acceleration | Of::AccelerationEitherWay | Of::AccelerationSquared => "acceleration",
        Of::Angle | Of::Sector | Of::Gear => "angle",
        Of::Pressure | Of::RootOfPressure | Of::PressureSquared => "pressure_drop",
        Of::Warmth | Of::WarmthSquared => "oil_temperature",
        Of::Tone => "time",
    }
}
