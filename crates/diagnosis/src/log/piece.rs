//! A stretch of a run prepared for many predictions: its motion is smoothed once, and its inputs are stored with it.

use crate::DiagnosisError;
use crate::log::course::WholeRun;
use crate::log::driven::Driven;
use crate::log::error_model::{information, rest_variance, stretches};
use crate::log::initial_state::InitialState;
use crate::log::inputs::Inputs;
use crate::log::kind::LogKind;
use crate::log::onset::begun_early;
use crate::log::past::Before;
use crate::log::predictions::Stretch;
use crate::log::ready::Ready;
use crate::log::work::Work;
use log_data::{Channel, Run};
use prediction::{MOMENT_REACH, Noise, Smoother, motion_at, motion_through};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use std::ops::Range;
use std::sync::Arc;
use valve_model::{MotionSample, half_way};

/// Samples beyond a piece's ends that its smoothing uses.
const MARGIN: usize = 2048;
/// Where the encoder is within its step when a motion is measured again, in standard deviations of the rounding error: the middles of four
/// parts of it.
const PLACES: [f64; 4] = [1.3, -1.3, 0.433, -0.433];
/// Information that counts as one independent sample, with a margin for rounding.
const WHOLE: f64 = 0.999;

/// A stretch of a run.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    /// The run's place in the log, and the piece's rows.
    pub run: usize,
    pub rows: Range<usize>,
    /// When the run begins, in the log's time.
    pub begins_s: f64,
    /// Pieces of one group are fitted, or held out, together.
    pub group: usize,
    pub hold_out: bool,
    pub driven: Driven,
    /// The motion of each sample; in an angle log only that of the lead's first sample.
    pub motions: Vec<MotionSample>,
    /// True if the motion is the measured one, and not one as it might have been measured.
    pub is_as_measured: bool,
    /// The channel that the model predicts, less hum and loose ripples.
    pub measured: Vec<f64>,
    /// Mains hum that was subtracted from it; empty if there was none.
    pub hum: Vec<f64>,
    /// Ripples over the angle with a phase of their own in each run that were subtracted from it; empty if there were none.
    pub ripple: Vec<f64>,
    /// The state of the contact before its lead.
    pub past: Before,
    /// √information / σ, σ the standard deviation of measured minus predicted; 0 for a sample that is left out.
    pub weights: Vec<f64>,
    /// The samples that were missing; empty if none were.
    pub mask: Vec<bool>,
    /// The part of an independent sample that each sample counts as: less than 1 where it shares its error with its neighbours.
    pub information: Vec<f64>,
    /// Where the rotor lost steps: sample and angle, rad.
    pub jumps: Vec<(usize, f64)>,
    pub noise: Noise,
    /// The whole run, in an angle log whose runs are cut.
    pub course: Option<Arc<WholeRun>>,
    /// Counts the samples that its predictions simulate.
    pub work: Arc<Work>,
}

impl Piece {
    /// A piece of a run that has been checked; its prediction begins at `lead_row`.
    pub fn new(
        run: &Run,
        index: usize,
        (lead_row, rows): (usize, Range<usize>),
        kind: LogKind,
        past: Before,
        noise: Noise,
        reference_temperature_c: f64,
    ) -> Self {
        let motions = if kind.motion_is_measured {
            let from = rows.start.saturating_sub(MARGIN);
            let to = (rows.end + MARGIN).min(run.len());
            let wide = |values: &[f64]| values.get(from..to).unwrap_or_default().to_vec();
            smoothed(&wide(&run.time_s), &wide(&run.angle_rad), noise, rows.start - from, rows.len())
        } else {
            vec![motion_at(&run.time_s, &run.angle_rad, noise, lead_row)]
        };
        let measured = run.channel(kind.channel).and_then(|all| all.get(rows.clone())).unwrap_or_default();
        Self {
            run: index,
            begins_s: run.time_s.first().copied().unwrap_or(0.0),
            group: 0,
            hold_out: false,
            driven: Driven::new(run, lead_row, &rows, reference_temperature_c),
            motions,
            is_as_measured: true,
            measured: measured.to_vec(),
            hum: Vec::new(),
            ripple: Vec::new(),
            past,
            weights: vec![1.0; rows.len()],
            mask: Vec::new(),
            information: vec![1.0; rows.len()],
            jumps: Vec::new(),
            noise,
            course: None,
            work: Arc::default(),
            rows,
        }
    }

