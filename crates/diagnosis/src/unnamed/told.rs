//! Laws without a name, as the diagnosis tells them: judged on runs held out, with their numbers and what they depend on.

use crate::DiagnosisError;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::{Free, Hypothesis, Member};
use crate::fit::equations::Point;
use crate::fit::spread::spread;
use crate::measure::accept::{corrected, covariance, errors_of, parameters};
use crate::measure::gain::{Part, gain, part_left_as_fitted};
use crate::measure::judgement::Judgement;
use crate::outcome::{Cause, Corrected, Covariance, Parameters, Unnamed, UnnamedGain, UnnamedRule};
use crate::show::residual::PieceResidual;
use crate::unnamed::factor::Factor;
use crate::unnamed::search::{Laws, part_cut, search, without};
use crate::unnamed::term::Term;
use valve_model::{CustomLaw, Effect, EffectId, Grid, Model, Rule};

/// A law must leave at most this part of the error on runs held out: a change that is smaller is none that a user would notice. A
/// further one must leave at most this part of what those before it leave.
const MOST_LEFT: f64 = 0.9;
/// A fit with fewer causes or laws is taken if it leaves at most so many times as much on the runs held out.
const HARDLY_MORE: f64 = 1.05;
/// A cause stood in for a law if beside it it cuts less than this part of the mean square that it cut without, and less than this part of
/// the mean square.
const IDLE: f64 = 0.25;
const MOST_OF_IDLE: f64 = 0.1;
/// A transducer counts as late from this many standard errors on.
const CLEAR: f64 = 2.0;

/// The model with laws without a name, and all that follows from it.
pub(crate) struct Extended {
    pub point: Point,
    pub after: Vec<PieceResidual>,
    pub corrected: Vec<Corrected>,
    pub covariance: Covariance,
    pub told: Vec<Unnamed>,
    pub gain: UnnamedGain,
    /// The laws as the model has them, in their order.
    effects: Vec<Effect>,
    /// The causes that stay beside them, with their numbers.
    causes: Vec<(EffectId, Parameters)>,
}

/// Laws with what they leave, and what that gains.
struct Kept {
    laws: Laws,
    point: Point,
    after: Vec<PieceResidual>,
    /// The part of the error on runs held out that is left, each sample counted by how well it is known, and its 95 % interval.
    part: f64,
    ci95: [f64; 2],
}

/// Searches for laws beside the accepted causes. `None` if there are none, or they don't hold on the runs that were held out, or none were.
pub(crate) fn unnamed(
    judged: &Judgement<'_>,
    able: &[Candidate],
    (accepted, before, causes): (&Point, &[PieceResidual], &[Cause]),
) -> Result<Option<Extended>, DiagnosisError> {
    let campaign = judged.setting.campaign;
    if !campaign.pieces.iter().any(|piece| piece.hold_out) {
        return Ok(None);
    }
    let begin = beside_what_is_uncertain(judged, able, accepted);
    // A search for causes that used up its samples says nothing against a law.
    let mut stages = campaign.with_reserve(|| search(&judged.setting, begin))?.into_iter();
    let Some(bare) = stages.next() else { return Ok(None) };
    let (_, bare) = judged.everywhere(&bare.tried.fitted)?;
    let mut kept: Option<Kept> = None;
    for laws in stages {
        let found = Kept::of(judged, &bare, laws)?;
        let holds =
            found.ci95[1] < 1.0 && gain(&judged.setting, before, &found.after, judged.seed).ratio <= 1.0;
        let most = kept.as_ref().map_or(MOST_LEFT, |kept| {
            let fewer = found.laws.terms.len() < kept.laws.terms.len();
            kept.part * if fewer { HARDLY_MORE } else { MOST_LEFT }
        });
        if holds && found.part <= most {
            kept = Some(found);
        }
    }
    let Some(kept) = kept else { return Ok(None) };
    let concluded = || {
        let kept = punctual(judged, &bare, kept)?;
        told(judged, (accepted, before), without_stand_ins(judged, &bare, causes, kept)?)
    };
    campaign.with_reserve(concluded).map(Some)
}

