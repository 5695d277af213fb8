//! One run of an experiment: its motion, its samples, and pressure and temperature along it.

use crate::motion::Motion;
use crate::surroundings::Surroundings;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// A quantity that hardly changes during a run: a mean and a slow wobble around it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Slow {
    pub mean: f64,
    pub wobble: f64,
    pub rate_hz: f64,
}

impl Slow {
    pub fn at(&self, time_s: f64) -> f64 {
        self.mean + self.wobble * (TAU * self.rate_hz * time_s.max(0.0)).sin()
    }
}

/// A run as planned.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunPlan {
    pub name: String,
    pub kind: &'static str,
    pub motion: Motion,
    /// When samples are taken, from the motion's start on.
    pub times_s: Vec<f64>,
    /// At rest before the motion's start.
    pub rest_s: f64,
    /// The motion's start on the log's clock.
    pub clock_s: f64,
    /// The command is rounded to this, rad; 0: not at all.
    pub microstep_rad: f64,
    pub pressure_mpa: Slow,
    pub celsius: Slow,
}

impl RunPlan {
    /// A run sampled every `step_s` from `cut_s` on, until `tail_s` after its motion's end.
    pub fn new(kind: &'static str, motion: Motion, step_s: f64, cut_s: f64, tail_s: f64) -> Self {
        let samples = ((motion.end_s() + tail_s - cut_s) / step_s).round() as usize;
        let times_s = (0..samples.max(3)).map(|k| cut_s + step_s * k as f64).collect();
        Self { kind, motion, times_s, ..Self::default() }
    }

    pub fn end_s(&self) -> f64 {
        *self.times_s.last().unwrap()
    }

    pub fn command_rad(&self, index: usize) -> f64 {
        let wanted_rad = self.motion.at(self.times_s[index]).value;
        if self.microstep_rad == 0.0 {
            return wanted_rad;
        }
        (wanted_rad / self.microstep_rad).round() * self.microstep_rad
    }

    /// Pressure, temperature and clock; the rest at zero.
    pub fn surroundings(&self, time_s: f64) -> Surroundings {
        Surroundings {
            pressure_mpa: self.pressure_mpa.at(time_s),
            celsius: self.celsius.at(time_s),
            clock_s: self.clock_s + time_s,
            ..Surroundings::default()
        }
    }
}

/// The levels of pressure (MPa) and temperature (°C) that a plan visits, and whether the temperature follows time.
pub(crate) struct Levels {
    pub pressures_mpa: Vec<f64>,
    pub celsius: Vec<f64>,
    pub warming: bool,
}

/// Gives the runs an order, conditions, names, rests and places on the clock.
pub(crate) fn arrange(mut runs: Vec<RunPlan>, levels: &Levels, rng: &mut Pcg64) -> Vec<RunPlan> {
    // Each kind of run meets every level in turn, before the order is drawn.
    let (mut pressures, mut warmths) = (levels.pressures_mpa.clone(), levels.celsius.clone());
    pressures.shuffle(rng);
    warmths.shuffle(rng);
    for (index, run) in runs.iter_mut().enumerate() {
        let turn = index + index / pressures.len();
        let wobble = rng.random_range(0.0..0.02);
        run.pressure_mpa.mean = pressures[turn % pressures.len()];
        run.pressure_mpa.wobble = wobble * run.pressure_mpa.mean * f64::from(pressures.len() > 1);
        run.pressure_mpa.rate_hz = rng.random_range(0.1..0.4);
        run.celsius.mean = warmths[index % warmths.len()];
        run.celsius.wobble = if warmths.len() > 1 { rng.random_range(0.0..0.5) } else { 0.0 };
        run.celsius.rate_hz = rng.random_range(0.02..0.1);
    }
    runs.shuffle(rng);
    let (mut clock_s, mut angle_rad) = (0.0, 0.0);
    let count = runs.len();
    for (index, run) in runs.iter_mut().enumerate() {
        if levels.warming {
            run.celsius.mean = 30.0 + 25.0 * index as f64 / count as f64;
        }
        run.rest_s = if index == 0 { 0.0 } else { rng.random_range(0.5f64.ln()..8f64.ln()).exp() };
        clock_s += run.rest_s;
        run.clock_s = clock_s;
        run.motion.start_rad = angle_rad;
        angle_rad = run.motion.at(run.end_s()).value;
        clock_s += run.end_s();
        run.name = format!("{:02}-{}", index + 1, run.kind);
    }
    runs
}