    /// Whether causes are fitted on it; the others are held out.
    pub fn is_fitted(&self) -> bool {
        !self.hold_out
    }

    pub fn len(&self) -> usize {
        self.measured.len()
    }

    /// Subtracts more hum from the measured channel.
    pub fn take_out_hum(&mut self, hum: &[f64]) {
        take_out(hum, &mut self.measured, &mut self.hum);
    }

    /// Subtracts more of a loose ripple from the measured channel.
    pub fn take_out_ripple(&mut self, ripple: &[f64]) {
        take_out(ripple, &mut self.measured, &mut self.ripple);
    }

    /// Values of the channel as it was recorded: with hum and ripples added again.
    pub fn as_recorded(&self, values: &[f64]) -> Vec<f64> {
        let of = |taken: &[f64], index: usize| taken.get(index).copied().unwrap_or(0.0);
        let with = |(index, value): (usize, &f64)| value + of(&self.hum, index) + of(&self.ripple, index);
        values.iter().enumerate().map(with).collect()
    }

    /// Effective number of independent samples: the sum of `information` over samples of non-zero weight.
    pub fn count(&self) -> f64 {
        self.counted().map(|(_, information)| information).sum()
    }

    /// Weight and information of each sample of non-zero weight.
    pub fn counted(&self) -> impl Iterator<Item = (f64, f64)> {
        let samples = self.weights.iter().copied().zip(self.information.iter().copied());
        samples.filter(|(weight, _)| *weight > 0.0)
    }

    /// The residual of each sample divided by its standard deviation; 0 for a sample of zero weight.
    pub fn in_deviations(&self, residual: &[f64]) -> Vec<f64> {
        let samples = residual.iter().zip(&self.weights).zip(&self.information);
        samples.map(|((value, weight), information)| value * weight / information.sqrt()).collect()
    }

    /// The residual divided by its standard deviation. Samples that share an error are combined until they count as one
    /// independent sample.
    pub fn together(&self, residual: &[f64]) -> Vec<f64> {
        let (mut found, mut sum, mut count) = (Vec::new(), 0.0, 0.0);
        for ((value, weight), information) in residual.iter().zip(&self.weights).zip(&self.information) {
            if *weight > 0.0 {
                sum += value * weight * information.sqrt();
                count += information;
            }
            if count > WHOLE {
                found.push(sum / f64::sqrt(count));
                (sum, count) = (0.0, 0.0);
            }
        }
        found
    }

    /// The torque measured at the start, N·m, limited to what friction can hold (torque logs); 0 for angle logs, whose initial
    /// state is a shift of the angle.
    pub fn first_start(&self, ready: &Ready) -> InitialState {
        let Some(most_nm) = ready.static_torque_nm(&self.driven) else { return InitialState::default() };
        if !self.depends_on_its_start(ready) {
            return InitialState::default();
        }
        let count = self.measured.len().clamp(1, 5) as f64;
        let measured_nm = self.measured.iter().take(5).sum::<f64>() / count;
        InitialState::at(if measured_nm.is_finite() { measured_nm.clamp(-most_nm, most_nm) } else { 0.0 })
    }

    /// Whether the prediction depends on the initial state; it doesn't for a static friction law, which has neither bristles
    /// nor a memory.
    pub fn depends_on_its_start(&self, ready: &Ready) -> bool {
        !ready.starts_with_a_torque() || ready.has_sides() || self.start_bound(ready) > 0.0
    }

    /// Bound of the initial state's shift.
    pub fn start_bound(&self, ready: &Ready) -> f64 {
        if self.follows() { 0.0 } else { ready.start_bound(&self.driven) }
    }

    /// The finite-difference step of the initial state.
    pub fn start_step(&self, ready: &Ready) -> f64 {
        let part = 0.02 * self.start_bound(ready);
        if ready.starts_with_a_torque() {
            return part;
        }
        // A step beyond the encoder's noise could let a resting rotor break away.
        self.noise.deviation_rad.clamp(1e-3 * part, part)
    }

