//! Zeros of each run: whether a torque's or an angle's zero differs from run to run, and whether that is reported beside causes.

use crate::DiagnosisError;
use crate::asked::Asked;
use crate::extend::hypothesis::Correction;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::measure::doubt::leaves_noise;
use crate::name::prune::drop_idle;
use crate::name::select::nothing_yet;
use crate::name::selection::Selection;
use crate::name::tried::{STEPS, Tried};
use crate::outcome::Dependence;
use crate::show::observe::shows_zeros;
use crate::show::own_zeros::zeros_hold;
use crate::show::residual::{PieceResidual, left};
use crate::show::structure::{counts, structure};
use log_data::AngleZero;
use std::collections::BTreeSet;
use valve_model::EffectId;

/// Offsets of each run are accepted only if they cut the residual to this part of that with one common offset: they cost a parameter a run.
const MUCH_LESS: f64 = 0.9;
/// Where offsets of each run leave no more than this part of the mean square beyond noise, they are there, whatever else is.
const NEARLY_ALL: f64 = 0.1;
/// Beyond this many times the noise other causes may be in the place of offsets of each run.
const NEAR_NOISE: f64 = 1.5;

/// The setting and the beginning with a zero of its own for each run: only if the runs differ on average in the residual of the given
/// model, or in what few causes leave: beside what these do such differences are small. Tried where one zero needs many causes. An encoder that was
/// switched off between the runs, or a transducer that was loaded anew, is a smaller assumption than these.
pub(crate) fn with_zeros_by_run<'a>(
    setting: &Setting<'a>,
    asked: Asked<'_>,
    (seen, few): (&[PieceResidual], Option<&Selection>),
) -> Result<Option<(Setting<'a>, Point)>, DiagnosisError> {
    let nuisances = zeros_by_run(setting, asked.corrections);
    if nuisances == setting.nuisances || setting.is_over() {
        return Ok(None);
    }
    let few_leave = || few.map(|few| left(setting, &few.fitted.point)).transpose();
    if !runs_differ(setting, seen) && !few_leave()?.is_some_and(|left| runs_differ(setting, &left)) {
        return Ok(None);
    }
    Ok(Some((Setting { nuisances, ..*setting }, without_common_zero(asked.first, nuisances))))
}

/// The causes found `without` zeros of each run, fitted beside such zeros if these belong there, and without those that stood in for zeros: a search
/// of its own beside them may have been ended before it came so far. Where too few runs go both ways, the torque that the causes leave of each is
/// friction's just as well.
pub(crate) fn same_causes_with_zeros(
    with_zeros: &Setting<'_>,
    given: &Fitted,
    without: Option<&Selection>,
) -> Result<Option<Selection>, DiagnosisError> {
    let Some(found) = without.filter(|found| found.causes() > 0) else { return Ok(None) };
    if with_zeros.nuisances.zero_nm > 0.0 && !shows_zeros(with_zeros.campaign) {
        return Ok(None);
    }
    let begin = without_common_zero(&found.fitted.point, with_zeros.nuisances);
    let mut same = found.clone();
    same.take(with_zeros.campaign.with_reserve(|| Tried::from(with_zeros, begin, STEPS))?);
    let belong = leaves_noise(with_zeros, &same.fitted)? || zeros_belong(with_zeros, &same, without)?;
    if !belong {
        return Ok(None);
    }
    // One of them may have stood in for the zeros.
    drop_idle(with_zeros, &mut same)?;
    if !zeros_hold(with_zeros, &same.fitted.point)? {
        return Ok(None);
    }
    same.begin_from(&nothing_yet(with_zeros, given.clone()));
    Ok(Some(same))
}

/// Whether a residual differs from run to run, and not as friction does.
fn runs_differ(setting: &Setting<'_>, left: &[PieceResidual]) -> bool {
    let by_run = |of: &Dependence| of.on == "run" && !of.as_friction;
    structure(setting, left).dependences.iter().any(|of| by_run(of) && counts(of))
}

/// A point from which zeros of each run are fitted in place of a common one.
pub(crate) fn without_common_zero(point: &Point, nuisances: Nuisances) -> Point {
    let mut point = point.clone();
    if nuisances.angle_zero {
        point.hypothesis.zero_rad = None;
    }
    point
}

