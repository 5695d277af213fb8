//! Which runs decide a contest, within a given time.

use super::Contest;
use super::evidence::{Evidence, Pair};
use crate::name::tried::NEARLY;
use crate::workers::{Workers, map};
use log_data::Run;

/// A log Bayes factor that decides: odds of 22,000 to one. Ten in place of the five of "very strong" (Kass and Raftery, J. Am. Stat.
/// Assoc. 90, 1995), since it is expected before anything is measured, and by models that are not quite right.
const DECIDES: f64 = 10.0;

/// A diagnosis takes causes for equal whose held-out RMS differ by no more than [`NEARLY`] of the noise: a log Bayes factor of so much a
/// sample. Twice that is wanted.
const A_SAMPLE: f64 = 2.0 * NEARLY;

/// No experiment has more runs, or fewer where there is time: what is fitted to some of them is judged on the others.
const MOST: usize = 40;
const LEAST: usize = 4;

/// A run that could be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The motion, with pressure and temperature; torque or angle_command say what would be measured.
    pub run: Run,
    /// How long it takes, with the way there, s.
    pub takes_s: f64,
    /// How many samples it would be measured with: the run may have fewer.
    pub samples: f64,
}

/// Runs that were chosen, and what is expected of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Indices of trials, in the order in which they were chosen; one may be there more than once.
    pub chosen: Vec<usize>,
    /// The expected log Bayes factor of each pair, by the places of the contest's labels.
    pub expected: Vec<(usize, usize, f64)>,
    /// The one that is aimed at, so that the next diagnosis sees the difference too.
    pub aim: f64,
}

impl Choice {
    /// The least expected log Bayes factor.
    pub fn worst(&self) -> f64 {
        self.expected.iter().map(|(.., says)| *says).fold(f64::INFINITY, f64::min)
    }

    /// Whether it is worth making: the odds are expected to be clear.
    pub fn decides(&self) -> bool {
        self.worst() >= DECIDES
    }

    fn is_enough(&self) -> bool {
        self.worst() >= self.aim
    }
}

/// A run is taken in the place of one before it if it adds so many times as much: earlier ones ask for less that is new, as oil that is warmed up.
const WORTH: f64 = 1.05;

/// Chooses runs one after the other, each time the one that most raises the worst pair's log Bayes factor for its time, until
/// that is enough or `most_s` is used up. Where few runs are enough, further ones are other motions, in which a model errs otherwise.
pub fn choose(contest: &Contest, trials: &[Trial], most_s: f64, workers: &dyn Workers) -> Choice {
    let each = map(workers, trials.len(), |index| {
        let trial = trials.get(index)?;
        Some(Evidence::of(contest, &trial.run)?.times(trial.samples / trial.run.len().max(1) as f64))
    });
    let mut sum = Evidence::none(contest);
    let mut samples = contest.samples;
    let mut choice = Choice { chosen: Vec::new(), expected: sum.by_pair(contest), aim: aim(samples) };
    let mut left_s = most_s;
    while choice.chosen.len() < if choice.is_enough() { LEAST } else { MOST } {
        let is_enough = choice.is_enough();
        let able = trials.iter().zip(&each).enumerate();
        let able = able.filter(|(index, (trial, _))| {
            trial.takes_s <= left_s && !(is_enough && choice.chosen.contains(index))
        });
        let rated = able.filter_map(|(index, (trial, evidence))| {
            let evidence = evidence.as_ref()?;
            let with = sum.and(evidence);
            let expected = with.by_pair(contest);
            let rate = if is_enough {
                let alone = evidence.by_pair(contest);
                rate(&Evidence::none(contest).by_pair(contest), &alone, (choice.aim, trial.takes_s))
            } else {
                rate(&choice.expected, &expected, (choice.aim, trial.takes_s))
            };
            Some((rate, index, with, expected))
        });
        let best = rated.reduce(|best, of| if of.0 > WORTH * best.0 { of } else { best });
        let Some((rate, index, with, expected)) = best.filter(|best| best.0 > 0.0) else { break };
        debug_assert!(rate.is_finite(), "{rate}");
        if let Some(trial) = trials.get(index) {
            left_s -= trial.takes_s;
            samples += trial.samples;
        }
        choice.aim = aim(samples);
        choice.chosen.push(index);
        (sum, choice.expected) = (with, expected);
    }
    choice
}

/// The log Bayes factor to aim at for a diagnosis of so many samples.
fn aim(samples: f64) -> f64 {
    DECIDES.max(A_SAMPLE * samples)
}

