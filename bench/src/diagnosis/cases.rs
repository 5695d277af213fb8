//! Which campaigns are drawn: a seed each, and what is hidden.

use super::{Arguments, Family, Log};
use hidden_effect_rig::{
    Family as RigFamily, Hidden, LogKind, OUTSIDE, STRONG, WEAK, choose, effects_of, twins,
};
use own_recordings::CHANGES;
use serde::{Deserialize, Serialize};

/// What a campaign is there to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum, Serialize, Deserialize)]
pub enum Class {
    /// Nothing hidden.
    Clean,
    /// One effect, residual 5 times the noise.
    Strong,
    /// One effect, 2 times.
    Weak,
    /// Two effects.
    Two,
    /// An effect that no list of causes has.
    Outside,
    /// One of two that these data can't tell apart.
    Twin,
    /// One that an own recording can't show: it is drawn as a strong one, and found to be one of these.
    #[value(skip)]
    Unseen,
}

/// A campaign to draw.
#[derive(Debug, Clone)]
pub struct Case {
    /// What the measurements are like.
    pub family: Family,
    /// Its seed.
    pub seed: u64,
    /// What it shows.
    pub class: Class,
    /// What is hidden.
    pub hidden: Hidden,
    /// Whether the parameters are compared with the best fit to noise-free data.
    pub best_fit: bool,
}

impl Case {
    /// What tells it from all others.
    pub fn key(&self) -> String {
        let Hidden { log, effects, without, samples, .. } = &self.hidden;
        let class = self.class;
        format!("{:?} {class:?} {log:?} {effects:?} {without:?} {samples} seed {}", self.family, self.seed)
    }
}

/// All cases, seeds counted up from the first, each family's from the same.
pub fn all(arguments: &Arguments) -> Vec<Case> {
    let mut cases: Vec<Case> =
        arguments.family.members().iter().flat_map(|family| of_family(arguments, *family)).collect();
    let wanted = |case: &Case| {
        let class = arguments.class.is_empty() || arguments.class.contains(&case.class);
        class
            && (arguments.only.is_empty() || arguments.only.iter().any(|id| case.hidden.effects.contains(id)))
    };
    cases.retain(wanted);
    // Mixed, so that a campaign of campaigns that is cut short has some of everything.
    cases.sort_by_key(|case| case.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    cases
}

/// The product's own recordings: with the truth as believed, and with each change of it.
fn own(arguments: &Arguments) -> Vec<Case> {
    let clean = (0..arguments.clean).map(|_| (Class::Clean, Hidden::none(LogKind::Angle)));
    let changed = (0..arguments.seeds)
        .flat_map(|_| CHANGES)
        .map(|id| (Class::Strong, Hidden::with(LogKind::Angle, &[id.name()], STRONG)));
    let case = |(seed, (class, hidden))| Case { family: Family::Own, seed, class, hidden, best_fit: false };
    (arguments.first_seed..).zip(clean.chain(changed)).map(case).collect()
}

fn of_family(arguments: &Arguments, family: Family) -> Vec<Case> {
    if family == Family::Own {
        return own(arguments);
    }
    let rig = if family == Family::Real { RigFamily::Real } else { RigFamily::Exact };
    let mut cases = Vec::new();
    let mut seed = arguments.first_seed;
    let mut add = |class: Class, hidden: Hidden| {
        let hidden = Hidden { family: rig, samples: arguments.samples, ..hidden };
        cases.push(Case { family, seed, class, hidden, best_fit: arguments.best_fit });
        seed += 1;
    };
    let logs: &[LogKind] = match arguments.log {
        Some(Log::Torque) => &[LogKind::Torque],
        Some(Log::Angle) => &[LogKind::Angle],
        None => &[LogKind::Torque, LogKind::Angle],
    };
    for &log in logs {
        for _ in 0..arguments.clean / logs.len() as u64 {
            add(Class::Clean, Hidden::none(log));
        }
        let effects = effects_of(log);
        for turn in 0..arguments.seeds {
            for effect in &effects {
                add(Class::Strong, Hidden::with(log, &[effect], STRONG));
                add(Class::Weak, Hidden::with(log, &[effect], WEAK));
            }
            for index in 0..effects.len() as u64 / 2 {
                let pair = pair(log, arguments.first_seed + turn * 1000 + index);
                add(Class::Two, Hidden::with(log, &pair, STRONG));
            }
            for effect in OUTSIDE.iter().filter(|id| log == LogKind::Torque || **id != "outside-play") {
                add(Class::Outside, Hidden::with(log, &[effect], STRONG));
            }
            // In the real family what can't be told apart is computed for every campaign.
            for (effect, _, gap) in twins(log).into_iter().filter(|_| rig == RigFamily::Exact) {
                add(Class::Twin, Hidden { without: Some(gap), ..Hidden::with(log, &[effect], STRONG) });
            }
        }
    }
    cases
}

/// Two effects that are no twins of each other.
fn pair(log: LogKind, seed: u64) -> Vec<&'static str> {
    let effects = effects_of(log);
    let close = |a: &str, b: &str| {
        a == b
            || twins(log)
                .iter()
                .any(|(id, others, _)| (*id == a && others.contains(&b)) || (*id == b && others.contains(&a)))
    };
    let mut turn = seed.wrapping_mul(64);
    loop {
        let (a, b) = (choose(turn, &effects), choose(turn + 1, &effects));
        if !close(a, b) {
            return vec![a, b];
        }
        turn += 2;
    }
}
