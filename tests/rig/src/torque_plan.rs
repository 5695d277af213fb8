//! Experiments with a torque transducer: the motion is given.

use crate::hidden::Gap;
use crate::motion::{Motion, Tone};
use crate::nominal::{Nominal, log_uniform};
use crate::plan::{Levels, RunPlan, arrange};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// How long a change of speed takes, s.
const RAMP_S: f64 = 0.08;
/// At rest before a motion begins, s.
const LEAD_S: f64 = 0.1;

/// What the builder of a plan needs throughout.
struct Builder<'a> {
    nominal: &'a Nominal,
    rng: &'a mut Pcg64,
    step_s: f64,
    /// Of the time spent on each experiment; 1 for 60,000 samples.
    scale: f64,
}

/// The runs of a campaign of about `samples`.
pub(crate) fn plan(nominal: &Nominal, samples: usize, without: Option<Gap>, rng: &mut Pcg64) -> Vec<RunPlan> {
    let scale = samples as f64 / 75_000.0;
    let (step_s, scale) = if scale < 0.6 { (2e-3, 2.0 * scale) } else { (1e-3, scale) };
    let mut builder = Builder { nominal, rng, step_s, scale };
    let runs = match without {
        Some(Gap::SlidingOnly) => builder.sliding(),
        Some(Gap::OneFrequency) => builder.one_frequency(),
        Some(Gap::NoShake) => builder.gentle(),
        _ => builder.full(),
    };
    let levels = levels(without, rng);
    arrange(runs, &levels, rng)
}

fn levels(without: Option<Gap>, rng: &mut Pcg64) -> Levels {
    let pressures_mpa = match without {
        None | Some(Gap::NoShake | Gap::NoPresliding | Gap::Gentle) => vec![0.0, 2.0, 5.0, 9.0],
        Some(_) => vec![rng.random_range(3.0..8.0)],
    };
    let celsius = match without {
        Some(Gap::SlidingOnly | Gap::OneFrequency) => vec![40.0],
        _ => vec![28.0, 36.0, 44.0, 55.0],
    };
    Levels { pressures_mpa, celsius, warming: without == Some(Gap::Trend) }
}

