//! The rig's equations of motion: the torque that a driven spool takes, and the rotor that follows a command.

use crate::contact::{Contact, MOST_STATES};
use crate::forms::Wave;
use crate::nominal::{FULL_STEPS, TEETH};
use crate::plan::RunPlan;
use crate::radau::Radau;
use crate::surroundings::Surroundings;
use std::f64::consts::TAU;

/// No coupling gives as much at rest, rad.
const ELSEWHERE_RAD: f64 = 0.05;

/// The valve on the rig and its instruments, with everything that is hidden in it.
#[derive(Debug, Clone)]
pub(crate) struct Valve {
    pub contact: Contact,
    /// N·m/MPa over the angle.
    pub flow: Option<Wave>,
    pub pressure_nm_per_mpa: f64,
    pub position: Option<Wave>,
    /// Outside the list: amplitude, order (no whole number) and phase of a torque over the angle.
    pub gear: Option<(f64, f64, f64)>,
    /// The spring between encoder and spool, N·m/rad, and its damping, N·m·s/rad.
    pub coupling: Option<(f64, f64)>,
    /// Over the rotor's angle times full steps.
    pub detent: Option<Wave>,
    /// Over the command times teeth, rad.
    pub microstep: Option<Wave>,
    pub backlash_rad: f64,
    /// When on the log's clock, and by how many tooth pitches.
    pub missed: Vec<(f64, f64)>,
    pub offset_nm: f64,
    pub gain: f64,
    pub delay_s: f64,
    /// Amplitude and phase.
    pub eccentricity: (f64, f64),
    /// Outside the list: amplitude and frequency of a disturbance of the measured channel.
    pub hum: Option<(f64, f64)>,
    /// Outside the list: the transducer's own hysteresis, a part of its reading within a play of so many N·m.
    pub transducer_play_nm: f64,
}

/// What is left from one run to the next.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    states: Vec<f64>,
    radau: Radau,
    encoder_shaft_rad: f64,
    transducer_nm: f64,
}

/// One run's outputs without noise.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outputs {
    pub torque_nm: Vec<f64>,
    pub angle_rad: Vec<f64>,
    /// How much more torque the bristles take for more angle, N·m/rad; where the motion is given.
    pub slope_nm_per_rad: Vec<f64>,
    /// The greatest lag of the rotor, in electrical radians.
    pub most_lag_rad: f64,
}

impl Valve {
    pub fn new(contact: Contact) -> Self {
        Self {
            contact,
            flow: None,
            pressure_nm_per_mpa: 0.0,
            position: None,
            gear: None,
            coupling: None,
            detent: None,
            microstep: None,
            backlash_rad: 0.0,
            missed: Vec::new(),
            offset_nm: 0.0,
            gain: 1.0,
            delay_s: 0.0,
            eccentricity: (0.0, 0.0),
            hum: None,
            transducer_play_nm: 0.0,
        }
    }

    fn other_nm(&self, at: &Surroundings) -> f64 {
        let wave = |wave: &Option<Wave>| wave.as_ref().map_or(0.0, |wave| wave.at(at.angle_rad));
        let gear = self.gear.map_or(0.0, |(a, order, phase)| a * (order * at.angle_rad + phase).sin());
        (wave(&self.flow) + self.pressure_nm_per_mpa) * at.pressure_mpa + wave(&self.position) + gear
    }

    /// Mechanical states ahead of the contact's: spool angle and speed where they are not given, the rotor's where a
    /// spring lies between.
    fn mechanical(&self, driven: bool) -> usize {
        match (driven, self.coupling) {
            (true, None) => 0,
            (true, Some(_)) | (false, None) => 2,
            (false, Some(_)) => 4,
        }
    }

    /// At rest at an angle, its bristles relaxed.
    pub fn at_rest(&self, angle_rad: f64, driven: bool) -> Memory {
        let mechanical = self.mechanical(driven);
        let mut tolerances: Vec<f64> = [1e-9, 1e-6, 1e-9, 1e-6].into_iter().take(mechanical).collect();
        tolerances.extend(self.contact.tolerances());
        let mut states = vec![0.0; tolerances.len()];
        (0..mechanical).step_by(2).for_each(|k| states[k] = angle_rad);
        Memory {
            states,
            radau: Radau::new(tolerances, 1e-7),
            encoder_shaft_rad: angle_rad,
            transducer_nm: 0.0,
        }
    }

