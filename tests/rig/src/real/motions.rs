//! Motions of a test rig, of a production machine, and as `stepvalve simulate` makes them.

use super::world::{Source, World};
use crate::log_kind::LogKind;
use crate::motion::{Motion, Tone};
use crate::nominal::{Nominal, TEETH, log_uniform};
use crate::plan::{Levels, RunPlan, arrange};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

const LEAD_S: f64 = 0.1;
/// Kinds as people name them; they say nothing.
const LABELS: &[&str] =
    &["run", "Messung", "slow", "A", "kv", "profile 3", "sine", "test-2", "dwell", "neu", ""];

/// What the builder of runs needs throughout.
struct Builder<'a> {
    nominal: &'a Nominal,
    world: &'a World,
    kind: LogKind,
    rng: &'a mut Pcg64,
}

/// Speeds to be held, each with its time, joined by ramps.
struct Moves {
    speeds: Vec<(f64, f64)>,
    ramp_s: f64,
    length_s: f64,
}

impl Moves {
    fn new(ramp_s: f64) -> Self {
        Self { speeds: Vec::new(), ramp_s, length_s: LEAD_S }
    }

    fn hold(&mut self, speed: f64, hold_s: f64) {
        self.speeds.push((speed, hold_s));
        self.length_s += hold_s + self.ramp_s;
    }

    /// A move by a distance, and a rest after it.
    fn go(&mut self, distance_rad: f64, speed: f64, rest_s: f64) {
        let speed = speed.min(distance_rad.abs() / self.ramp_s).max(1e-6);
        self.hold(speed.copysign(distance_rad), (distance_rad.abs() / speed - self.ramp_s).max(0.0));
        self.hold(0.0, rest_s);
    }
}

/// The runs of a measurement, arranged, and the kinds that they are given.
pub(super) fn plan(
    nominal: &Nominal,
    world: &World,
    kind: LogKind,
    rng: &mut Pcg64,
) -> (Vec<RunPlan>, Vec<String>) {
    let mut builder = Builder { nominal, world, kind, rng };
    let runs = builder.runs();
    let pressures_mpa = match builder.rng.random_range(0..4) {
        0 => vec![builder.rng.random_range(0.0..9.0)],
        1 => vec![1.0, 7.0],
        _ => vec![0.0, 2.0, 5.0, 9.0],
    };
    let celsius = match builder.rng.random_range(0..4) {
        0 => vec![builder.rng.random_range(25.0..55.0)],
        1 => vec![30.0, 50.0],
        _ => vec![28.0, 36.0, 44.0, 55.0],
    };
    // A few runs have their conditions change within each; many may do.
    let lively = runs.len() < 4 || builder.rng.random_bool(0.3);
    let mut runs = arrange(runs, &Levels { pressures_mpa, celsius, warming: false }, builder.rng);
    let mut labels = Vec::new();
    for run in &mut runs {
        if lively {
            run.pressure_mpa.mean = run.pressure_mpa.mean.max(1.0);
            run.pressure_mpa.wobble = builder.rng.random_range(0.2..0.9) * run.pressure_mpa.mean;
            run.pressure_mpa.rate_hz = builder.rng.random_range(0.5..3.0) / run.end_s();
            run.celsius.wobble = builder.rng.random_range(2.0..8.0);
            run.celsius.rate_hz = builder.rng.random_range(0.5..1.5) / run.end_s();
        }
        labels.push(LABELS[builder.rng.random_range(0..LABELS.len())].to_owned());
    }
    (runs, labels)
}

