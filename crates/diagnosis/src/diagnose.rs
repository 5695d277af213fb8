//! The four steps, one after the other.

use crate::DiagnosisError;
use crate::campaign::Campaign;
use crate::excitation::excitation;
use crate::findings::{self, MISFIT};
use crate::fit::{Fitted, fit};
use crate::hypothesis::Hypothesis;
use crate::linear::{Nuisances, Point, Setting};
use crate::measure::{Jumps, Left, gain, left, left_with, nothing, rms_left, settled};
use crate::noise::{NoiseLevel, estimate};
use crate::outcome::{Cause, Diagnosis, Evidence, ParameterFound, Residual};
use crate::piece::{Piece, Ready};
use crate::rivals::fitted_pieces;
use crate::select::{Selection, select};
use crate::show::{Structure, structure};
use crate::table::candidates;
use crate::workers::{Workers, map};
use log_data::{Channel, Log};
use std::collections::BTreeMap;
use valve_model::{Effect, Model};

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// Decides which runs are held out, and the bootstrap's draws: the same seed, the same answer.
    pub seed: u64,
    /// The measured channel's noise where it is known, RMS in its unit, above zero; without, it is estimated from the log.
    pub noise: Option<f64>,
}

/// What happens on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// The residual of the given model and the noise, RMS in the channel's unit.
    Noise {
        /// Measured less predicted, on the runs that causes are fitted on.
        rms: f64,
        /// What the measurement scatters by itself.
        noise: f64,
    },
    /// Causes by what they would cut the held-out RMS, in parts of the noise; linearised.
    Ranking(&'a [(&'static str, f64)]),
    /// A step of the work.
    Step(&'static str),
}

/// A piece of a run, for plots: measured against predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The run's place in the log, its name and kind.
    pub run: usize,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Whether it was held out.
    pub held_out: bool,
    /// Times, s.
    pub time_s: Vec<f64>,
    /// Measured angle, rad: of the command in logs without torque.
    pub angle_rad: Vec<f64>,
    /// Speed, rad/s.
    pub speed_rad_per_s: Vec<f64>,
    /// Pressure drop, Pa; empty without.
    pub pressure_pa: Vec<f64>,
    /// Oil temperature, °C; empty without.
    pub temperature_c: Vec<f64>,
    /// What was measured: torque, N·m, or angle, rad.
    pub measured: Vec<f64>,
    /// What the given model has for it.
    pub before: Vec<f64>,
    /// What the extended one has.
    pub after: Vec<f64>,
}

/// The diagnosis, and what goes with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// For diagnosis.json.
    pub diagnosis: Diagnosis,
    /// The given model with what was found.
    pub extended: Model,
    /// Of each group of causes that can't be told apart, in their order, the effect that fitted best; none where something
    /// speaks against what was found.
    pub proposed: Vec<Effect>,
    /// The channel that the model predicts.
    pub channel: Channel,
    /// The first screening: cut of the held-out RMS in parts of the noise.
    pub ranking: Vec<(&'static str, f64)>,
    /// The pieces, for plots.
    pub shown: Vec<Shown>,
    /// Samples of the log, and of those the ones that were fitted or held out.
    pub samples: (usize, usize),
}

