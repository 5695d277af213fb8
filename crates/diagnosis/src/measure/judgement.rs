//! Everything that the conclusion rests on: the causes selected, the residual before them, and the noise.

use crate::DiagnosisError;
use crate::contest::{Contender, Contest};
use crate::extend::hypothesis::{Correction, Hypothesis};
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::log::noise::NoiseLevel;
use crate::log::piece::Piece;
use crate::measure::gain::gain;
use crate::name::forms::MISFIT;
use crate::name::selection::Selection;
use crate::numerics::statistics::CHANCE;
use crate::outcome::{Cause, Evidence, Gain, ParameterFound, Residual};
use crate::show::colour::{Colour, colour};
use crate::show::conditions::{changed_with_time, go_by_conditions};
use crate::show::observe::{between_runs, shows_zeros, torque};
use crate::show::own_zeros::{mean_and_scatter, own_zeros, zeros_wander};
use crate::show::residual::{PieceResidual, left, rms_left, settled};
use crate::show::structure::{Structure, counts, rms, structure};
use std::collections::BTreeMap;
use valve_model::EffectId;

/// The encoder is named as an origin of coloured noise if its part of the noise's variance exceeds this.
const MUCH: f64 = 0.09;

/// Everything that the conclusion rests on.
pub(crate) struct Judgement<'a> {
    pub setting: Setting<'a>,
    pub noise: NoiseLevel,
    pub selection: Selection,
    /// The corrections that the model's tolerance allows, all neutral.
    pub corrections: Vec<Correction>,
    pub before: Vec<PieceResidual>,
    pub structure_before: Structure,
    pub rms: f64,
    pub seed: u64,
}

