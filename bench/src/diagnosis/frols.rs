//! What forward regression with orthogonal least squares makes of the same data: term by term the one that explains most of
//! what is left, while the Bayesian criterion on an effective sample size pays for it (Billings, Nonlinear System Identification,
//! 3.2). A cause is named where a term of its own was chosen that reduces the error by half a per cent or more.

use super::library::CAUSES;
use super::normal::{ALIKE, Normal};
use std::collections::BTreeSet;
use valve_model::EffectId;

/// Most terms.
const MOST: usize = 12;
/// The least error reduction ratio of a term that names its cause.
const NAMES: f64 = 0.005;

/// The causes that it names.
pub fn named(all: &Normal) -> BTreeSet<String> {
    let owners: Vec<EffectId> =
        CAUSES.iter().flat_map(|(id, terms)| std::iter::repeat_n(*id, *terms)).collect();
    let samples = all.count / ALIKE;
    // The Gram matrix and right side, from which every chosen term is projected out in turn.
    let (mut gram, mut right, mut square) = (all.gram.clone(), all.right.clone(), all.square);
    let initial: Vec<f64> = gram.diagonal().iter().copied().collect();
    let mut named = BTreeSet::new();
    for _ in 0..MOST {
        let explains = |term: usize| {
            let own = *gram.get((term, term))?;
            // What is nearly a sum of chosen terms has lost its digits.
            (own > 1e-8 * initial.get(term)?).then(|| right.get(term).map(|value| value * value / own))?
        };
        let trials = (0..owners.len()).filter_map(|term| explains(term).map(|gain| (term, gain)));
        let Some((best, gain)) = trials.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if samples * (square / (square - gain).max(f64::MIN_POSITIVE)).ln() <= samples.ln() {
            break;
        }
        if let Some(owner) = owners.get(best).filter(|_| gain > NAMES * all.square) {
            named.insert(owner.name().to_owned());
        }
        square -= gain;
        let column = gram.column(best).clone_owned();
        let own = column.get(best).copied().unwrap_or(1.0);
        let value = right.get(best).copied().unwrap_or(0.0);
        gram -= &column * column.transpose() / own;
        right -= &column * (value / own);
    }
    named
}
