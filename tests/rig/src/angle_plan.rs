//! Experiments without a torque transducer: the command is given, the rotor follows.

use crate::hidden::Gap;
use crate::motion::{Motion, Tone};
use crate::nominal::{Nominal, TEETH};
use crate::plan::{Levels, RunPlan, arrange};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

const LEAD_S: f64 = 0.1;
/// Changes of speed are smoother than with a transducer, s: a rotor on its magnetic spring rings.
const RAMP_S: f64 = 0.15;

struct Builder<'a> {
    nominal: &'a Nominal,
    rng: &'a mut Pcg64,
    step_s: f64,
    scale: f64,
}

/// The runs of a campaign of about `samples`.
pub(crate) fn plan(nominal: &Nominal, samples: usize, without: Option<Gap>, rng: &mut Pcg64) -> Vec<RunPlan> {
    let scale = samples as f64 / 75_000.0;
    let mut builder = Builder { nominal, rng, step_s: 1e-3, scale };
    let runs = match without {
        Some(Gap::OneWay) => builder.one_way(),
        Some(Gap::Gentle) => builder.gentle(),
        Some(Gap::NoPresliding) => builder.sliding(),
        _ => builder.full(),
    };
    let pressures_mpa = match without {
        None => vec![0.0, 2.0, 5.0, 9.0],
        Some(_) => vec![rng.random_range(3.0..8.0)],
    };
    let celsius = if without.is_none() { vec![28.0, 36.0, 44.0, 55.0] } else { vec![40.0] };
    arrange(runs, &Levels { pressures_mpa, celsius, warming: false }, rng)
}