impl Builder<'_> {
    fn full(&mut self) -> Vec<RunPlan> {
        let mut runs = self.gentle();
        for frequency_hz in [7.0, 14.0] {
            runs.push(self.sine(frequency_hz, 0.25));
        }
        runs.extend([0.0, 1.0, -1.0].map(|way| self.shake(way)));
        runs
    }

    /// Everything but what makes inertia show.
    fn gentle(&mut self) -> Vec<RunPlan> {
        let mut runs = Vec::new();
        let (slow, fast) = (0.4 * self.nominal.stribeck_rad_per_s, self.nominal.fastest_rad_per_s);
        for _ in 0..2 {
            for k in 0..6 {
                let speed = slow * (fast / slow).powf(f64::from(k) / 5.0) * self.rng.random_range(0.85..1.15);
                runs.push(self.both_ways(speed.min(fast), 0.8));
            }
        }
        runs.push(self.both_ways(2.6, 2.5));
        runs.extend((0..4).map(|k| self.dwell(k)));
        for frequency_hz in [0.4, 1.5, 4.0] {
            runs.push(self.sine(frequency_hz, 0.5));
        }
        runs.extend((0..3).map(|_| self.multisine()));
        for size in [0.6, 1.0, 1.6, 3.0] {
            runs.push(self.presliding(size));
        }
        runs
    }

    fn both_ways(&mut self, speed: f64, hold_s: f64) -> RunPlan {
        let hold_s = hold_s * self.scale;
        let way = if self.rng.random_bool(0.5) { speed } else { -speed };
        let speeds = [(way, hold_s), (0.0, LEAD_S), (-way, hold_s)];
        RunPlan::new("constant-speed", Motion::speeds(&speeds, RAMP_S, LEAD_S), self.step_s, 0.0, LEAD_S)
    }

    fn dwell(&mut self, turn: usize) -> RunPlan {
        let speed = self.nominal.stribeck_rad_per_s * self.rng.random_range(2.0..5.0);
        let rests = [[0.05, 0.8, 0.2], [0.1, 1.6, 0.4], [0.3, 0.03, 1.2], [0.6, 0.15, 2.2]][turn % 4];
        let mut speeds = vec![(speed, 0.2)];
        for (rest_s, way) in rests.iter().zip([1.0, -1.0, 1.0]) {
            speeds.push((0.0, rest_s * self.scale.max(0.6)));
            speeds.push((way * speed, 0.2));
        }
        RunPlan::new("dwell", Motion::speeds(&speeds, 0.5 * RAMP_S, LEAD_S), self.step_s, 0.0, LEAD_S)
    }

    fn sine(&mut self, frequency_hz: f64, part: f64) -> RunPlan {
        let speed = part * self.nominal.fastest_rad_per_s * self.rng.random_range(0.6..1.2);
        let length_s = (2.0 * self.scale).max(1.2 / frequency_hz);
        let tone = Tone {
            amplitude_rad: speed / (TAU * frequency_hz),
            frequency_hz,
            phase_rad: self.rng.random_range(0.0..TAU),
        };
        let rise_s = (0.5 / frequency_hz).clamp(0.1, 0.3 * length_s);
        RunPlan::new("sine", Motion::tones(vec![tone], LEAD_S, length_s, rise_s), self.step_s, 0.0, LEAD_S)
    }

    fn multisine(&mut self) -> RunPlan {
        let length_s = 2.2 * self.scale;
        let each = 0.25 * self.nominal.fastest_rad_per_s;
        let tones = (0..6).map(|k| {
            let frequency_hz = 0.6 * 1.8f64.powi(k) * self.rng.random_range(0.9..1.1);
            let amplitude_rad = each / (TAU * frequency_hz);
            Tone { amplitude_rad, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) }
        });
        let tones = tones.collect();
        RunPlan::new("multisine", Motion::tones(tones, LEAD_S, length_s, 0.3), self.step_s, 0.0, LEAD_S)
    }

    /// Two tones that beat: large loops with small ones within.
    fn presliding(&mut self, size: f64) -> RunPlan {
        let reach = size * self.nominal.static_nm / self.nominal.stiffness_nm_per_rad;
        let frequency_hz = self.rng.random_range(1.0..2.0);
        let tone =
            |frequency_hz: f64, phase_rad: f64| Tone { amplitude_rad: 0.5 * reach, frequency_hz, phase_rad };
        let tones = vec![tone(frequency_hz, 0.0), tone(1.27 * frequency_hz, self.rng.random_range(0.0..TAU))];
        let length_s = (2.4 * self.scale).max(1.2);
        RunPlan::new("presliding", Motion::tones(tones, LEAD_S, length_s, 0.3), self.step_s, 0.0, LEAD_S)
    }

    /// Fast enough for inertia to count beside friction: on a fast slide one way or the other, or back and forth.
    fn shake(&mut self, way: f64) -> RunPlan {
        let n = self.nominal;
        let highest_hz = (0.7 * (n.stiffness_nm_per_rad / n.load_kg_m2).sqrt() / TAU).clamp(60.0, 140.0);
        let acceleration = if way == 0.0 { 0.08 } else { 0.25 } * n.coulomb_nm / n.load_kg_m2;
        let mut tones = Vec::new();
        for k in 0..4 {
            let frequency_hz = 30.0 * (highest_hz / 30.0).powf(f64::from(k) / 3.0);
            let amplitude_rad = acceleration / (TAU * frequency_hz).powi(2);
            tones.push(Tone { amplitude_rad, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) });
        }
        let speed = 0.7 * way * n.fastest_rad_per_s;
        let motion = Motion::speeds(&[(speed, 0.45)], RAMP_S, 0.5 * LEAD_S).with(Motion::tones(
            tones,
            0.5 * LEAD_S + RAMP_S,
            0.45,
            0.1,
        ));
        RunPlan::new("shake", motion, 0.25e-3, 0.0, 0.5 * LEAD_S)
    }

    /// Constant speeds alone, each run begun and ended on the move.
    fn sliding(&mut self) -> Vec<RunPlan> {
        let fast = self.nominal.fastest_rad_per_s;
        let slow = (8.0 * self.nominal.stribeck_rad_per_s).min(0.5 * fast);
        let mut runs = Vec::new();
        for turn in 0..24 {
            let speed = log_uniform(self.rng, slow, fast) * if turn % 2 == 0 { 1.0 } else { -1.0 };
            let hold_s = 2.4 * self.scale;
            let motion = Motion::speeds(&[(speed, hold_s)], RAMP_S, 0.0);
            let mut run = RunPlan::new("constant-speed", motion, self.step_s, 0.4, 0.0);
            run.times_s.retain(|time| *time < hold_s);
            runs.push(run);
        }
        runs
    }

    /// A speed that swings slowly around a mean without reversing, at one frequency.
    fn one_frequency(&mut self) -> Vec<RunPlan> {
        let fast = self.nominal.fastest_rad_per_s;
        let frequency_hz = 6.0;
        let mut runs = Vec::new();
        for turn in 0..24 {
            let mean = fast * self.rng.random_range(0.6..0.8) * if turn % 2 == 0 { 1.0 } else { -1.0 };
            let amplitude_rad = 0.25 * fast / (TAU * frequency_hz);
            let tone = Tone { amplitude_rad, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) };
            let hold_s = 2.4 * self.scale;
            let motion = Motion::speeds(&[(mean, hold_s)], RAMP_S, 0.0).with(Motion::tones(
                vec![tone],
                RAMP_S,
                hold_s,
                0.2,
            ));
            let mut run = RunPlan::new("sine", motion, self.step_s, 0.4, 0.0);
            run.times_s.retain(|time| *time < hold_s - 0.2);
            runs.push(run);
        }
        runs
    }
}
