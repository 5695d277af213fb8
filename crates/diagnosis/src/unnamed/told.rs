//! Laws without a name, as the diagnosis tells them: with their numbers and what they depend on, in the extended model.

use crate::DiagnosisError;
use crate::contest::{Contender, Contest};
use crate::error::if_possible;
use crate::fit::equations::Point;
use crate::fit::gauss_newton::Fitted;
use crate::measure::accept::{errors_of, parameters};
use crate::measure::alternatives::{self, Rival};
use crate::measure::gain::gain;
use crate::measure::judgement::Judgement;
use crate::name::tried::{NEARLY, STEPS, Tried};
use crate::outcome::{Cause, Corrected, Covariance, Parameters, Unnamed, UnnamedGain, UnnamedRule};
use crate::show::residual::PieceResidual;
use crate::unnamed::factor::Factor;
use crate::unnamed::kept::Kept;
use crate::unnamed::kind::kind;
use crate::unnamed::search::Laws;
use crate::unnamed::term::Term;
use valve_model::{CustomLaw, Effect, EffectId, Grid, Model, Rule};

/// So many laws that do as well as the last one are fitted.
const MOST_RIVALS: usize = 3;

/// The model with laws without a name, and all that follows from it.
pub(crate) struct Extended {
    pub point: Point,
    pub after: Vec<PieceResidual>,
    pub corrected: Vec<Corrected>,
    pub covariance: Covariance,
    pub told: Vec<Unnamed>,
    pub gain: UnnamedGain,
    /// The last law and those that do as well; none where it has no such rivals.
    pub contest: Option<Contest>,
    /// The laws as the model has them, in their order.
    effects: Vec<Effect>,
    /// The causes that stay beside them, with their numbers.
    causes: Vec<(EffectId, Parameters)>,
}

/// `before` is what the accepted causes leave. Where none of them stays, the laws are held against the given model.
pub(crate) fn told(
    judged: &Judgement<'_>,
    (accepted, before): (&Point, &[PieceResidual]),
    Kept { laws, point, after, .. }: Kept,
) -> Result<Extended, DiagnosisError> {
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
    // The first of them is the law itself.
    let (as_told, contenders): (Vec<Unnamed>, Vec<Contender>) = rivals(judged, &laws)?.into_iter().unzip();
    if let Some(last) = in_words.last_mut() {
        last.rivals = as_told.into_iter().skip(1).collect();
    }
    Ok(Extended {
        contest: judged.contest(contenders),
        corrected: errors.corrected(),
        covariance: errors.covariance(),
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

/// The last law and those that still do as well beside all that is kept, each as it is told and as an experiment is planned for; none where
/// there is but one.
fn rivals(judged: &Judgement<'_>, laws: &Laws) -> Result<Vec<(Unnamed, Contender)>, DiagnosisError> {
    let fitted = &laws.tried.fitted;
    let Some(place) = fitted.point.hypothesis.members.len().checked_sub(1) else { return Ok(Vec::new()) };
    let (Some(term), false) = (laws.terms.last(), laws.rivals.is_empty()) else { return Ok(Vec::new()) };
    let mut found: Vec<(Unnamed, Contender)> = Vec::new();
    found.extend(as_rival(judged, fitted, (place, term))?);
    for (term, member) in &laws.rivals {
        if judged.setting.is_over() || found.len() > MOST_RIVALS {
            break;
        }
        let mut begin = fitted.point.clone();
        begin.hypothesis.members.last_mut().into_iter().for_each(|last| *last = member.clone());
        let tried = if_possible(Tried::from(&judged.setting, begin, STEPS))?;
        if let Some(tried) = tried.filter(|tried| tried.rms <= laws.tried.rms + NEARLY) {
            found.extend(as_rival(judged, &tried.fitted, (place, term))?);
        }
    }
    Ok(found)
}

fn as_rival(
    judged: &Judgement<'_>,
    fitted: &Fitted,
    (place, term): (usize, &Term),
) -> Result<Option<(Unnamed, Contender)>, DiagnosisError> {
    let Some(Rival { effect, fit, contender }) = alternatives::told(judged, fitted, place)? else {
        return Ok(None);
    };
    let told = words(term, &effect, fit.parameters);
    Ok(told.zip(contender).map(|(told, contender)| {
        let label = label(&told);
        (told, Contender { label, ..contender })
    }))
}

/// A law in a word or two.
fn label(law: &Unnamed) -> String {
    let how = match &law.rule {
        UnnamedRule::Formula { expression } => expression.clone(),
        UnnamedRule::Table { over, .. } => format!("a table over {}", over.join(" and ")),
    };
    format!("{} by {how}", law.acts_on)
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
        kind: kind(term),
        rule,
        parameters,
        rivals: Vec::new(),
    })
}

impl Extended {
    /// What the measurement does beside the laws, in words: where no cause was named for it.
    pub fn nuisances(&self, causes: &[Cause], given: &Model) -> Option<String> {
        let is_named = causes.iter().any(|cause| cause.id == EffectId::SensorDelay);
        let (_, parameters) = self.causes.iter().find(|(id, _)| *id == EffectId::SensorDelay && !is_named)?;
        let late_s = parameters.get("delay_s")?.value;
        let own = given.effects.iter().find(|of| of.id() == EffectId::SensorDelay);
        let own = own.map_or(String::new(), |of| {
            format!("; the model has {:.2} ms of it", 1e3 * of.number("delay_s"))
        });
        Some(format!("beside the laws the torque is {:.2} ms late against the angle{own}", 1e3 * late_s))
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