impl Builder<'_> {
    fn full(&mut self) -> Vec<RunPlan> {
        let mut runs = self.sliding();
        runs.extend((0..4).map(|k| self.dwell(k)));
        for size in [0.5, 0.9, 1.4, 2.5] {
            runs.push(self.presliding(size));
        }
        for frequency_hz in [0.5, 2.0, 6.0, 15.0] {
            runs.push(self.sine(frequency_hz));
        }
        runs.extend((0..3).map(|_| self.multisine()));
        runs.extend((0..3).map(|_| self.resonance()));
        runs
    }

    /// Constant speeds both ways, well above the Stribeck velocity too.
    fn sliding(&mut self) -> Vec<RunPlan> {
        let (slow, fast) = (2.0 * self.nominal.stribeck_rad_per_s, self.nominal.fastest_rad_per_s);
        let mut speeds: Vec<f64> =
            (0..10).map(|k| slow * (fast / slow).powf(f64::from(k % 5) / 4.0)).collect();
        speeds.push(2.6);
        speeds.into_iter().map(|speed| self.both_ways(speed)).collect()
    }

    /// Constant speeds and slow changes between them, one way and the other.
    fn gentle(&mut self) -> Vec<RunPlan> {
        let fast = self.nominal.fastest_rad_per_s;
        (0..20)
            .map(|k| {
                let speed = fast * (0.3 + 0.7 * f64::from(k % 5) / 4.0);
                let way = if k % 2 == 0 { speed } else { -speed };
                let hold_s = 2.4 * self.scale;
                let motion = Motion::speeds(&[(way, hold_s)], 0.6, 0.0);
                let mut run = RunPlan::new("constant-speed", motion, self.step_s, 0.0, 0.0);
                run.times_s.retain(|time| *time > 0.6 && *time < hold_s + 0.5);
                run
            })
            .collect()
    }

    /// Forwards alone, through whole turns.
    fn one_way(&mut self) -> Vec<RunPlan> {
        let fast = self.nominal.fastest_rad_per_s.max(5.0);
        (0..16)
            .map(|k| {
                let speed = fast * (0.5 + 0.5 * f64::from(k % 4) / 3.0);
                let motion = Motion::speeds(&[(speed, 3.0 * self.scale)], 0.4, LEAD_S);
                RunPlan::new("constant-speed", motion, self.step_s, 0.0, LEAD_S)
            })
            .collect()
    }

    fn both_ways(&mut self, speed: f64) -> RunPlan {
        let hold_s = if speed == 2.6 { 2.5 } else { 0.8 } * self.scale;
        let way = speed * if self.rng.random_bool(0.5) { 0.97 } else { -1.03 };
        let speeds = [(way, hold_s), (0.0, 2.0 * LEAD_S), (-way, hold_s)];
        RunPlan::new("constant-speed", Motion::speeds(&speeds, RAMP_S, LEAD_S), self.step_s, 0.0, LEAD_S)
    }

    fn dwell(&mut self, turn: usize) -> RunPlan {
        let speed = self.nominal.stribeck_rad_per_s * self.rng.random_range(4.0..8.0);
        let rests = [[0.05, 0.8, 0.2], [0.1, 1.6, 0.4], [0.3, 0.03, 1.2], [0.6, 0.15, 2.2]][turn % 4];
        let mut speeds = vec![(speed, 0.2)];
        for (rest_s, way) in rests.iter().zip([1.0, -1.0, 1.0]) {
            speeds.push((0.0, rest_s * self.scale.max(0.6)));
            speeds.push((way * speed, 0.2));
        }
        RunPlan::new("dwell", Motion::speeds(&speeds, 0.1, LEAD_S), self.step_s, 0.0, LEAD_S)
    }

    /// The motor's stiffness, N·m/rad.
    fn motor_stiffness(&self) -> f64 {
        self.nominal.holding_nm * TEETH
    }

    /// Commands whose torque stays about `size` times the static friction.
    fn presliding(&mut self, size: f64) -> RunPlan {
        let n = self.nominal;
        let reach = size * n.static_nm * (1.0 / n.stiffness_nm_per_rad + 1.0 / self.motor_stiffness());
        let frequency_hz = self.rng.random_range(1.0..2.0);
        let tone =
            |frequency_hz: f64, phase_rad: f64| Tone { amplitude_rad: 0.5 * reach, frequency_hz, phase_rad };
        let tones = vec![tone(frequency_hz, 0.0), tone(1.27 * frequency_hz, self.rng.random_range(0.0..TAU))];
        let length_s = (2.4 * self.scale).max(1.2);
        RunPlan::new("presliding", Motion::tones(tones, LEAD_S, length_s, 0.3), self.step_s, 0.0, LEAD_S)
    }

    fn sine(&mut self, frequency_hz: f64) -> RunPlan {
        let n = self.nominal;
        let inertia = n.load_kg_m2 + n.rotor_kg_m2;
        // A tenth of the holding torque for the inertia, at most.
        let most = 0.1 * n.holding_nm / inertia / (TAU * frequency_hz);
        let speed = (0.4 * n.fastest_rad_per_s * self.rng.random_range(0.6..1.2)).min(most);
        let length_s = (2.0 * self.scale).max(1.2 / frequency_hz);
        let tone = Tone {
            amplitude_rad: speed / (TAU * frequency_hz),
            frequency_hz,
            phase_rad: self.rng.random_range(0.0..TAU),
        };
        let rise_s = (0.5 / frequency_hz).clamp(0.15, 0.3 * length_s);
        RunPlan::new("sine", Motion::tones(vec![tone], LEAD_S, length_s, rise_s), self.step_s, 0.0, LEAD_S)
    }

    fn multisine(&mut self) -> RunPlan {
        let each = 0.15 * self.nominal.fastest_rad_per_s;
        let tones = (0..5).map(|k| {
            let frequency_hz = 0.6 * 1.8f64.powi(k) * self.rng.random_range(0.9..1.1);
            let amplitude_rad = each / (TAU * frequency_hz);
            Tone { amplitude_rad, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) }
        });
        let motion = Motion::tones(tones.collect(), LEAD_S, 2.2 * self.scale, 0.3);
        RunPlan::new("multisine", motion, self.step_s, 0.0, LEAD_S)
    }

    /// A slow slide with tones around the motor's resonance on top.
    fn resonance(&mut self) -> RunPlan {
        let n = self.nominal;
        let natural_hz = (self.motor_stiffness() / (n.load_kg_m2 + n.rotor_kg_m2)).sqrt() / TAU;
        let tones = (0..4).map(|k| {
            let frequency_hz = natural_hz * (0.5 + 0.25 * f64::from(k)) * self.rng.random_range(0.95..1.05);
            Tone { amplitude_rad: 0.4e-3, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) }
        });
        let tones = tones.collect();
        let length_s = 1.2 * self.scale.max(0.5);
        let speed = 0.15 * n.fastest_rad_per_s * if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let motion = Motion::speeds(&[(speed, length_s)], RAMP_S, LEAD_S).with(Motion::tones(
            tones,
            LEAD_S + RAMP_S,
            length_s,
            0.2,
        ));
        RunPlan::new("resonance", motion, self.step_s, 0.0, LEAD_S)
    }
}
