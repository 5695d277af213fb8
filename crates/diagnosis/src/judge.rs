//! One judgement: the given model fitted, causes searched for, and corrections of the model's parameters refitted with them.

use crate::DiagnosisError;
use crate::asked::Asked;
use crate::corrected::{with_corrections, within_tolerance};
use crate::few::{Few, few, few_stay};
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::found::Event;
use crate::in_place::zeros_in_place;
use crate::log::noise::NoiseLevel;
use crate::log::piece::Piece;
use crate::measure::doubt::leaves_noise;
use crate::measure::judgement::Judgement;
use crate::name::apart::tell_apart;
use crate::name::select::select;
use crate::name::selection::Selection;
use crate::show::conditions::go_by_conditions;
use crate::show::own_zeros::zeros_hold;
use crate::show::residual::{Jumps, left_with, rms_left, settled};
use crate::show::structure::structure;
use crate::zeros::{
    same_causes_with_zeros, with_zeros_by_run, without_common_zero, zeros_belong, zeros_explain,
};
use valve_model::EffectId;

/// Fits the given model, searches for causes, and collects what the conclusion needs.
pub(crate) fn judge<'a>(
    setting: Setting<'a>,
    noise: NoiseLevel,
    asked: Asked<'_>,
    earlier: Option<&Selection>,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Judgement<'a>, DiagnosisError> {
    let (given, corrected) = given_and_corrected(&setting, asked)?;
    let seen = left_with(&setting, &given.point, Jumps::Seen)?;
    let rms = rms_left(&setting, &seen, &Piece::is_fitted);
    tell(Event::Noise { rms, noise: noise.told(rms) });
    tell(Event::Step("screening causes"));
    let mut ranked = |ranking: &[(EffectId, f64)]| {
        tell(Event::Ranking(ranking));
        let (simulated, at_most) = setting.campaign.simulated();
        tell(Event::Bound { simulated, at_most });
    };
    let mut few = few(&setting, asked, (&given, corrected.as_ref()), earlier, &mut ranked)?;
    let (mut setting, mut given, mut corrected) = (setting, given, corrected);
    if let Few::Not(without) = &few
        && let Some((with_zeros, first)) = with_zeros_by_run(&setting, asked, (&seen, without.as_deref()))?
    {
        let (without, asked) = (without.as_deref(), Asked { first: &first, ..asked });
        let fitted = given_and_corrected(&with_zeros, asked)?;
        let found = self::few(&with_zeros, asked, (&fitted.0, fitted.1.as_ref()), None, &mut |_| {})?;
        let belong = match &found {
            Few::Found(causes) => {
                zeros_explain(causes, without, asked.corrections)
                    && zeros_hold(&with_zeros, found.point(&fitted))?
            }
            Few::Not(Some(found)) => zeros_belong(&with_zeros, found, without)?,
            Few::Not(None) => false,
        };
        let are_zeros = |found: &Few| go_by_conditions(&with_zeros, found.point(&fitted)).map(|go_by| !go_by);
        let found = if belong && are_zeros(&found)? {
            Some(found)
        } else {
            let same = match same_causes_with_zeros(&with_zeros, &fitted.0, without)? {
                Some(same) if leaves_noise(&with_zeros, &same.fitted)? => Some(Few::Found(Box::new(same))),
                same => same.map(|same| Few::Not(Some(Box::new(same)))),
            };
            match same {
                Some(same) if are_zeros(&same)? => Some(same),
                _ => None,
            }
        };
        if let Some(found) = found {
            (setting, few) = (with_zeros, found);
            (given, corrected) = fitted;
        }
    }
    let begun = given.point.clone();
    let selection = match few {
        Few::Found(few) => *few,
        Few::Not(few) => {
            let selected = select(&setting, asked.able, given, earlier, &mut ranked)?;
            match few {
                Some(few) if few_stay(&setting, &few, (&selected, corrected.as_ref()), asked)? => *few,
                _ => selected,
            }
        }
    };
    tell(Event::Step("measuring the gain"));
    let judged = judgement(setting, noise, (selection, corrected), &begun, asked)?;
    let Some((with_zeros, fewer)) = zeros_in_place(&judged, asked)? else { return Ok(judged) };
    let first = without_common_zero(asked.first, with_zeros.nuisances);
    let asked = Asked { first: &first, ..asked };
    let (given, corrected) = given_and_corrected(&with_zeros, asked)?;
    judgement(with_zeros, noise, (fewer, corrected), &given.point, asked)
}

/// The given model with its fitted start, and with corrections within their tolerance; see [`within_tolerance`].
pub(crate) fn given_and_corrected(
    setting: &Setting<'_>,
    asked: Asked<'_>,
) -> Result<(Fitted, Option<Fitted>), DiagnosisError> {
    setting.campaign.with_reserve(|| {
        let given = fit(setting, asked.first.clone(), &Piece::is_fitted, 4)?;
        let corrected = within_tolerance(setting, &given, asked.corrections)?;
        Ok((given, corrected))
    })
}

/// As [`judge`], if no cause, or one or two beside corrections, leave no more than noise, and zeros of each run are zeros; else `None`.
pub(crate) fn judge_few<'a>(
    setting: Setting<'a>,
    noise: NoiseLevel,
    asked: Asked<'_>,
) -> Result<Option<Judgement<'a>>, DiagnosisError> {
    let fitted = given_and_corrected(&setting, asked)?;
    let few = few(&setting, asked, (&fitted.0, fitted.1.as_ref()), None, &mut |_| {})?;
    if go_by_conditions(&setting, few.point(&fitted))? {
        return Ok(None);
    }
    let (Few::Found(few), (given, corrected)) = (few, fitted) else { return Ok(None) };
    judgement(setting, noise, (*few, corrected), &given.point, asked).map(Some)
}

/// What the conclusion needs: the selection refitted beside the corrections, and the residual of the given model, from its fitted start.
fn judgement<'a>(
    setting: Setting<'a>,
    noise: NoiseLevel,
    (selection, corrected): (Selection, Option<Fitted>),
    begun: &Point,
    asked: Asked<'_>,
) -> Result<Judgement<'a>, DiagnosisError> {
    let everything = |_: &Piece| true;
    let (selection, begun) = setting.campaign.with_reserve(|| {
        let mut selection =
            with_corrections(&setting, selection, corrected, (asked.corrections, asked.able))?;
        tell_apart(&setting, &mut selection, asked.corrections)?;
        Ok::<_, DiagnosisError>((selection, settled(&setting, begun, &everything)?))
    })?;
    let before = left_with(&setting, &begun, Jumps::Seen)?;
    let rms = rms_left(&setting, &before, &everything);
    let structure_before = structure(&setting, &before);
    let (corrections, seed) = (asked.corrections.to_vec(), asked.seed);
    Ok(Judgement { setting, noise, selection, corrections, before, structure_before, rms, seed })
}