impl Kept {
    /// Laws, held against what is left without any.
    fn of(judged: &Judgement<'_>, bare: &[PieceResidual], laws: Laws) -> Result<Self, DiagnosisError> {
        let (point, after) = judged.everywhere(&laws.tried.fitted)?;
        let Part { ratio: part, ci95 } = part_left_as_fitted(&judged.setting, bare, &after, judged.seed);
        Ok(Self { laws, point, after, part, ci95 })
    }

    /// Another fit of the same laws in its place, if that leaves hardly more on the runs held out.
    fn or(self, other: Self) -> Self {
        if other.part <= HARDLY_MORE * self.part && other.ci95[1] < 1.0 { other } else { self }
    }
}

/// The same without causes that the laws make idle: they stood in for them. Beside the laws such a cause cuts a small part of what it cut
/// without them.
fn without_stand_ins(
    judged: &Judgement<'_>,
    bare: &[PieceResidual],
    causes: &[Cause],
    kept: Kept,
) -> Result<Kept, DiagnosisError> {
    let least = kept.laws.tried.rms;
    let mut laws = kept.laws.clone();
    for place in (0..kept.point.hypothesis.members.len() - laws.terms.len()).rev() {
        let members = &laws.tried.fitted.point.hypothesis.members;
        let Some(id) = members.get(place).map(|of| of.candidate.id) else { continue };
        let Some(cause) = causes.iter().find(|cause| cause.id == id) else { continue };
        if id == EffectId::SensorDelay || judged.setting.is_over() {
            continue;
        }
        let instead = judged.corrections.iter().find(|of| of.id == id);
        let Some(tried) = without(&judged.setting, &laws.tried, place, instead)? else { continue };
        let alone = 1.0 - (1.0 - cause.rms_gain).powi(2);
        if part_cut(&tried, least) < (IDLE * alone).min(MOST_OF_IDLE) {
            laws.tried = tried;
        }
    }
    if laws.tried.fitted.point.hypothesis.members.len() == kept.point.hypothesis.members.len() {
        return Ok(kept);
    }
    let fewer = Kept::of(judged, bare, laws)?;
    Ok(kept.or(fewer))
}

/// `before` is what the accepted causes leave. Where none of them stays, the laws are held against the given model.
fn told(
    judged: &Judgement<'_>,
    (accepted, before): (&Point, &[PieceResidual]),
    kept: Kept,
) -> Result<Extended, DiagnosisError> {
    let Kept { laws, point, after, .. } = kept;
    let errors = errors_of(judged, &laws.tried.fitted)?;
    let first = point.hypothesis.members.len() - laws.terms.len();
    let members = point.hypothesis.members.iter().take(first).enumerate();
    let causes: Vec<_> = members.map(|(index, of)| (of.candidate.id, parameters(&errors, index))).collect();
    let any_cause = causes.iter().any(|(id, _)| accepted.hypothesis.has(*id));
    let base = if any_cause { before } else { &judged.before };
    let found = gain(&judged.setting, base, &after, judged.seed);
    let (mut in_words, mut effects) = (Vec::new(), Vec::new());
    for (index, term) in laws.terms.iter().enumerate() {
        let Some(member) = point.hypothesis.members.get(first + index) else { continue };
        let refused = |source| judged.setting.campaign.refused(source);
        let effect = member.candidate.effect(judged.setting.given, &member.numbers).map_err(refused)?;
        let effect = as_table(term, &effect, &member.numbers).unwrap_or(effect);
        in_words.extend(words(term, &effect, parameters(&errors, first + index)));
        effects.push(effect);
    }
    Ok(Extended {
        corrected: corrected(&errors.hypothesis, errors.spread.as_ref()),
        covariance: errors
            .spread
            .as_ref()
            .map(|spread| covariance(&errors.hypothesis, spread))
            .unwrap_or_default(),
        point,
        after,
        told: in_words,
        gain: UnnamedGain {
            rms_before: found.rms_before,
            rms_after: found.rms_after,
            ratio: found.ratio,
            ratio_ci95: found.ratio_ci95,
        },
        effects,
        causes,
    })
}