impl Judgement<'_> {
    /// A fitted hypothesis settled on all pieces, and its residual.
    pub fn everywhere(&self, fitted: &Fitted) -> Result<(Point, Vec<PieceResidual>), DiagnosisError> {
        let settling = || settled(&self.setting, &fitted.point, &|_: &Piece| true);
        let point = self.setting.campaign.with_reserve(settling)?;
        let left = left(&self.setting, &point)?;
        Ok((point, left))
    }

    /// Whether the selected causes leave less than this fraction of the noise, in a log whose noise depends on the model: in a
    /// torque log the encoder's errors are propagated through it.
    pub fn leaves_less_than(&self, part: f64) -> Result<bool, DiagnosisError> {
        let selected = !self.selection.fitted.point.hypothesis.members.is_empty();
        if !selected || !self.setting.campaign.kind.motion_errs {
            return Ok(false);
        }
        let (_, left) = self.everywhere(&self.selection.fitted)?;
        Ok(rms(&self.setting, &left) < part)
    }

    /// Explanations as an experiment between them is planned; `None` with fewer than two.
    pub fn contest(&self, contenders: Vec<Contender>) -> Option<Contest> {
        let campaign = self.setting.campaign;
        let deviation = self.noise_where_it_counts() * self.noise.per_independent.sqrt();
        let samples = campaign.samples as f64 / self.noise.per_independent;
        let noise = (deviation, self.setting.nuisances.zero_nm);
        Contest::new(self.setting.given, contenders, noise, (campaign.facts.travel_rad, samples))
    }

    pub fn gain_of(&self, after: &[PieceResidual]) -> Gain {
        gain(&self.setting, &self.before, after, self.seed)
    }

    /// Standard deviation of the torque's zero from run to run in the residual. 0 if it is no more than noise, or if these runs
    /// can't show a zero: between different runs in one direction, friction differs too.
    pub fn zero_from_run_to_run(&self, fitted: &Fitted) -> Result<f64, DiagnosisError> {
        let campaign = self.setting.campaign;
        if !campaign.kind.residual_is_torque() || self.setting.nuisances.zero_nm > 0.0 {
            return Ok(0.0);
        }
        let (_, left) = self.everywhere(fitted)?;
        let structure = structure(&self.setting, &left);
        let by_run = structure.dependences.iter().find(|of| of.on == "run" && !of.as_friction);
        let within = structure.dependences.iter().find(|of| of.on != "run" && counts(of));
        let share = by_run.filter(|of| of.p_value < CHANCE).map_or(0.0, |of| of.share);
        let of_others = within.map_or(0.0, |of| of.share);
        // A dependence on the run is no zero if a covariate within the runs explains it better, or if it is within the misfit
        // of a large cause.
        let explained = self.selection.explained();
        let of_a_cause = share * structure.rms.powi(2) < MISFIT * explained;
        if share < 0.05 || of_others > 0.8 * share || of_a_cause || !shows_zeros(campaign) {
            return Ok(0.0);
        }
        let zero_nm = between_runs(campaign, &left).unwrap_or(0.0);
        let with_zeros =
            Setting { nuisances: Nuisances { zero_nm, ..self.setting.nuisances }, ..self.setting };
        let are_zeros =
            !go_by_conditions(&with_zeros, &fitted.point)? && !zeros_wander(&with_zeros, &fitted.point)?;
        Ok(if are_zeros { zero_nm } else { 0.0 })
    }

    /// The noise's RMS under the fit's weights, N·m or rad: the factor from a normalised residual to the channel's
    /// unit.
    pub fn noise_where_it_counts(&self) -> f64 {
        let counted = self.setting.campaign.pieces.iter().flat_map(Piece::counted);
        let (square, count) = counted.fold((0.0, 0.0), |(square, count), (weight, information)| {
            (square + weight * weight, count + information)
        });
        if square > 0.0 { f64::sqrt(count / square) } else { self.noise.total }
    }

    /// The noise's colour, if the residual is coloured noise.
    pub fn colour(&self) -> Result<Option<Colour>, DiagnosisError> {
        let (_, left) = self.everywhere(&self.selection.fitted)?;
        Ok(colour(&self.setting, &left))
    }

    /// The standard deviation of the torque's zero from run to run as it was found, N·m; 0 where runs have none of their own.
    pub fn scatter_of_zeros_nm(&self) -> Result<f64, DiagnosisError> {
        if self.setting.nuisances.zero_nm == 0.0 {
            return Ok(0.0);
        }
        let zeros = own_zeros(&self.setting, &self.selection.fitted.point)?;
        Ok(mean_and_scatter(&zeros).1)
    }

    /// The nuisances, in words: what differs from run to run or disturbs the measurement, without being a cause.
    ///
    /// # Errors
    /// As predictions have them.
    pub fn nuisances(&self) -> Result<Vec<String>, DiagnosisError> {
        let mut found = Vec::new();
        let scatter_nm = self.scatter_of_zeros_nm()?;
        if scatter_nm > 0.0 {
            let zeros = format!("the torque's zero differs from run to run by about {}", torque(scatter_nm));
            found.push(match changed_with_time(&self.setting, &self.selection.fitted.point)? {
                None => zeros,
                Some(condition) => format!(
                    "{zeros}, and goes with the {condition}, which changed as time went on: a transducer that drifts and a torque by the \
                     {condition} look the same here; run the first levels once more after the last ones"
                ),
            });
        }
        if self.noise.per_independent > 1.0 {
            let alike_s = self.noise.per_independent * self.setting.campaign.facts.step_s;
            let of_motion = (1.0 - (self.noise.channel / self.noise.total).powi(2)).max(0.0);
            let why = if of_motion > MUCH {
                format!(
                    "; {:.0} % of its square are the encoder's steps, as bristles and inertia pass them on",
                    100.0 * of_motion
                )
            } else {
                String::new()
            };
            found.push(format!(
                "the noise is coloured: neighbours within about {:.1} ms are alike{why}",
                1e3 * alike_s
            ));
        }
        let channel = self.setting.campaign.kind.channel;
        for hum in &self.setting.campaign.hums {
            found.push(format!(
                "a hum of {:.1} Hz, amplitude {:.2e} {}, is in the {} throughout",
                hum.hz,
                hum.amplitude,
                channel.unit(),
                channel.name()
            ));
        }
        if self.setting.nuisances.angle_zero {
            found.push("each run has a zero of its own angle".to_owned());
        }
        let zero_rad = self.selection.fitted.point.hypothesis.zero_rad;
        if let Some(zero_rad) = zero_rad.filter(|zero_rad| zero_rad.abs() > 0.1 * self.noise.channel) {
            found.push(format!("the encoder's zero is {zero_rad:.2e} rad from the command's"));
        }
        Ok(found)
    }

    /// Lost steps as a cause.
    pub fn missed_steps(&self, after: &[PieceResidual]) -> Option<Cause> {
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
        Some(Cause { id: EffectId::MissedSteps, parameters, evidence, rms_gain })
    }

    /// The residual of the given model, and the noise, which is at most the residual after the accepted causes.
    pub fn residual(&self, after: &[PieceResidual]) -> Residual {
        let channel = self.setting.campaign.kind.channel;
        let left = rms_left(&self.setting, after, &|_: &Piece| true);
        Residual {
            quantity: channel.name().to_owned(),
            unit: channel.unit().to_owned(),
            noise: self.noise.told(left),
            rms: self.rms,
        }
    }

    pub fn without_causes(&self) -> Hypothesis {
        self.selection.fitted.point.hypothesis.without_causes()
    }
}
