//! A hypothesis: the given model with candidate causes, and the parameters that a fit varies.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::extend::candidate::Candidate;
use crate::numerics::gram::Gram;
use valve_model::{Effect, EffectId, EffectValue, Model, ParamError};

/// A cause with the values of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Member {
    pub candidate: Candidate,
    pub numbers: Vec<f64>,
    /// Indices of the free numbers.
    pub free: Vec<usize>,
    /// Factor on the finite-difference step of each number.
    pub finer: Vec<f64>,
}

impl Member {
    pub fn new(candidate: &Candidate, numbers: Vec<f64>, free: Vec<usize>) -> Self {
        let finer = vec![1.0; numbers.len()];
        Self { candidate: candidate.clone(), numbers, free, finer }
    }

    /// The numbers that are not free but could be, in groups that are freed together (cosine and sine of a harmonic).
    pub fn left_out(&self) -> Vec<Vec<usize>> {
        let out = |number: &usize| !self.free.contains(number);
        if self.candidate.series {
            let looked_for = self.candidate.probes.iter();
            let orders =
                looked_for.map(|probe| probe.columns.iter().map(|(number, _)| *number).collect::<Vec<_>>());
            return orders.filter(|pair| pair.iter().all(out)).collect();
        }
        let any = self.candidate.free.iter().chain(&self.candidate.optional).copied();
        any.filter(out).map(|number| vec![number]).collect()
    }
}

/// The correction of a parameter of the given model within its tolerance; it is no cause.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Correction {
    /// The effect that applies it: a factor or an offset.
    pub id: EffectId,
    pub key: &'static str,
    pub neutral: f64,
    pub value: f64,
    /// Its prior standard deviation, which follows from the tolerance.
    pub deviation: f64,
    /// Whether the fit varies it.
    pub free: bool,
    /// Factor on its finite-difference step.
    pub finer: f64,
}

impl Correction {
    /// Largest correction, in standard deviations; beyond it the parameter is wrong, which is a cause.
    pub(crate) const MOST: f64 = 2.0;
    /// Finite-difference step of its sensitivity, in standard deviations.
    const STEP: f64 = 0.5;

    /// Whether a value is within the bounds of the correction.
    pub fn holds(&self, value: f64) -> bool {
        (value - self.neutral).abs() <= Self::MOST * self.deviation
    }

    /// How far a value is beyond the nearer bound, with its sign; 0 within them.
    pub fn beyond(&self, value: f64) -> f64 {
        let (off, most) = (value - self.neutral, Self::MOST * self.deviation);
        off - off.clamp(-most, most)
    }

    /// Whether the correction is at one of its bounds.
    pub fn is_at_bound(&self) -> bool {
        (self.value - self.neutral).abs() >= 0.999 * Self::MOST * self.deviation
    }

    fn set(&mut self, value: f64) {
        let most = Self::MOST * self.deviation;
        self.value = value.clamp(self.neutral - most, self.neutral + most);
    }

    /// Applies the correction to the model, on top of the model's own effect of this kind if there is one.
    fn apply(&self, model: &mut Model) -> Result<(), ParamError> {
        if self.value == self.neutral {
            return Ok(());
        }
        let present = model.effects.iter().position(|effect| effect.id() == self.id);
        let own = present.and_then(|place| model.effects.get(place)).map(|effect| effect.number(self.key));
        let value = match own {
            Some(own) if self.neutral == 1.0 => own * self.value,
            Some(own) => own + self.value,
            None => self.value,
        };
        let effect = Effect::new(self.id, &[(self.key, EffectValue::Number(value))])?;
        match present.and_then(|place| model.effects.get_mut(place)) {
            Some(slot) => *slot = effect,
            None => model.effects.push(effect),
        }
        Ok(())
    }
}

/// The model's causes and corrections, and the angle's zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Hypothesis {
    pub members: Vec<Member>,
    /// Corrections of the model's parameters.
    pub corrections: Vec<Correction>,
    /// Offset of the encoder's zero, rad; for angle logs whose runs share a zero.
    pub zero_rad: Option<f64>,
}

/// A number that the fit varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Free {
    Zero,
    /// A correction, by its place.
    Correction(usize),
    /// Member and number.
    Number(usize, usize),
}

impl Free {
    /// The index of the cause whose number it is.
    pub fn member(self) -> Option<usize> {
        match self {
            Self::Number(member, _) => Some(member),
            Self::Zero | Self::Correction(_) => None,
        }
    }
}

impl Hypothesis {
    /// The given model with the effects of the members; an effect that it has already is replaced. Then the corrections.
    pub fn model(&self, given: &Model) -> Result<Model, ParamError> {
        let mut model = given.clone();
        for member in &self.members {
            let effect = member.candidate.effect(given, &member.numbers)?;
            match model.effects.iter_mut().find(|present| present.id() == effect.id()) {
                Some(present) => *present = effect,
                None => model.effects.push(effect),
            }
        }
        self.corrections.iter().try_for_each(|correction| correction.apply(&mut model))?;
        Ok(model)
    }

