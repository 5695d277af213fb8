//! Where a fit of angles is near its end: slopes taken over changes as small as the numbers are known by then.
//!
//! A rotor that sticks and slips answers a change of some percent with slips at other moments, which is no slope; far from the
//! best such a slope is all there is, near it the fit would end beside the valley that the numbers lie in.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::{Free, Hypothesis};
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, sum};
use crate::fit::pattern::ended_poorly;
use crate::name::selection::Selection;
use crate::name::threshold::leaves_much_to_pick;
use crate::name::tried::Tried;
use crate::numerics::loss::Loss;

/// A change over which a slope is taken changes the prediction by so many times the noise at most, as a root of the sum of squares.
const REACH: f64 = 5.0;
/// Steps of the fit.
const STEPS: usize = 12;

/// Fits on over small changes, where not so much is left that a small change says nothing.
pub(crate) fn fit_finely(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    let loss = setting.loss();
    if loss == Loss::Squares || ended_poorly(setting, &state.fitted) {
        return Ok(());
    }
    let hypothesis = finer(&state.fitted, loss);
    if hypothesis == state.fitted.point.hypothesis {
        return Ok(());
    }
    let begin = Point { hypothesis, ..state.fitted.point.clone() };
    let tried = if_possible(Tried::from(setting, begin, STEPS))?;
    // What a loose form leaves can be fitted better and better, and tells less and less of other runs.
    let worse = |tried: &Tried| leaves_much_to_pick(state, loss) && tried.rms > state.rms;
    if let Some(tried) = tried.filter(|tried| tried.fitted.loss < state.fitted.loss && !worse(tried)) {
        state.take(tried);
    }
    Ok(())
}

/// The same hypothesis, its slopes over changes within reach.
fn finer(fitted: &Fitted, loss: Loss) -> Hypothesis {
    let mut hypothesis = fitted.point.hypothesis.clone();
    let total = sum(&loss.weighted(&fitted.groups));
    for (place, free) in fitted.point.hypothesis.free().into_iter().enumerate() {
        let Free::Number(member, number) = free else { continue };
        let slope = total.matrix.get((place, place)).map_or(0.0, |square| square.sqrt());
        let reach = slope * fitted.point.hypothesis.step(free).abs();
        let finer = hypothesis.members.get_mut(member).and_then(|of| of.finer.get_mut(number));
        if let Some(finer) = finer.filter(|_| reach > REACH) {
            *finer *= REACH / reach;
        }
    }
    hypothesis
}
