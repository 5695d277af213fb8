//! The four steps, one after the other.

use crate::DiagnosisError;
use crate::campaign::Campaign;
use crate::findings;
use crate::fit::{Fitted, fit};
use crate::hypothesis::Hypothesis;
use crate::linear::{Nuisances, Point, Setting};
use crate::measure::{Left, gain, left, nothing, rms_left, settled};
use crate::noise::{NoiseLevel, estimate};
use crate::outcome::{Diagnosis, Residual};
use crate::piece::Ready;
use crate::select::{Selection, select};
use crate::show::{Structure, structure};
use crate::table::candidates;
use crate::workers::{Workers, map};
use log_data::{Channel, Log};
use valve_model::Model;

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// Decides which runs are held out, and the bootstrap's draws: the same seed, the same answer.
    pub seed: u64,
}

/// What happens on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// The residual of the given model and the noise, RMS in the channel's unit.
    Noise {
        /// Measured less predicted.
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
    /// The channel that the model predicts.
    pub channel: Channel,
    /// The rivals of each round with their held-out RMS in parts of the noise, and who was accepted.
    pub rounds: Vec<(Option<&'static str>, f64, Vec<(&'static str, f64)>)>,
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
    let noise = estimate(&mut campaign, &ready, &first.starts, options.seed, workers);
    let (able, unable) = candidates(&campaign.facts, model);
    let nuisances = Nuisances {
        zero_nm: 0.0,
        angle_zero: campaign.channel == Channel::Angle && campaign.angle_zero_per_run,
    };
    let setting = Setting { campaign: &campaign, given: model, nuisances, workers };
    let everything = |_: &crate::piece::Piece| true;
    let base = fit(&setting, first, &|piece| !piece.hold_out, 4)?;
    let base_all = settled(&setting, &base.point, &everything)?;
    let before = left(&setting, &base_all)?;
    let rms = rms_left(&setting, &before, &everything);
    tell(Event::Noise { rms, noise: noise.total });
    let structure_before = structure(&setting, &before);
    tell(Event::Step("screening causes"));
    let selection = select(&setting, &able, base, &mut |ranking| tell(Event::Ranking(ranking)))?;
    tell(Event::Step("measuring the gain"));
    let judged = Judgement { setting, noise, selection, before, structure_before, rms, seed: options.seed };
    findings::conclude(&judged, &able, &unable)
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
        let point = settled(&self.setting, &fitted.point, &|_: &crate::piece::Piece| true)?;
        let left = left(&self.setting, &point)?;
        Ok((point, left))
    }

    pub fn gain_of(&self, after: &[Left]) -> crate::outcome::Gain {
        gain(&self.setting, &self.before, after, self.seed)
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
        let predicted = piece.predict(ready, first.starts.get(index).copied().unwrap_or(0.0));
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