    /// The given motion's rates: the contact's, and the spool's behind a spring; the torque between motor and load.
    fn driven_rates(&self, run: &RunPlan, time_s: f64, y: &[f64], out: &mut [f64]) -> f64 {
        let motion = run.motion.at(time_s);
        let mut at = run.surroundings(time_s);
        let load = self.contact.nominal.load_kg_m2;
        let Some((stiffness, damping)) = self.coupling else {
            (at.angle_rad, at.speed_rad_per_s) = (motion.value, motion.rate);
            at.acceleration_rad_per_s2 = motion.second;
            return load * motion.second + self.contact.torque(y, &at, out) + self.other_nm(&at);
        };
        (at.angle_rad, at.speed_rad_per_s) = (y[0], y[1]);
        let friction_nm = self.contact.torque(&y[2..], &at, &mut out[2..]);
        let spring_nm = stiffness * (motion.value - y[0]) + damping * (motion.rate - y[1]);
        out[0] = y[1];
        out[1] = (spring_nm - friction_nm - self.other_nm(&at)) / load;
        spring_nm
    }

    fn winding_rad(&self, command_rad: f64) -> f64 {
        command_rad + self.microstep.as_ref().map_or(0.0, |wave| wave.at(TEETH * command_rad))
    }

    fn motor_nm(&self, command_rad: f64, rotor_rad: f64) -> f64 {
        let detent = self.detent.as_ref().map_or(0.0, |wave| wave.at(FULL_STEPS * rotor_rad));
        let lag = TEETH * (self.winding_rad(command_rad) - rotor_rad);
        self.contact.nominal.holding_nm * lag.sin() + detent
    }

    /// The rates of the rotor that follows a command.
    fn free_rates(&self, run: &RunPlan, time_s: f64, command_rad: f64, y: &[f64], out: &mut [f64]) {
        let n = &self.contact.nominal;
        let mut at = run.surroundings(time_s);
        let mechanical = self.mechanical(false);
        (at.angle_rad, at.speed_rad_per_s) = (y[0], y[1]);
        let mut inner = [0.0; MOST_STATES];
        let friction_nm = self.contact.torque(&y[mechanical..], &at, &mut inner);
        out[mechanical..].copy_from_slice(&inner[..y.len() - mechanical]);
        let load_nm = friction_nm + self.other_nm(&at);
        out[0] = y[1];
        if let Some((stiffness, damping)) = self.coupling {
            let spring_nm = stiffness * (y[2] - y[0]) + damping * (y[3] - y[1]);
            out[1] = (spring_nm - load_nm) / n.load_kg_m2;
            out[2] = y[3];
            let motor_nm = self.motor_nm(command_rad, y[2]) - n.motor_damping_nm_s_per_rad * y[3];
            out[3] = (motor_nm - spring_nm) / n.rotor_kg_m2;
        } else {
            let motor_nm = self.motor_nm(command_rad, y[0]) - n.motor_damping_nm_s_per_rad * y[1];
            out[1] = (motor_nm - load_nm) / (n.load_kg_m2 + n.rotor_kg_m2);
        }
    }

    /// A run with its motion given: the torque at each sample, and the encoder's angle.
    pub fn drive(&self, run: &RunPlan, memory: &mut Memory) -> Outputs {
        let mut outputs = Outputs::default();
        let Memory { states, radau, .. } = memory;
        let mut rates = |t: f64, y: &[f64], out: &mut [f64]| {
            self.driven_rates(run, t, y, out);
        };
        // A spool behind a coupling is taken along, unmeasured, to where an ordered run begins.
        let begin_rad = run.motion.at(0.0).value;
        if let (Some(_), Some(angle_rad)) = (self.coupling, states.first_mut())
            && (*angle_rad - begin_rad).abs() > ELSEWHERE_RAD
        {
            *angle_rad = begin_rad;
        }
        radau.integrate(&mut rates, -run.rest_s, 0.0, states);
        let mut now_s = 0.0;
        let mut scratch = vec![0.0; states.len()];
        for &time_s in &run.times_s {
            let late_s = time_s - self.delay_s;
            if late_s > now_s {
                radau.integrate(&mut rates, now_s, late_s, states);
                now_s = late_s;
            }
            let true_nm = self.driven_rates(run, now_s, states, &mut scratch);
            memory.transducer_nm = self.transducer_nm(memory.transducer_nm, true_nm);
            let hum = self.hum.map_or(0.0, |(a, f)| a * (TAU * f * (run.clock_s + time_s)).sin());
            outputs.torque_nm.push(self.gain * memory.transducer_nm + self.offset_nm + hum);
            let shaft = run.motion.at(time_s);
            outputs.angle_rad.push(self.encoder_rad(shaft.value));
            let rates = &scratch[self.mechanical(true)..];
            outputs.slope_nm_per_rad.push(self.contact.slope_nm_per_rad(rates, shaft.rate));
        }
        let end_s = run.end_s();
        if end_s > now_s {
            radau.integrate(&mut rates, now_s, end_s, states);
        }
        outputs
    }