/// Holds a log against a model.
///
/// # Errors
/// [`DiagnosisError`]: a run or a model that can't be used.
pub fn diagnose(
    log: &Log,
    model: &Model,
    options: &Options,
    workers: &dyn Workers,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Found, DiagnosisError> {
    tell(Event::Step("reading the motion"));
    let mut campaign = Campaign::new(log, model, options.seed, workers)?;
    let ready = campaign.ready(model)?;
    let first = begin(&campaign, &ready);
    check_finite(&campaign, &ready, &first, workers)?;
    tell(Event::Step("estimating the noise"));
    let noise = estimate(&mut campaign, &ready, &first, options, workers);
    campaign.facts.excitation = excitation(&campaign, noise.channel);
    let (able, unable) = candidates(&campaign.facts, model);
    let nuisances = Nuisances {
        zero_nm: 0.0,
        angle_zero: campaign.channel == Channel::Angle && campaign.angle_zero_per_run,
    };
    let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
    let judged = judge(setting, noise, &first, None, &able, options.seed, tell)?;
    let zero_nm = judged.zero_from_run_to_run(&judged.selection.fitted)?;
    if zero_nm == 0.0 {
        return findings::conclude(&judged, &able, &unable);
    }
    tell(Event::Step("once more, with a zero of the torque that differs from run to run"));
    let setting = Setting { nuisances: Nuisances { zero_nm, ..nuisances }, ..setting };
    let judged = judge(setting, noise, &first, Some(&judged.selection), &able, options.seed, tell)?;
    findings::conclude(&judged, &able, &unable)
}

/// From the first residual to the causes that are accepted.
fn judge<'a>(
    setting: Setting<'a>,
    noise: NoiseLevel,
    first: &Point,
    earlier: Option<&Selection>,
    able: &[crate::candidate::Candidate],
    seed: u64,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Judgement<'a>, DiagnosisError> {
    let base = fit(&setting, first.clone(), &fitted_pieces, 4)?;
    let begun = base.point.clone();
    let seen = left_with(&setting, &begun, Jumps::Seen)?;
    tell(Event::Noise { rms: rms_left(&setting, &seen, &fitted_pieces), noise: noise.total });
    tell(Event::Step("screening causes"));
    let selection = select(&setting, able, base, earlier, &mut |ranking| tell(Event::Ranking(ranking)))?;
    tell(Event::Step("measuring the gain"));
    // Only now: who waits for the first ranking need not wait for this.
    let everything = |_: &Piece| true;
    let before = left_with(&setting, &settled(&setting, &begun, &everything)?, Jumps::Seen)?;
    let rms = rms_left(&setting, &before, &everything);
    let structure_before = structure(&setting, &before);
    Ok(Judgement { setting, noise, selection, before, structure_before, rms, seed })
}

/// Everything that the conclusion rests on.
pub(crate) struct Judgement<'a> {
    pub setting: Setting<'a>,
    pub noise: NoiseLevel,
    pub selection: Selection,
    pub before: Vec<Left>,
    pub structure_before: Structure,
    pub rms: f64,
    pub seed: u64,
}