/// What a run adds in a second: to the worst pair above all, and a little for every other that isn't decided yet, since no single
/// run may raise the worst.
fn rate(before: &[Pair], after: &[Pair], (aim, takes_s): (f64, f64)) -> f64 {
    let capped = |says: f64| says.min(aim);
    let worst = |of: &[Pair]| of.iter().map(|(.., says)| capped(*says)).fold(aim, f64::min);
    let sum = |of: &[Pair]| of.iter().map(|(.., says)| capped(*says)).sum::<f64>();
    let gain = worst(after) - worst(before) + 0.1 * (sum(after) - sum(before)) / after.len().max(1) as f64;
    gain / takes_s
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests {
    use super::*;
    use crate::contest::Contender;
    use crate::extend::catalogue::candidate;
    use crate::extend::hypothesis::{Hypothesis, Member};
    use crate::fixtures;
    use crate::log::facts::Facts;
    use crate::log::kind::LogKind;
    use crate::workers::OneAfterTheOther;
    use log_data::Channel;
    use nalgebra::DMatrix;
    use valve_model::EffectId;

    const AT_PA: f64 = 5e6;

    /// Ten percent more friction, by its level or at 5 MPa; both known within a percent.
    fn contest() -> Contest {
        let given = fixtures::model(Vec::new());
        let mut facts = Facts::of_model(&given, LogKind::predicting(Channel::Torque));
        facts.pressure_mpa = Some((5.0, 5.0));
        let contender = |id: EffectId, place: usize, value: f64| {
            let candidate = candidate(id, &facts).unwrap();
            let mut numbers = candidate.neutral();
            numbers[place] = value;
            let member = Member::new(&candidate, numbers, vec![place]);
            let hypothesis = Hypothesis { members: vec![member], ..Hypothesis::default() };
            Contender {
                label: id.name().to_owned(),
                hypothesis,
                covariance: DMatrix::from_element(1, 1, (0.01 * value).powi(2)),
            }
        };
        let pressed = candidate(EffectId::PressureDependentFriction, &facts).unwrap();
        let gain = pressed.parameters.iter().position(|of| of.key.as_str() == "gain").unwrap();
        let both = vec![
            contender(EffectId::CoulombLevel, 0, 1.1),
            contender(EffectId::PressureDependentFriction, gain, 0.1 / 5.0),
        ];
        Contest::new(&given, both, (0.05, 0.0), (0.0, 500.0)).unwrap()
    }

    fn trial(pressure_pa: f64, takes_s: f64) -> Trial {
        let time_s: Vec<f64> = (0..500).map(|row| 2e-3 * f64::from(row)).collect();
        let run = Run {
            angle_rad: time_s.iter().map(|time_s| 0.5 * time_s).collect(),
            torque_nm: Some(vec![0.0; 500]),
            pressure_drop_pa: Some(vec![pressure_pa; 500]),
            time_s,
            ..Run::default()
        };
        Trial { run, takes_s, samples: 500.0 }
    }

    #[test]
    fn another_pressure_is_chosen_and_the_same_one_is_not() {
        let trials = [trial(AT_PA, 1.0), trial(0.0, 5.0), trial(0.0, 2.0)];
        let choice = choose(&contest(), &trials, 100.0, &OneAfterTheOther);
        assert!(choice.decides(), "{:?}", choice.expected);
        assert_eq!(choice.chosen[0], 2, "{:?}", choice.chosen);
    }

    #[test]
    fn what_numbers_can_take_up_decides_nothing() {
        let choice = choose(&contest(), &[trial(AT_PA, 1.0)], 100.0, &OneAfterTheOther);
        assert!(!choice.decides() && choice.worst() < 1.0, "{:?}", choice.expected);
        let finer = choose(&contest().with_noise(0.01), &[trial(AT_PA, 1.0)], 100.0, &OneAfterTheOther);
        assert!(!finer.decides(), "{:?}", finer.expected);
    }

    #[test]
    fn no_run_is_longer_than_the_time_that_there_is() {
        let choice = choose(&contest(), &[trial(0.0, 5.0)], 4.0, &OneAfterTheOther);
        assert!(choice.chosen.is_empty() && !choice.decides());
        let few = choose(&contest(), &[trial(0.0, 5.0), trial(0.0, 4.0)], 9.0, &OneAfterTheOther);
        assert!(few.chosen.len() <= 2);
    }

    #[test]
    fn more_samples_and_less_noise_say_more() {
        let says = |contest: &Contest, samples: f64| {
            let trial = Trial { samples, ..trial(0.0, 1.0) };
            let evidence = Evidence::of(contest, &trial.run).unwrap().times(samples / 500.0);
            evidence.by_pair(contest)[0].2
        };
        let contest = contest();
        assert!(says(&contest, 1000.0) > says(&contest, 500.0));
        assert!(says(&contest.with_noise(0.1), 500.0) > says(&contest, 500.0));
    }
}