/// Whether offsets of each run stay where they leave more than noise, whose colour is judged last: they pay, and are what zeros are. A log
/// that says that its angles have a common zero is believed.
pub(crate) fn zeros_belong(
    setting: &Setting<'_>,
    with_zeros: &Selection,
    without: Option<&Selection>,
) -> Result<bool, DiagnosisError> {
    let pay =
        |of: &Selection| zeros_pay(Reached::of(with_zeros), Reached::of(of), with_zeros.ids() == of.ids());
    let zero_nm = setting.nuisances.zero_nm;
    if zero_nm == 0.0 || !without.is_some_and(pay) {
        return Ok(false);
    }
    zeros_hold(setting, &with_zeros.fitted.point)
}

/// Whether offsets of each run are worth what they cost: the same causes leave much less beside them, or no more causes do and not far from noise,
/// or they take nearly all that few causes leave beyond it.
fn zeros_pay(with_zeros: Reached, without: Reached, same_causes: bool) -> bool {
    let beyond_noise = |of: Reached| (of.rms.powi(2) - 1.0).max(0.0);
    let less = with_zeros.causes <= without.causes && with_zeros.rms < MUCH_LESS * without.rms;
    less && (same_causes || with_zeros.rms < NEAR_NOISE)
        || beyond_noise(with_zeros) < NEARLY_ALL * beyond_noise(without)
}

/// True if offsets of each run, which leave only noise, are reported as the explanation. Either the same causes are found
/// without them and leave more (parameters of the model may differ), or the residual without them is much larger.
pub(crate) fn zeros_explain(
    with_zeros: &Selection,
    without: Option<&Selection>,
    corrections: &[Correction],
) -> bool {
    let Some(without) = without else { return true };
    let is_number = |id: EffectId| corrections.iter().any(|of| of.id == id);
    let of = |selection: &Selection| -> BTreeSet<EffectId> {
        selection.ids().into_iter().filter(|id| !is_number(*id)).collect()
    };
    of(with_zeros) == of(without) || with_zeros.rms < MUCH_LESS * without.rms
}

/// Adds an offset of each run to the nuisance parameters, unless the log says how its runs' zeros are related. The prior of a torque's offsets
/// is the tolerance of the model's own. In runs that all go one way it is an offset of friction just as well.
pub(crate) fn zeros_by_run(setting: &Setting<'_>, corrections: &[Correction]) -> Nuisances {
    let campaign = setting.campaign;
    let mut nuisances = setting.nuisances;
    if campaign.angle_zero == Some(AngleZero::Common) {
        nuisances.angle_zero = true;
    } else if nuisances.zero_nm == 0.0 && campaign.kind.residual_is_torque() && campaign.runs.len() > 1 {
        let zero = corrections.iter().find(|of| of.id == EffectId::TorqueOffset);
        nuisances.zero_nm = zero.map_or(0.0, |zero| zero.deviation);
    }
    nuisances
}

/// How many causes a search found, how many of these without a late transducer, and the held-out RMS that they leave.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reached {
    pub causes: usize,
    pub of_the_valve: usize,
    pub rms: f64,
}

impl Reached {
    pub fn of(selection: &Selection) -> Self {
        let (causes, of_the_valve) = (selection.causes(), selection.causes_of_the_valve());
        Self { causes, of_the_valve, rms: selection.rms }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_of_each_run_must_pay() {
        let reached = |(causes, rms)| Reached { causes, of_the_valve: causes, rms };
        for (with_zeros, without, same_causes, pay) in [
            ((1, 1.4), (1, 1.5), true, false),
            ((1, 1.4), (1, 2.0), false, true),
            ((1, 1.4), (2, 2.0), false, true),
            ((2, 1.4), (1, 2.0), false, false),
            // Far from noise other causes may be in their place, the same ones not.
            ((1, 4.0), (1, 5.0), false, false),
            ((1, 4.0), (1, 5.0), true, true),
            ((1, 4.8), (1, 5.0), true, false),
            ((2, 2.0), (1, 8.0), false, true),
        ] {
            let found = zeros_pay(reached(with_zeros), reached(without), same_causes);
            assert_eq!(found, pay, "{with_zeros:?} beside {without:?}, the same: {same_causes}");
        }
    }
}