impl Judgement<'_> {
    /// A hypothesis on all pieces, with what is left of them.
    pub fn everywhere(&self, fitted: &Fitted) -> Result<(Point, Vec<Left>), DiagnosisError> {
        let point = settled(&self.setting, &fitted.point, &|_: &Piece| true)?;
        let left = left(&self.setting, &point)?;
        Ok((point, left))
    }

    pub fn gain_of(&self, after: &[Left]) -> crate::outcome::Gain {
        gain(&self.setting, &self.before, after, self.seed)
    }

    /// Standard deviation of the torque's zero from run to run that is left; 0 where it is no more than noise.
    fn zero_from_run_to_run(&self, fitted: &Fitted) -> Result<f64, DiagnosisError> {
        let campaign = self.setting.campaign;
        if campaign.channel != Channel::Torque || self.setting.nuisances.zero_nm > 0.0 {
            return Ok(0.0);
        }
        let (_, left) = self.everywhere(fitted)?;
        let structure = structure(&self.setting, &left);
        let by_run = structure.dependences.iter().find(|of| of.on == "run" && !of.as_friction);
        let within =
            structure.dependences.iter().find(|of| of.on != "run" && of.share > 0.02 && of.p_value < 0.01);
        let share = by_run.filter(|of| of.p_value < 0.01).map_or(0.0, |of| of.share);
        let of_others = within.map_or(0.0, |of| of.share);
        // Zeros explain nothing that a covariate within the runs explains better, nor the misfit of a large cause.
        let explained = self.selection.explained();
        let of_a_cause = share * structure.rms.powi(2) < MISFIT * explained;
        if share < 0.05 || of_others > 0.8 * share || of_a_cause {
            return Ok(0.0);
        }
        Ok(share.sqrt() * structure.rms * self.noise_where_it_counts())
    }

    /// What an error as large as the noise everywhere comes to, weighted as the samples are: of a residual in parts of its
    /// noise, the unit.
    pub fn noise_where_it_counts(&self) -> f64 {
        let weights = || self.setting.campaign.pieces.iter().flat_map(|piece| &piece.weights);
        let (square, count) =
            weights().fold((0.0, 0.0), |(square, count), weight| (square + weight * weight, count + 1.0));
        if square > 0.0 { f64::sqrt(count / square) } else { self.noise.total }
    }

    /// What differs from run to run by itself.
    pub fn nuisances(&self) -> Vec<String> {
        let nuisances = self.setting.nuisances;
        let mut found = Vec::new();
        if nuisances.zero_nm > 0.0 {
            found.push(format!(
                "the torque's zero differs from run to run by about {:.3} N·m",
                nuisances.zero_nm
            ));
        }
        if nuisances.angle_zero {
            found.push("each run has a zero of its own angle".to_owned());
        }
        let zero_rad = self.selection.fitted.point.hypothesis.zero_rad;
        if let Some(zero_rad) = zero_rad.filter(|zero_rad| zero_rad.abs() > 0.1 * self.noise.channel) {
            found.push(format!("the encoder's zero is {zero_rad:.2e} rad from the command's"));
        }
        found
    }

    /// Lost steps as a cause.
    pub fn missed_steps(&self, after: &[Left]) -> Option<Cause> {
        let campaign = self.setting.campaign;
        let (piece, row, jump) = campaign
            .pieces
            .iter()
            .find_map(|piece| piece.jumps.first().map(|jump| (piece, jump.0, jump.1)))?;
        let pitch_rad = self
            .setting
            .given
            .motor
            .map_or(f64::NAN, |motor| std::f64::consts::TAU / f64::from(motor.rotor_teeth));
        let begin_s = piece.driven.time_s().first().copied().unwrap_or(0.0);
        let time_s = piece.driven.time_s().get(row).copied().unwrap_or(f64::NAN) - begin_s;
        let step_s = campaign.facts.step_s;
        let number = |value: f64, error: f64, unit: &str| ParameterFound {
            value,
            std_error: error,
            ci95: [value - 2.0 * error, value + 2.0 * error],
            unit: unit.to_owned(),
        };
        let parameters = BTreeMap::from([
            ("time_s[1]".to_owned(), number(time_s, 5.0 * step_s, "s")),
            ("teeth[1]".to_owned(), number((jump / pitch_rad).round(), 0.0, "1")),
        ]);
        let name = campaign.runs.get(piece.run).map_or(String::new(), |run| run.0.clone());
        let evidence = BTreeMap::from([("run".to_owned(), Evidence::Text(name))]);
        let everything = |_: &Piece| true;
        let rms = rms_left(&self.setting, after, &everything);
        let rms_gain = 1.0 - rms / self.rms.max(rms);
        Some(Cause { id: "missed-steps".to_owned(), parameters, evidence, rms_gain })
    }

    pub fn residual(&self) -> Residual {
        let channel = self.setting.campaign.channel;
        Residual {
            quantity: channel.name().to_owned(),
            unit: channel.unit().to_owned(),
            noise: self.noise.total,
            rms: self.rms,
        }
    }

    pub fn without_causes(&self) -> Hypothesis {
        nothing(&self.selection.fitted.point.hypothesis)
    }
}

fn begin(campaign: &Campaign, ready: &Ready) -> Point {
    let common = campaign.channel == Channel::Angle && !campaign.angle_zero_per_run;
    let hypothesis = Hypothesis { members: Vec::new(), zero_rad: common.then_some(0.0) };
    Point { hypothesis, starts: campaign.pieces.iter().map(|piece| piece.first_start(ready)).collect() }
}

/// A model whose numbers run away can't be simulated.
fn check_finite(
    campaign: &Campaign,
    ready: &Ready,
    first: &Point,
    workers: &dyn Workers,
) -> Result<(), DiagnosisError> {
    let bad = map(workers, campaign.pieces.len(), |index| {
        let piece = campaign.pieces.get(index)?;
        let predicted = piece.predict(ready, first.start(index));
        let row = predicted.iter().position(|value| !value.is_finite())?;
        Some((piece.run, piece.rows.start + row + 1, predicted.get(row).copied().unwrap_or(f64::NAN)))
    });
    match bad.into_iter().flatten().next() {
        None => Ok(()),
        Some((run, row, found)) => Err(DiagnosisError::NotFinite {
            run: campaign.runs.get(run).map_or(String::new(), |run| run.0.clone()),
            row,
            channel: campaign.channel,
            found,
        }),
    }
}