    pub fn with(&self, member: Member) -> Self {
        let mut more = self.clone();
        more.members.push(member);
        more.with_usual_changes()
    }

    /// The same with one more cause. A parameter of the model goes on from its correction, in the place of that.
    pub fn with_cause(&self, mut member: Member) -> Self {
        let id = member.candidate.id;
        let own = self.corrections.iter().find(|of| of.id == id);
        if let Some((own, (number, of))) =
            own.zip(member.numbers.first_mut().zip(member.candidate.parameters.first()))
        {
            *number = (*number + own.value - own.neutral).clamp(of.lower, of.upper);
        }
        self.with_uncorrected(member)
    }

    /// The same with a cause more. Its own correction goes, if it is a parameter of the model: both would say the same.
    pub fn with_uncorrected(&self, member: Member) -> Self {
        let id = member.candidate.id;
        self.with_corrections_of(|other| other != id).with(member)
    }

    /// The given model, with no cause.
    pub fn without_causes(&self) -> Self {
        Self { members: Vec::new(), ..self.clone() }
    }

    pub fn without(&self, index: usize) -> Self {
        let mut less = self.clone();
        if index < less.members.len() {
            less.members.remove(index);
        }
        less.with_usual_changes()
    }

    /// Resets the finite-difference steps: with other members the optimum may be far.
    fn with_usual_changes(mut self) -> Self {
        self.members.iter_mut().for_each(|member| member.finer.fill(1.0));
        self
    }

    /// The same with only those corrections that `kept` selects.
    pub fn with_corrections_of(&self, kept: impl Fn(EffectId) -> bool) -> Self {
        let mut hypothesis = self.clone();
        hypothesis.corrections.retain(|of| kept(of.id));
        hypothesis
    }

    /// The prior of the free corrections as a group of equations without samples; its columns are the first `columns` free numbers.
    pub fn prior(&self, columns: usize) -> Gram {
        let mut prior = Gram::zero(columns);
        let last = columns;
        for (place, free) in self.free().into_iter().enumerate() {
            let Free::Correction(index) = free else { continue };
            let Some(of) = self.corrections.get(index) else { continue };
            let (known, off) = (1.0 / of.deviation, (of.neutral - of.value) / of.deviation);
            prior.matrix[(last, last)] += off * off;
            if place < columns {
                prior.matrix[(place, place)] += known * known;
                prior.matrix[(place, last)] += known * off;
                prior.matrix[(last, place)] += known * off;
            }
        }
        prior
    }

    /// The prior standard deviation of a number; `None` if it has none.
    pub fn tolerance(&self, free: Free) -> Option<f64> {
        let Free::Correction(index) = free else { return None };
        self.corrections.get(index).map(|of| of.deviation)
    }

    /// The same with these corrections held at their neutral value; the others stay as they are.
    pub fn with_corrections_held(&self, held: &[usize]) -> Self {
        let mut hypothesis = self.clone();
        for index in held {
            let Some(of) = hypothesis.corrections.get_mut(*index) else { continue };
            (of.free, of.value) = (false, of.neutral);
        }
        hypothesis
    }

    /// The same with every correction free.
    pub fn with_corrections_free(&self) -> Self {
        let mut hypothesis = self.clone();
        hypothesis.corrections.iter_mut().for_each(|of| of.free = true);
        hypothesis
    }

    pub fn has(&self, id: EffectId) -> bool {
        self.members.iter().any(|member| member.candidate.id == id)
    }

    /// Indices of the delays that are negative.
    pub fn leads(&self) -> impl Iterator<Item = usize> {
        let leads = self.members.iter().enumerate().filter(|(_, member)| {
            member.candidate.id == EffectId::SensorDelay
                && member.numbers.first().is_some_and(|delay| *delay < 0.0)
        });
        leads.map(|(index, _)| index)
    }

    pub fn has_lead(&self) -> bool {
        self.leads().next().is_some()
    }

    /// All free numbers, in order.
    pub fn free(&self) -> Vec<Free> {
        let zero = self.zero_rad.map(|_| Free::Zero);
        let numbers = self
            .members
            .iter()
            .enumerate()
            .flat_map(|(member, of)| of.free.iter().map(move |number| Free::Number(member, *number)));
        let corrections = self.corrections.iter().enumerate().filter(|(_, of)| of.free);
        let corrections = corrections.map(|(index, _)| Free::Correction(index));
        zero.into_iter().chain(corrections).chain(numbers).collect()
    }

    /// The place of a number among what is free.
    pub fn place_of(&self, free: Free) -> Option<usize> {
        self.free().into_iter().position(|of| of == free)
    }

    pub fn get(&self, free: Free) -> f64 {
        match free {
            Free::Zero => self.zero_rad.unwrap_or(0.0),
            Free::Correction(index) => self.corrections.get(index).map_or(0.0, |of| of.value),
            Free::Number(member, number) => {
                self.members.get(member).and_then(|of| of.numbers.get(number)).copied().unwrap_or(0.0)
            }
        }
    }