fn words(term: &Term, effect: &Effect, parameters: Parameters) -> Option<Unnamed> {
    let law = effect.custom()?;
    let (rule, parameters) = match &law.rule {
        Rule::Formula(text) => (UnnamedRule::Formula { expression: text.clone() }, parameters),
        Rule::Table(grid) => {
            let (over, knots) = grid.axes().map(|(of, knots)| (of.name().to_owned(), knots.to_vec())).unzip();
            let values = grid.values().iter().flatten().copied().collect();
            (UnnamedRule::Table { over, knots, values }, Parameters::new())
        }
    };
    Some(Unnamed {
        id: effect.id(),
        acts_on: law.acts_on.name().to_owned(),
        depends_on: term.covariates().map(|of| of.name().to_owned()).collect(),
        rule,
        parameters,
    })
}

impl Extended {
    /// What the measurement does beside the laws, in words: where no cause was named for it.
    pub fn nuisances(&self, causes: &[Cause]) -> Option<String> {
        let is_named = causes.iter().any(|cause| cause.id == EffectId::SensorDelay);
        let (_, parameters) = self.causes.iter().find(|(id, _)| *id == EffectId::SensorDelay && !is_named)?;
        let late_s = parameters.get("delay_s")?.value;
        Some(format!("beside the laws the torque is {:.2} ms late against the angle", 1e3 * late_s))
    }

    /// The causes with their numbers beside the laws, and those that the laws make idle.
    pub fn beside(&self, causes: Vec<Cause>) -> (Vec<Cause>, Vec<EffectId>) {
        let (mut stay, mut idle) = (Vec::new(), Vec::new());
        for cause in causes {
            match self.causes.iter().find(|(id, _)| *id == cause.id) {
                Some((_, parameters)) => stay.push(Cause { parameters: parameters.clone(), ..cause }),
                // Lost steps are no part of the hypothesis.
                None if cause.id == EffectId::MissedSteps => stay.push(cause),
                None => idle.push(cause.id),
            }
        }
        (stay, idle)
    }

    /// The model with everything; curves as tables.
    pub fn model(&self, judged: &Judgement<'_>) -> Result<Model, DiagnosisError> {
        let refused = |source| judged.setting.campaign.refused(source);
        let mut model = self.point.hypothesis.model(judged.setting.given).map_err(refused)?;
        for effect in &self.effects {
            let present = model.effects.iter_mut().find(|present| present.id() == effect.id());
            present.into_iter().for_each(|present| *present = effect.clone());
        }
        Ok(model)
    }
}

/// The accepted causes with everything that may be off without being a law: every correction that the tolerance allows, and, in a log
/// with a transducer, its lateness.
fn beside_what_is_uncertain(judged: &Judgement<'_>, able: &[Candidate], accepted: &Point) -> Point {
    let own = &accepted.hypothesis;
    let is_there = |id| own.corrections.iter().any(|of| of.id == id) || own.has(id);
    let more = judged.corrections.iter().filter(|of| !is_there(of.id)).cloned();
    let corrections = own.corrections.iter().cloned().chain(more).collect();
    let late = if is_there(EffectId::SensorDelay) { None } else { lateness(judged, able) };
    let members = own.members.iter().cloned().chain(late).collect();
    Point { hypothesis: Hypothesis { members, corrections, ..own.clone() }, starts: accepted.starts.clone() }
}