    /// The model's prediction of the piece.
    pub fn predict(&self, ready: &Ready, start: InitialState) -> Vec<f64> {
        let mut predicted = ready.predict(&self.inputs(), start);
        for (from, jump) in &self.jumps {
            predicted.iter_mut().skip(*from).for_each(|value| *value += jump);
        }
        predicted
    }

    /// The inputs of its prediction.
    fn inputs(&self) -> Inputs<'_> {
        let whole_run = self.course.as_ref().filter(|_| self.follows()).map(|course| (course, &self.rows));
        let stretch = match whole_run {
            Some(_) => Stretch::Run(self.run),
            None => Stretch::Piece(self.run, self.rows.start),
        };
        Inputs {
            driven: &self.driven,
            motions: &self.motions,
            deviation_rad: self.noise.deviation_rad,
            past: self.past,
            stretch: self.is_as_measured.then_some(stretch),
            whole_run,
            work: &self.work,
        }
    }

    /// The inputs of its prediction with another motion.
    fn moved<'a>(&'a self, motions: &'a [MotionSample]) -> Inputs<'a> {
        Inputs { motions, stretch: None, ..self.inputs() }
    }

    /// Angle, speed and acceleration at a sample; those of the command in an angle log.
    pub fn kinematics(&self, index: usize) -> (f64, f64, f64) {
        if self.motions.len() == self.len() {
            let none =
                MotionSample { angle_rad: f64::NAN, speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0 };
            let motion = self.motions.get(index).copied().unwrap_or(none);
            return (motion.angle_rad, motion.speed_rad_per_s, motion.acceleration_rad_per_s2);
        }
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(f64::NAN);
        let command = |index: usize| at(self.driven.command_rad(), index);
        let time = |index: usize| at(self.driven.time_s(), index);
        let speed = |index: usize| (command(index) - command(index - 1)) / (time(index) - time(index - 1));
        match index {
            0 => (command(0), 0.0, 0.0),
            1 => (command(1), speed(1), 0.0),
            _ => (
                command(index),
                speed(index),
                (speed(index) - speed(index - 1)) / (time(index) - time(index - 1)),
            ),
        }
    }

    /// True if the piece continues the one before it in its run: its prediction begins where the run does.
    pub fn follows(&self) -> bool {
        self.course.is_some() && self.rows.start > 0
    }

    /// The encoder's error propagated to the prediction: how much the prediction changes. In a torque log, if the motion is
    /// sampled again with the encoder's noise. In an angle log, if the start is off by the standard error of the mean of a few
    /// samples; a rotor that sticks and slips amplifies that.
    ///
    /// Several measurements, each with its encoder within its step elsewhere: where a motion stops, an error stays for the whole of a rest,
    /// and a single one may happen to be small.
    pub fn errors_of_motion(&self, ready: &Ready, start: InitialState, seed: u64) -> Vec<Vec<f64>> {
        let once = ready.predict(&self.inputs(), start);
        let error = |twice: Vec<f64>| once.iter().zip(twice).map(|(one, two)| two - one).collect();
        if !ready.starts_with_a_torque() {
            let shift = start.shift + self.noise.deviation_rad / (MOMENT_REACH as f64).sqrt();
            return vec![error(ready.predict(&self.inputs(), start.shifted(shift)))];
        }
        let again = |place: f64, number: u64| {
            error(ready.predict(&self.moved(&self.measured_again(place, seed ^ number << 48)), start))
        };
        // Friction without bristles forgets at once what its motion was.
        let places = if ready.start_bound(&self.driven) > 0.0 { &PLACES[..] } else { &[1.0] };
        places.iter().zip(0..).map(|(place, number)| again(*place, number)).collect()
    }

    /// The prediction's error due to the unknown motion between samples, estimated with samples twice as far apart: the
    /// prediction from a motion of which every second sample is missing (once the even, once the odd), minus the one from
    /// all. A spool that stops within a sample or two keeps the torque that its bristles had then, for as long as it rests.
    /// Empty if the prediction doesn't depend on it.
    pub fn error_of_sampling(&self, ready: &Ready, start: InitialState) -> [Vec<f64>; 2] {
        if !ready.starts_with_a_torque() || ready.start_bound(&self.driven) == 0.0 {
            return Default::default();
        }
        let all = ready.predict(&self.inputs(), start);
        [0, 1].map(|first| {
            let thinned = ready.predict(&self.moved(&self.thinned(first)), start);
            all.iter().zip(thinned).map(|(all, thinned)| thinned - all).collect()
        })
    }

    /// The prediction's error where a motion begins within the encoder's step: that from a motion which leaves each rest as early as its angle
    /// allows, minus the one from the angle. Empty if there is none, or the prediction doesn't depend on it.
    pub fn error_of_onset(&self, ready: &Ready, start: InitialState) -> Vec<f64> {
        if !ready.starts_with_a_torque() || ready.start_bound(&self.driven) == 0.0 {
            return Vec::new();
        }
        let Some(early) = begun_early(self.driven.time_s(), &self.motions, self.noise) else {
            return Vec::new();
        };
        let all = ready.predict(&self.inputs(), start);
        all.iter().zip(ready.predict(&self.moved(&early), start)).map(|(all, early)| early - all).collect()
    }

    /// The motion as it would be taken if every second sample, from `first` on, were missing: speeds from the others, and half-way between
    /// them what a step of twice the length takes.
    fn thinned(&self, first: usize) -> Vec<MotionSample> {
        let mut motions = self.motions.clone();
        let kept: Vec<(usize, f64, f64)> = (self.motions.iter().zip(self.driven.time_s()).enumerate())
            .skip(first + 1)
            .step_by(2)
            .map(|(index, (motion, time_s))| (index, *time_s, motion.angle_rad))
            .collect();
        let times: Vec<f64> = kept.iter().map(|of| of.1).collect();
        let angles: Vec<f64> = kept.iter().map(|of| of.2).collect();
        // The first and the last have a neighbour on one side alone: they stay as they are.
        for (place, three) in kept.windows(3).enumerate() {
            if let [_, (index, ..), _] = three
                && let Some(motion) = motions.get_mut(*index)
            {
                *motion = motion_through(&times, &angles, place + 1);
            }
        }
        for pair in kept.windows(2) {
            let [(index, begin_s, _), (_, end_s, _)] = pair else { continue };
            if let Some([start, between, end]) = motions.get_mut(*index..index + 3) {
                *between = half_way(start, end, end_s - begin_s);
            }
        }
        motions
    }

    /// Information per sample, given the variances of measured minus predicted: while the encoder stays within one step,
    /// samples share an error. In an angle log that is the quantisation error. In a torque log it is that error propagated to
    /// the prediction: the variance beyond `own_variance`, which is the transducer's.
    pub fn information_of(&self, kind: LogKind, variances: &[f64], own_variance: f64) -> Vec<f64> {
        let mut found = vec![1.0; self.len()];
        let (stretches, own, most) = if kind.motion_is_measured {
            (self.rests(), own_variance, f64::INFINITY)
        } else {
            let reach_rad = 1.01 * self.noise.step_rad + 4.0 * self.noise.beyond_quantisation_rad();
            (stretches(self.measured.iter().copied(), reach_rad), 0.0, rest_variance(self.noise))
        };
        for stretch in stretches.into_iter().filter(|stretch| stretch.len() > 1) {
            let (Some(found), Some(variances)) = (found.get_mut(stretch.clone()), variances.get(stretch))
            else {
                continue;
            };
            let all = variances.iter().sum::<f64>() / variances.len() as f64;
            let shared = (all - own).max(0.0).min(most);
            found.fill(information(shared, all - shared, variances.len()));
        }
        found
    }

    /// Stretches of a torque log within which its encoder stays within a step: the prediction has one error of its angle there.
    pub fn rests(&self) -> Vec<Range<usize>> {
        let reach_rad = 0.5 * self.noise.step_rad.max(self.noise.beyond_quantisation_rad());
        stretches(self.motions.iter().map(|motion| motion.angle_rad), reach_rad)
    }

    /// A piece of a torque log as if its motion had been measured again.
    pub fn again(&self, seed: u64) -> Self {
        let place = if seed & 1 == 0 { 1.0 } else { -1.0 };
        self.along(self.measured_again(place, seed))
    }

    /// A piece of a torque log as if every second sample, from `first` on, were missing.
    pub fn at_half_the_rate(&self, first: usize) -> Self {
        self.along(self.thinned(first))
    }

    /// The piece with another motion than the measured one.
    fn along(&self, motions: Vec<MotionSample>) -> Self {
        Self { motions, is_as_measured: false, ..self.clone() }
    }

    /// The motion as it would be measured with the encoder so many standard deviations of its rounding error beside where it was.
    fn measured_again(&self, place: f64, seed: u64) -> Vec<MotionSample> {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ ((self.run as u64) << 32) ^ self.rows.start as u64);
        let normal = Normal::new(0.0, self.noise.beyond_quantisation_rad());
        let step_rad = self.noise.step_rad;
        // At rest the true angle is anywhere within the quantisation step.
        let beside_rad = place * rest_variance(self.noise).sqrt();
        let mut measure = |angle_rad: f64| {
            let noisy =
                angle_rad + beside_rad + normal.as_ref().map_or(0.0, |normal| normal.sample(&mut random));
            let read = if step_rad > 0.0 { (noisy / step_rad).round() * step_rad } else { noisy };
            read - beside_rad
        };
        let angles: Vec<f64> = self.motions.iter().map(|motion| measure(motion.angle_rad)).collect();
        smoothed(self.driven.time_s(), &angles, self.noise, 0, self.len())
    }
}