impl Builder<'_> {
    fn runs(&mut self) -> Vec<RunPlan> {
        let world = self.world;
        // A production machine does one thing; a rig does as many as it has runs.
        let work = self.rng.random_range(0..3);
        (0..world.runs)
            .map(|index| {
                let run_s = world.run_s * self.rng.random_range(0.8..1.2);
                let motion = match world.source {
                    Source::TestRig => self.experiment(index, run_s),
                    Source::Production => self.production(work, run_s),
                    Source::Loop => self.closed_loop(index, run_s),
                };
                let step_s = 1.0 / world.rate_hz;
                let cut_s = if self.rng.random_bool(0.2) { 0.3 } else { 0.0 };
                let mut run = RunPlan::new("motion", motion, step_s, cut_s, LEAD_S);
                run.times_s = (0..(run_s / step_s) as usize).map(|k| cut_s + step_s * k as f64).collect();
                run
            })
            .collect()
    }

    fn fastest(&self) -> f64 {
        self.nominal.fastest_rad_per_s
    }

    /// The longest way in one go.
    fn reach_rad(&self) -> f64 {
        self.world.stroke_rad.unwrap_or(40.0)
    }

    fn experiment(&mut self, index: usize, run_s: f64) -> Motion {
        match (index + self.rng.random_range(0..2)) % 6 {
            0 | 1 => self.constant_speeds(run_s),
            2 => self.tones(1, run_s),
            3 => self.tones(5, run_s),
            4 => self.dwells(run_s),
            _ => self.presliding(run_s),
        }
    }

    fn constant_speeds(&mut self, run_s: f64) -> Motion {
        let mut moves = Moves::new(if self.kind == LogKind::Torque { 0.08 } else { 0.15 });
        while moves.length_s < run_s {
            let speed = log_uniform(self.rng, 0.4 * self.nominal.stribeck_rad_per_s, self.fastest());
            let hold_s = (0.12 * run_s).min(self.reach_rad() / speed).max(0.05);
            moves.hold(speed, hold_s);
            moves.hold(0.0, LEAD_S);
            moves.hold(-speed, hold_s);
            moves.hold(0.0, LEAD_S);
        }
        Motion::legs(&moves.speeds, moves.ramp_s, LEAD_S)
    }

    fn dwells(&mut self, run_s: f64) -> Motion {
        let mut moves = Moves::new(0.05);
        let speed = self.nominal.stribeck_rad_per_s * self.rng.random_range(2.0..6.0);
        let mut way = 1.0;
        while moves.length_s < run_s {
            moves.hold(way * speed, 0.2);
            moves.hold(0.0, log_uniform(self.rng, 0.05, 3.0));
            way = -way;
        }
        Motion::legs(&moves.speeds, moves.ramp_s, LEAD_S)
    }

    /// One tone or several, as fast in sum as a sine may be.
    fn tones(&mut self, count: i32, run_s: f64) -> Motion {
        let speed = self.rng.random_range(0.2..0.6) * self.fastest() / f64::from(count);
        let highest_hz = (0.1 * self.world.rate_hz).min(if count > 1 { 12.0 } else { 8.0 });
        let inertia = self.nominal.load_kg_m2 + self.nominal.rotor_kg_m2;
        let tones = (0..count).map(|_| {
            let frequency_hz = log_uniform(self.rng, (2.0 / run_s).max(0.3), highest_hz);
            // Of the holding torque no more than a tenth for the inertia.
            let most = 0.1 * self.nominal.holding_nm / inertia / (TAU * frequency_hz).powi(2);
            let amplitude_rad = (speed / (TAU * frequency_hz)).min(0.4 * self.reach_rad()).min(most);
            Tone { amplitude_rad, frequency_hz, phase_rad: self.rng.random_range(0.0..TAU) }
        });
        let tones = tones.collect();
        Motion::tones(tones, LEAD_S, (run_s - LEAD_S).max(0.5), (0.2 * run_s).min(0.5))
    }

    fn presliding(&mut self, run_s: f64) -> Motion {
        let n = self.nominal;
        let motor = if self.kind == LogKind::Angle { 1.0 / (n.holding_nm * TEETH) } else { 0.0 };
        let reach = self.rng.random_range(0.5..3.0) * n.static_nm * (1.0 / n.stiffness_nm_per_rad + motor);
        let frequency_hz = self.rng.random_range(0.5..2.0);
        let tone =
            |frequency_hz: f64, phase_rad: f64| Tone { amplitude_rad: 0.5 * reach, frequency_hz, phase_rad };
        let tones = vec![tone(frequency_hz, 0.0), tone(1.27 * frequency_hz, self.rng.random_range(0.0..TAU))];
        Motion::tones(tones, LEAD_S, (run_s - LEAD_S).max(0.5), (0.2 * run_s).min(0.3))
    }

    /// The same moves over and over: between positions, forwards alone by an index, or a slow stroke and a quick return.
    fn production(&mut self, work: u32, run_s: f64) -> Motion {
        let mut moves = Moves::new(log_uniform(self.rng, 0.04, 0.3));
        let speed = self.rng.random_range(0.2..1.0) * self.fastest();
        let rest_s = log_uniform(self.rng, 0.1, 1.5);
        let stroke = self.world.stroke_rad.unwrap_or(TAU);
        let positions: Vec<f64> =
            (0..self.rng.random_range(2..5)).map(|_| self.rng.random_range(0.0..stroke)).collect();
        let (mut at, mut turn) = (0.0, 0);
        while moves.length_s < run_s {
            match work {
                0 => {
                    let next = positions[turn % positions.len()];
                    if (next - at).abs() > 1e-3 {
                        moves.go(next - at, speed, rest_s);
                    } else {
                        moves.hold(0.0, rest_s);
                    }
                    at = next;
                }
                1 => moves.go(TAU / 8.0, speed, rest_s),
                _ => {
                    moves.go(stroke, 0.25 * speed, rest_s);
                    moves.go(-stroke, speed, 0.5 * rest_s);
                }
            }
            turn += 1;
        }
        Motion::legs(&moves.speeds, moves.ramp_s, LEAD_S)
    }

    /// Steps between openings, a sine, or a rotation.
    fn closed_loop(&mut self, index: usize, run_s: f64) -> Motion {
        match (index + self.rng.random_range(0..2)) % 3 {
            0 => {
                let mut moves = Moves::new(self.rng.random_range(0.02..0.05));
                let mut at = 0.0;
                while moves.length_s < run_s {
                    let next = self.rng.random_range(0.0..0.8);
                    moves.go(next - at, 0.8 * self.fastest(), self.rng.random_range(0.3..0.9));
                    at = next;
                }
                Motion::legs(&moves.speeds, moves.ramp_s, LEAD_S)
            }
            1 => {
                let tone = Tone {
                    amplitude_rad: self.rng.random_range(0.05..0.3),
                    frequency_hz: self.rng.random_range(0.5..2.0),
                    phase_rad: 0.0,
                };
                Motion::tones(vec![tone], LEAD_S, (run_s - LEAD_S).max(0.6), 0.3)
            }
            _ => {
                let way = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
                let speed = way * self.fastest() * self.rng.random_range(0.3..1.0);
                Motion::legs(&[(speed, (run_s - 0.6).max(0.4))], 0.15, LEAD_S)
            }
        }
    }
}
