//! Blind tests of the diagnosis: what every family is asked, and how findings are counted.

use hidden_effect_rig::{Hidden, LogKind, Outcome, STRONG, choose, effects_of};

/// How many findings have an outcome.
pub fn count(outcomes: &[Outcome], wanted: Outcome) -> usize {
    outcomes.iter().filter(|outcome| **outcome == wanted).count()
}

/// One strong effect each, from `seed` on: seven torque logs and three angle logs.
pub fn ten_strong_effects(seed: u64, found: impl Fn(u64, &Hidden) -> Outcome) -> Vec<Outcome> {
    (0..10)
        .map(|k| {
            let log = if k < 7 { LogKind::Torque } else { LogKind::Angle };
            let effect = choose(seed + k, &effects_of(log));
            found(seed + k, &Hidden::with(log, &[effect], STRONG))
        })
        .collect()
}

/// Nothing hidden, from `seed` on: three torque logs to each angle log.
pub fn nothing_hidden(how_many: usize, seed: u64, found: impl Fn(u64, &Hidden) -> Outcome) -> Vec<Outcome> {
    let logs = [LogKind::Torque, LogKind::Torque, LogKind::Torque, LogKind::Angle];
    logs.iter()
        .cycle()
        .take(how_many)
        .zip(seed..)
        .map(|(log, seed)| found(seed, &Hidden::none(*log)))
        .collect()
}