/// A transducer's lateness, as the search found it if it did.
fn lateness(judged: &Judgement<'_>, able: &[Candidate]) -> Option<Member> {
    if !judged.setting.campaign.kind.motion_is_measured {
        return None;
    }
    let members = &judged.selection.fitted.point.hypothesis.members;
    let found = members.iter().find(|member| member.candidate.id == EffectId::SensorDelay).cloned();
    let candidate = able.iter().find(|candidate| candidate.id == EffectId::SensorDelay);
    found.or_else(|| candidate.map(|of| Member::new(of, of.neutral(), of.free.clone())))
}

/// The same without a lateness that is within its errors, or a lead.
fn punctual(judged: &Judgement<'_>, bare: &[PieceResidual], kept: Kept) -> Result<Kept, DiagnosisError> {
    let hypothesis = &kept.point.hypothesis;
    let own = hypothesis.members.len() - kept.laws.terms.len();
    let late = hypothesis.members.iter().take(own).position(|of| of.candidate.id == EffectId::SensorDelay);
    let Some(late) = late.filter(|_| !judged.setting.is_over()) else { return Ok(kept) };
    let place = hypothesis.free().iter().position(|free| *free == Free::Number(late, 0));
    let spread = spread(&kept.laws.tried.fitted, judged.setting.loss());
    let deviation =
        place.zip(spread).map_or(f64::INFINITY, |(place, spread)| spread.deviation_given(place, &[]));
    if hypothesis.get(Free::Number(late, 0)) > CLEAR * deviation {
        return Ok(kept);
    }
    let Some(tried) = without(&judged.setting, &kept.laws.tried, late, None)? else { return Ok(kept) };
    let punctual = Kept::of(judged, bare, Laws { tried, ..kept.laws.clone() })?;
    Ok(kept.or(punctual))
}

/// A curve as a table: its values at its knots.
fn as_table(term: &Term, effect: &Effect, numbers: &[f64]) -> Option<Effect> {
    let [Factor { of, knots, .. }] = term.factors.as_slice() else { return None };
    let inner = knots.get(1..knots.len().checked_sub(1)?)?;
    let value = |x: &f64| {
        let straight = numbers.first().copied().unwrap_or(0.0) * x;
        let bends =
            inner.iter().zip(numbers.iter().skip(1)).map(|(knot, number)| number * (x - knot).max(0.0));
        straight + bends.sum::<f64>()
    };
    let values = knots.iter().map(|knot| vec![value(knot)]).collect();
    let grid = Grid::new(vec![*of], vec![knots.clone()], values).ok()?;
    let law = CustomLaw { acts_on: term.acts_on, rule: Rule::Table(grid) };
    Effect::custom_named(effect.id().name(), law, &[]).ok()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use valve_model::{ActsOn, Covariate, EffectValue};

    #[test]
    fn a_curve_and_its_table_say_the_same() {
        let term = Term {
            acts_on: ActsOn::Level,
            factors: vec![Factor::curve(Covariate::Speed, vec![-2.0, -0.5, 0.0, 0.5, 2.0])],
        };
        let suspect = term.suspect("by-speed").unwrap();
        let numbers = [0.1, -0.3, 0.2, 0.4];
        let parts: Vec<_> = suspect
            .parameters
            .iter()
            .zip(numbers)
            .map(|(of, number)| (of.key.as_str().to_owned(), EffectValue::Number(number)))
            .collect();
        let parts: Vec<(&str, EffectValue)> =
            parts.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
        let formula = suspect.effect.with_parts(&parts).unwrap();
        let table = as_table(&term, &formula, &numbers).unwrap();
        assert_eq!(table.id(), formula.id());
        for speed in [-5.0, -2.0, -1.0, -0.2, 0.0, 0.3, 1.0, 7.0] {
            let mut at = [0.0; 8];
            at[1] = speed;
            let (one, two) = (formula.custom_value(&at).unwrap(), table.custom_value(&at).unwrap());
            assert!((one - two).abs() < 1e-12, "{speed}: {one} {two}");
        }
    }
}
