//! The sensitivity to a number of a law without simulating the law: what it says at each sample, times what friction's level or its viscous part does there.
//!
//! Hundreds of laws are screened. While the spool slides this is exact; within the bristles' reach a level that changes is followed late,
//! which a fit of the law then has.

use crate::extend::candidate::Candidate;
use crate::log::moments::covariates;
use crate::log::piece::Piece;
use valve_model::{ActsOn, Covariate, Effect, EffectId, Model};

/// A law with two sets of numbers.
pub(crate) struct LawColumn {
    /// None where it says nothing: every amplitude is none.
    base: Option<Effect>,
    moved: Effect,
    /// How far the number is moved.
    step: f64,
    /// The place of the kept sensitivity that the law is a factor on; none of a torque.
    pub on: Option<usize>,
}

impl LawColumn {
    /// The column of one of a law's `numbers`, moved by `step`. `None` of what is no law, of one that goes by the time at rest (it acts while the
    /// spool breaks away), and where the sensitivity that it is a factor on is not `kept`, which tells its place.
    pub fn of(
        given: &Model,
        candidate: &Candidate,
        (numbers, number, step): (&[f64], usize, f64),
        kept: impl Fn(EffectId) -> Option<usize>,
    ) -> Option<Self> {
        let mut moved = numbers.to_vec();
        *moved.get_mut(number)? += step;
        let base = candidate.effect(given, numbers).ok()?;
        let acts_on = base.custom()?.acts_on;
        if base.depends_on(Covariate::TimeAtRest) {
            return None;
        }
        let on = match acts_on {
            ActsOn::Torque => None,
            ActsOn::Level => Some(kept(EffectId::CoulombLevel)?),
            ActsOn::Viscous => Some(kept(EffectId::ViscousLevel)?),
        };
        let moved = candidate.effect(given, &moved).ok()?;
        let mut amplitudes = candidate.own.as_ref()?.amplitudes().iter();
        let is_none = amplitudes.all(|index| numbers.get(*index) == Some(&0.0));
        Some(Self { base: Some(base).filter(|_| !is_none), moved, step, on })
    }

    /// The change of the law for each unit of its number, at each sample.
    pub fn values(&self, piece: &Piece) -> Vec<f64> {
        let values = |law: &Effect| law.custom_values(covariates(piece)).unwrap_or_default();
        let mut changes = values(&self.moved);
        if let Some(base) = &self.base {
            changes.iter_mut().zip(values(base)).for_each(|(change, base)| *change -= base);
        }
        changes.iter_mut().for_each(|change| *change /= self.step);
        changes
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::extend::hypothesis::{Correction, Hypothesis};
    use crate::extend::suspected::candidate_of;
    use crate::extend::tolerance::corrections;
    use crate::fit::equations::{Nuisances, Point, Setting};
    use crate::fit::gauss_newton::fit;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::name::screen::screen;
    use crate::suspect::{Suspect, SuspectParameter};
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use prediction::{Past, predict};
    use valve_model::{CustomLaw, Label, Rule};

    fn law(acts_on: ActsOn, text: &str, a: f64) -> Effect {
        Effect::custom_named("law", CustomLaw { acts_on, rule: Rule::Formula(text.to_owned()) }, &[("a", a)])
            .unwrap()
    }

    /// Turns of several speeds, with a valve that has a law which the model does not.
    fn turns(law: &Effect) -> Log {
        let rig = fixtures::model(vec![law.clone()]);
        let run = |number: u32| {
            let wave = 2.0 + f64::from(number);
            let time_s: Vec<f64> = (0..1500).map(|k| 5.0 * f64::from(number) + 2e-3 * f64::from(k)).collect();
            let angle_rad = time_s.iter().map(|at_s| 1.5 * (wave * at_s).sin()).collect();
            let torque_nm = Some(vec![0.0; time_s.len()]);
            let mut run = Run { name: number.to_string(), time_s, angle_rad, torque_nm, ..Run::default() };
            predict(&mut run, &rig, &Past::default()).unwrap();
            run
        };
        Log { runs: (0..6).map(run).collect(), ..Log::default() }
    }

    #[test]
    fn a_screening_without_simulations_expects_what_one_with_them_does() {
        for (acts_on, text, a) in [
            (ActsOn::Torque, "a*speed*abs(speed)", 2e-3),
            (ActsOn::Level, "a*abs(speed)*cos(angle)", 0.02),
            (ActsOn::Viscous, "a*cos(2*angle)", 0.5),
        ] {
            let given = fixtures::model(Vec::new());
            let campaign =
                Campaign::new(&turns(&law(acts_on, text, a)), &given, 0, &OneAfterTheOther).unwrap();
            let setting = Setting::new(&campaign, &given, Nuisances::default(), &OneAfterTheOther);
            let amplitude = SuspectParameter::unknown(Label::new("a").unwrap());
            let suspect = Suspect::new(law(acts_on, text, 1.0), vec![amplitude]).unwrap();
            let candidate = candidate_of(&suspect, &campaign.facts);
            let levels = [EffectId::CoulombLevel, EffectId::ViscousLevel];
            let able: Vec<Candidate> = levels
                .iter()
                .filter_map(|id| crate::extend::catalogue::candidate(*id, &campaign.facts))
                .collect();
            let held = |of: Correction| Correction { free: false, ..of };
            let corrections = corrections(&campaign.facts, &able, 0.03).into_iter().map(held).collect();
            let hypothesis = Hypothesis { corrections, ..Hypothesis::default() };
            let point = Point { hypothesis, starts: Vec::new() };
            let kept = setting.sensitivities(&point).unwrap();
            let quick = Setting { kept: kept.as_ref(), ..setting };
            let fitted = fit(&setting, point, &Piece::is_fitted, 0).unwrap();
            let found = |setting: &Setting<'_>| {
                let mut ranked = screen(setting, std::slice::from_ref(&candidate), &fitted).unwrap().ranked;
                let first = ranked.remove(0);
                (first.gain, first.member.numbers[0])
            };
            let place = |id: EffectId| quick.kept?.place(id);
            assert!(LawColumn::of(&given, &candidate, (&[0.0], 0, 1e-3), place).is_some());
            let (expected, number) = found(&quick);
            let simulated = Setting { kept: None, ..setting };
            let (by_simulation, other) = found(&simulated);
            assert!((number - a).abs() < 0.05 * a, "{text}: {number}, it is {a}; simulated {other}");
            assert!(
                (expected - by_simulation).abs() < 0.02 * by_simulation,
                "{text}: {expected} {by_simulation}"
            );
        }
    }
}