    fn transducer_nm(&self, before_nm: f64, torque_nm: f64) -> f64 {
        let play = self.transducer_play_nm;
        if play == 0.0 { torque_nm } else { before_nm.max(torque_nm - play).min(torque_nm + play) }
    }

    fn encoder_rad(&self, shaft_rad: f64) -> f64 {
        let (amplitude, phase) = self.eccentricity;
        shaft_rad + amplitude * (shaft_rad + phase).sin()
    }

    /// A run with its command given, linear between samples: the encoder's angle at each.
    pub fn follow(&self, run: &RunPlan, memory: &mut Memory) -> Outputs {
        let mut outputs = Outputs::default();
        let rotor = if self.coupling.is_some() { 2 } else { 0 };
        let Memory { states, radau, .. } = memory;
        let held_rad = run.command_rad(0);
        let mut rates = |t: f64, y: &[f64], out: &mut [f64]| self.free_rates(run, t, held_rad, y, out);
        radau.integrate(&mut rates, -run.rest_s, run.times_s[0], states);
        let mut waiting: Vec<(f64, f64)> = Vec::new();
        for (index, &time_s) in run.times_s.iter().enumerate() {
            if index > 0 {
                self.follow_between(run, index, memory, &mut waiting);
            } else {
                memory.encoder_shaft_rad =
                    self.shaft_rad(run, time_s, memory.states[rotor], memory.encoder_shaft_rad);
                waiting.push((time_s, memory.encoder_shaft_rad));
            }
            let shaft_rad = at_time(&waiting, time_s - self.delay_s);
            let hum = self.hum.map_or(0.0, |(a, f)| a * (TAU * f * (run.clock_s + time_s)).sin());
            outputs.angle_rad.push(self.encoder_rad(shaft_rad) + hum);
            let lag = TEETH * (run.command_rad(index) - memory.states[rotor]);
            outputs.most_lag_rad = outputs.most_lag_rad.max(lag.abs());
        }
        outputs
    }

    /// From the sample before `index` to it, in two halves where the encoder is late: its angle in between is wanted.
    fn follow_between(
        &self,
        run: &RunPlan,
        index: usize,
        memory: &mut Memory,
        waiting: &mut Vec<(f64, f64)>,
    ) {
        let (from_s, to_s) = (run.times_s[index - 1], run.times_s[index]);
        let (from, to) = (run.command_rad(index - 1), run.command_rad(index));
        let slope = (to - from) / (to_s - from_s);
        let rotor = if self.coupling.is_some() { 2 } else { 0 };
        let pieces = if self.delay_s > 0.0 { 4 } else { 1 };
        for piece in 0..pieces {
            let at = |piece: i32| from_s + (to_s - from_s) * f64::from(piece) / f64::from(pieces);
            let mut rates = |t: f64, y: &[f64], out: &mut [f64]| {
                self.free_rates(run, t, from + slope * (t - from_s), y, out);
            };
            memory.radau.integrate(&mut rates, at(piece), at(piece + 1), &mut memory.states);
            memory.encoder_shaft_rad =
                self.shaft_rad(run, at(piece + 1), memory.states[rotor], memory.encoder_shaft_rad);
            waiting.push((at(piece + 1), memory.encoder_shaft_rad));
        }
    }

    /// The encoder's own shaft: the rotor's with play, and the teeth that it has fallen by.
    fn shaft_rad(&self, run: &RunPlan, time_s: f64, rotor_rad: f64, before_rad: f64) -> f64 {
        let clock_s = run.clock_s + time_s;
        let fallen: f64 = self.missed.iter().filter(|(at, _)| *at <= clock_s).map(|(_, teeth)| teeth).sum();
        let rotor_rad = rotor_rad + fallen * TAU / TEETH;
        before_rad.max(rotor_rad - self.backlash_rad).min(rotor_rad + self.backlash_rad)
    }
}

/// The value at a time, linear between the last few kept.
fn at_time(kept: &[(f64, f64)], time_s: f64) -> f64 {
    let after = kept.partition_point(|(at, _)| *at < time_s);
    match (after.checked_sub(1).map(|k| kept[k]), kept.get(after)) {
        (Some((t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * (time_s - t0) / (t1 - t0),
        (Some((_, v)), None) => v,
        (None, Some(&(_, v))) => v,
        (None, None) => f64::NAN,
    }
}