    /// Whether a number is at one of its bounds.
    pub fn is_at_bound(&self, free: Free) -> bool {
        self.outward(free).is_some()
    }

    /// The sign of the changes that would leave a number's range; `None` of one that is not at a bound.
    pub fn outward(&self, free: Free) -> Option<f64> {
        match free {
            Free::Zero => None,
            Free::Correction(index) => {
                let of = self.corrections.get(index).filter(|of| of.is_at_bound())?;
                Some((of.value - of.neutral).signum())
            }
            Free::Number(member, number) => {
                let of = self.members.get(member)?.candidate.parameters.get(number)?;
                let value = self.get(free);
                let beyond = if value >= of.upper { Some(1.0) } else { None };
                if value <= of.lower { Some(-1.0) } else { beyond }
            }
        }
    }

    /// The effect that a number belongs to.
    pub fn id_of(&self, free: Free) -> Option<EffectId> {
        match free {
            Free::Zero => None,
            Free::Correction(index) => self.corrections.get(index).map(|of| of.id),
            Free::Number(member, _) => self.members.get(member).map(|of| of.candidate.id),
        }
    }

    /// Sets a number, within its bounds.
    pub fn set(&mut self, free: Free, value: f64) {
        match free {
            Free::Zero => self.zero_rad = Some(value),
            Free::Correction(index) => {
                self.corrections.get_mut(index).into_iter().for_each(|of| of.set(value));
            }
            Free::Number(member, number) => {
                let Some(of) = self.members.get_mut(member) else { return };
                let Some(parameter) = of.candidate.parameters.get(number) else { return };
                if let Some(place) = of.numbers.get_mut(number) {
                    *place = value.clamp(parameter.lower, parameter.upper);
                }
            }
        }
    }

    /// The finite-difference step of a number, with the sign that keeps it within the bounds.
    pub fn step(&self, free: Free) -> f64 {
        if let Free::Correction(index) = free {
            let Some(of) = self.corrections.get(index) else { return 1e-5 };
            let size = of.finer * Correction::STEP * of.deviation;
            return if of.value > of.neutral { -size } else { size };
        }
        let Free::Number(member, number) = free else { return 1e-5 };
        let Some(parameter) = self.members.get(member).and_then(|of| of.candidate.parameters.get(number))
        else {
            return 1e-5;
        };
        let at = self.get(free);
        let finer = self.members.get(member).and_then(|of| of.finer.get(number)).copied().unwrap_or(1.0);
        let size = finer * parameter.step.max(0.02 * (at - parameter.neutral).abs());
        if at + size > parameter.upper { -size } else { size }
    }

    /// The part of a change that a number's bounds allow.
    pub fn allowed(&self, free: Free, change: f64) -> f64 {
        let mut there = self.clone();
        there.set(free, self.get(free) + change);
        there.get(free) - self.get(free)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use log_data::Run;
    use prediction::{Past, predict};

    fn correction(id: EffectId, value: f64) -> Correction {
        Correction { id, key: "factor", neutral: 1.0, value, deviation: 0.03, free: true, finer: 1.0 }
    }

    #[test]
    fn a_scale_of_the_torque_predicts_what_all_levels_do_together() {
        let given = fixtures::model(Vec::new());
        let levels = [
            EffectId::CoulombLevel,
            EffectId::ViscousLevel,
            EffectId::BristleStiffness,
            EffectId::BristleDamping,
            EffectId::LoadInertia,
        ];
        let of = |ids: &[EffectId]| Hypothesis {
            corrections: ids.iter().map(|id| correction(*id, 1.04)).collect(),
            ..Hypothesis::default()
        };
        let torque = |of: &Hypothesis| {
            let time_s: Vec<f64> = (0..3000).map(|row| 1e-3 * f64::from(row)).collect();
            let angle_rad = time_s.iter().map(|time_s| 0.6 * (5.0 * time_s).sin()).collect();
            let torque_nm = Some(vec![0.0; time_s.len()]);
            let mut run = Run { time_s, angle_rad, torque_nm, ..Run::default() };
            predict(&mut run, &of.model(&given).unwrap(), &Past::default()).unwrap();
            run.torque_nm.unwrap()
        };
        let (scaled, levels) = (torque(&of(&[EffectId::TorqueGain])), torque(&of(&levels)));
        let off = scaled.iter().zip(&levels).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{off}");
    }

    #[test]
    fn a_number_at_its_bound_goes_no_further() {
        let hypothesis = |value| Hypothesis {
            corrections: vec![correction(EffectId::CoulombLevel, value)],
            ..Hypothesis::default()
        };
        for (value, is_at_bound) in [(1.0, false), (1.05, false), (1.06, true), (0.94, true)] {
            let outward = hypothesis(value).outward(Free::Correction(0));
            assert_eq!(outward, is_at_bound.then(|| f64::signum(value - 1.0)), "{value}");
        }
        assert_eq!(hypothesis(1.06).allowed(Free::Correction(0), 0.01), 0.0);
    }
}