/// Subtracts values from the measured channel, and adds them to those taken out before.
fn take_out(values: &[f64], measured: &mut [f64], taken: &mut Vec<f64>) {
    taken.resize(measured.len(), 0.0);
    for ((measured, taken), value) in measured.iter_mut().zip(taken).zip(values) {
        *measured -= value;
        *taken += value;
    }
}

fn smoothed(
    time_s: &[f64],
    angle_rad: &[f64],
    noise: Noise,
    first: usize,
    count: usize,
) -> Vec<MotionSample> {
    let mut smoother = Smoother::new(time_s, angle_rad, noise);
    let mut motions = Vec::with_capacity(count);
    for index in 0..first + count {
        let motion = smoother.motion(index);
        if index >= first {
            motions.push(motion);
        }
    }
    motions
}

/// Checks that a run is long enough and that no sample of a channel that is used is missing.
pub(crate) fn check(run: &Run, kind: LogKind, least_samples: usize) -> Result<(), DiagnosisError> {
    if run.len() < least_samples {
        let (run, found) = (run.name.clone(), run.len());
        return Err(DiagnosisError::TooShort { run, found, expected: least_samples });
    }
    let mut used = vec![Channel::Angle, Channel::PressureDrop, Channel::OilTemperature, kind.channel];
    if !kind.motion_is_measured {
        used.push(Channel::AngleCommand);
    }
    for channel in used {
        let values = run.channel(channel).unwrap_or_default();
        if let Some(index) = values.iter().position(|value| value.is_nan()) {
            return Err(DiagnosisError::MissingSample {
                run: run.name.clone(),
                row: index + 1,
                time_s: run.time_s.get(index).copied().unwrap_or(f64::NAN),
                channel,
            });
        }
    }
    Ok(())
}

/// Refuses a log in which nothing moves, because it shows no friction. Runs at rest are accepted beside runs that move. A rotor
/// that rests though its command moves is accepted too: that is to be explained.
pub(crate) fn check_motion<'a>(
    runs: impl Iterator<Item = &'a Run>,
    kind: LogKind,
) -> Result<(), DiagnosisError> {
    let mut resting = None;
    for run in runs {
        let first = run.angle_rad.first().copied().unwrap_or(0.0);
        let differs = |angle: &f64| *angle != first;
        let driven = !kind.motion_is_measured && run.angle_command_rad.iter().flatten().any(differs);
        if driven || run.angle_rad.iter().any(differs) {
            return Ok(());
        }
        resting = resting.or(Some((run, first)));
    }
    resting.map_or(Ok(()), |(run, angle_rad)| {
        Err(DiagnosisError::NeverMoves { run: run.name.clone(), rows: run.len(), angle_rad })
    })
}
