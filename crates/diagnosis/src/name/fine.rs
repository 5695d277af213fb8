//! Final fit of an angle log with small finite-difference steps, as small as the numbers' own uncertainty.
//!
//! If a parameter changes by some per cent, a stick-slip rotor slips at other moments, and a difference over such a step is a
//! poor slope. Far from the optimum there is no better one; near it the fit would stop beside the minimum.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::{Free, Hypothesis};
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, sum};
use crate::fit::pattern::ended_poorly;
use crate::name::selection::Selection;
use crate::name::threshold::hysteresis_keeps_shrinking;
use crate::name::tried::Tried;
use crate::numerics::loss::Loss;

/// Largest change of the prediction by a finite-difference step, as the root of the normalised sum of squares.
const REACH: f64 = 5.0;
/// Steps of the fit.
const STEPS: usize = 12;

/// Continues the fit with small steps, unless the residual is so far above noise that they say nothing.
pub(crate) fn fit_finely(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    let loss = setting.loss();
    if loss == Loss::Squares || setting.is_over() || ended_poorly(setting, &state.fitted) {
        return Ok(());
    }
    let hypothesis = finer(&state.fitted, loss);
    if hypothesis == state.fitted.point.hypothesis {
        return Ok(());
    }
    let begin = Point { hypothesis, ..state.fitted.point.clone() };
    let tried = if_possible(Tried::from(setting, begin, STEPS))?;
    // The misfit of presliding-hysteresis can be fitted ever better while the held-out error grows.
    let worse = |tried: &Tried| hysteresis_keeps_shrinking(state, loss) && tried.rms > state.rms;
    if let Some(tried) = tried.filter(|tried| tried.fitted.loss < state.fitted.loss && !worse(tried)) {
        state.take(tried);
    }
    Ok(())
}

/// The same hypothesis with its finite-difference steps reduced to the largest change, in an angle log: steps of different reach would make
/// numbers that do the same, the inertias of rotor and load, look different.
pub(crate) fn finer(fitted: &Fitted, loss: Loss) -> Hypothesis {
    let mut hypothesis = fitted.point.hypothesis.clone();
    let total = sum(&loss.weighted(&fitted.groups));
    for (place, free) in fitted.point.hypothesis.free().into_iter().enumerate() {
        let slope = total.matrix.get((place, place)).map_or(0.0, |square| square.sqrt());
        let reach = slope * fitted.point.hypothesis.step(free).abs();
        let finer = match free {
            Free::Zero => None,
            Free::Correction(index) => hypothesis.corrections.get_mut(index).map(|of| &mut of.finer),
            Free::Number(member, number) => {
                hypothesis.members.get_mut(member).and_then(|of| of.finer.get_mut(number))
            }
        };
        if let Some(finer) = finer.filter(|_| reach > REACH) {
            *finer *= REACH / reach;
        }
    }
    hypothesis
}
