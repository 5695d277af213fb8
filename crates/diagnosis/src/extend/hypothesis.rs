//! A hypothesis: the given model with candidate causes, and the numbers that a fit moves.

use crate::extend::candidate::Candidate;
use valve_model::{EffectId, Model, ParamError};

/// A cause with its numbers.
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
            let orders = (0..self.numbers.len() / 2).map(|order| vec![2 * order, 2 * order + 1]);
            return orders.filter(|pair| pair.iter().all(out)).collect();
        }
        let any = self.candidate.free.iter().chain(&self.candidate.optional).copied();
        any.filter(out).map(|number| vec![number]).collect()
    }
}

/// The model, causes, and the angle's zero.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hypothesis {
    pub members: Vec<Member>,
    /// Offset of the encoder's zero, rad; for angle logs whose runs share a zero.
    pub zero_rad: Option<f64>,
}

/// A number that the fit moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Free {
    Zero,
    /// Member and number.
    Number(usize, usize),
}

impl Hypothesis {
    /// The model with the members' effects: an effect that it has already is replaced.
    pub fn model(&self, given: &Model) -> Result<Model, ParamError> {
        let mut model = given.clone();
        for member in &self.members {
            let effect = member.candidate.effect(given, &member.numbers)?;
            match model.effects.iter_mut().find(|present| present.id() == effect.id()) {
                Some(present) => *present = effect,
                None => model.effects.push(effect),
            }
        }
        Ok(model)
    }

    pub fn with(&self, member: Member) -> Self {
        let mut more = self.clone();
        more.members.push(member);
        more.with_usual_changes()
    }

    /// The given model, with no cause.
    pub fn without_causes(&self) -> Self {
        Self { members: Vec::new(), zero_rad: self.zero_rad }
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

    pub fn has(&self, id: EffectId) -> bool {
        self.members.iter().any(|member| member.candidate.id == id)
    }

    /// All free numbers, in order.
    pub fn free(&self) -> Vec<Free> {
        let zero = self.zero_rad.map(|_| Free::Zero);
        let numbers = self
            .members
            .iter()
            .enumerate()
            .flat_map(|(member, of)| of.free.iter().map(move |number| Free::Number(member, *number)));
        zero.into_iter().chain(numbers).collect()
    }

    pub fn get(&self, free: Free) -> f64 {
        match free {
            Free::Zero => self.zero_rad.unwrap_or(0.0),
            Free::Number(member, number) => {
                self.members.get(member).and_then(|of| of.numbers.get(number)).copied().unwrap_or(0.0)
            }
        }
    }

    /// Sets a number, within its bounds.
    pub fn set(&mut self, free: Free, value: f64) {
        match free {
            Free::Zero => self.zero_rad = Some(value),
            Free::Number(member, number) => {
                let Some(of) = self.members.get_mut(member) else { return };
                let Some(parameter) = of.candidate.parameters.get(number) else { return };
                if let Some(place) = of.numbers.get_mut(number) {
                    *place = value.clamp(parameter.lower, parameter.upper);
                }
            }
        }
    }

    /// The finite-difference step of a number, away from its upper bound.
    pub fn step(&self, free: Free) -> f64 {
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

    /// True if a number is at a bound.
    pub fn on_bound(&self, free: Free) -> bool {
        let Free::Number(member, number) = free else { return false };
        let parameter = self.members.get(member).and_then(|of| of.candidate.parameters.get(number));
        parameter.is_some_and(|parameter| {
            let at = self.get(free);
            at <= parameter.lower || at >= parameter.upper
        })
    }
}
