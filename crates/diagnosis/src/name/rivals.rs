//! Rivals: the most promising candidates of a screening, fitted through the model, and compared with each other.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::fit::pattern::ended_poorly;
use crate::name::repeats::contradict;
use crate::name::screen::Screened;
use crate::name::selection::Selection;
use crate::name::threshold::{hysteresis_keeps_shrinking, reaches_threshold, rms_threshold};
use crate::name::tried::{EQUAL, NEARLY, STEPS, Tried};
use crate::name::twins::are_twins;
use crate::numerics::gram::HeldOut;
use crate::workers::map;
use valve_model::EffectId;

/// Rivals fitted through the model in a round.
const SHORT_LIST: usize = 6;
/// A candidate is fitted if its linearised gain reaches this part of the acceptance threshold.
const PROMISING: f64 = 0.3;
/// A fit is given up after `FIRST_STEPS` if its RMS is `BEHIND` times the best rival's, and after `FIRST_STEP` if it does not improve
/// on the state without it where the residual is far above noise and steps are expensive.
const FIRST_STEPS: usize = 3;
const FIRST_STEP: usize = 1;
const BEHIND: f64 = 1.5;
/// Held-out RMS that counts as noise, relative to it. If the best rival's is below, `CLOSELY` replaces `BEHIND`: no other can be as good.
pub(crate) const AT_NOISE: f64 = 1.05;
const CLOSELY: f64 = 1.15;
/// Two fits whose RMS differ by less than `NEARLY` count as equal if their mean difference over the groups is within
/// `DISAGREE` standard errors.
const DISAGREE: f64 = 1.5;

/// A candidate fitted.
#[derive(Debug, Clone)]
pub(crate) struct Rival {
    pub id: EffectId,
    pub fitted: Fitted,
    pub held_out: HeldOut,
    /// Held-out RMS relative to the noise.
    pub rms: f64,
}

impl Rival {
    pub fn of(id: EffectId, tried: Tried) -> Self {
        let Tried { fitted, held_out, rms } = tried;
        Self { id, fitted, held_out, rms }
    }

    pub fn tried(&self) -> Tried {
        Tried { fitted: self.fitted.clone(), held_out: self.held_out.clone(), rms: self.rms }
    }
}

/// Fits the most promising candidates of the screening, the leader's twins among them.
pub(crate) fn fit_rivals(
    setting: &Setting<'_>,
    screened: &[Screened],
    state: &mut Selection,
) -> Result<Vec<Rival>, DiagnosisError> {
    let most = screened.first().map_or(0.0, |best| best.gain);
    let least = PROMISING * rms_threshold(state, setting.loss());
    let mut rivals = Vec::new();
    if most < least {
        return Ok(rivals);
    }
    let kind = setting.campaign.kind;
    let leader = screened.first().map(|best| best.member.candidate.id);
    let mut taken = 0;
    for screened in screened {
        let id = screened.member.candidate.id;
        let twin = leader.is_some_and(|leader| are_twins(id, leader, kind));
        let promising = screened.gain > least.max(0.25 * most) && taken < SHORT_LIST;
        if !(promising || twin && screened.gain > 0.1 * most) || setting.is_over() {
            continue;
        }
        taken += 1;
        let best = rivals.iter().map(|rival: &Rival| rival.rms).fold(f64::INFINITY, f64::min);
        let Some(rival) = if_possible(fit_rival(setting, screened, state, best))? else { continue };
        if contradict(setting, id, &state.fitted.point, &rival.fitted.point)? {
            state.refuse(id, "friction came back where pressure and temperature came back");
        } else {
            rivals.push(rival);
        }
    }
    Ok(rivals)
}

/// Fits one candidate beside the accepted causes; stops early if it is far behind the `best` RMS so far, or gains little.
pub(crate) fn fit_rival(
    setting: &Setting<'_>,
    screened: &Screened,
    state: &Selection,
    best: f64,
) -> Result<Rival, DiagnosisError> {
    let begin = Point {
        hypothesis: state.fitted.point.hypothesis.with_cause(screened.member.clone()),
        ..state.fitted.point.clone()
    };
    let far = ended_poorly(setting, &state.fitted) || hysteresis_keeps_shrinking(state, setting.loss());
    let mut tried = Tried::from(setting, begin, if far { FIRST_STEP } else { FIRST_STEPS })?;
    if far && tried.rms < state.rms {
        tried = tried.further(setting, FIRST_STEPS - FIRST_STEP)?;
    }
    let id = screened.member.candidate.id;
    let promises = reaches_threshold(state, (id, tried.rms, &tried.held_out), PROMISING, setting.loss());
    let behind = if best < AT_NOISE { CLOSELY } else { BEHIND };
    if promises && tried.rms < behind * best {
        tried = tried.further(setting, STEPS)?;
        let last = tried.fitted.point.hypothesis.members.len() - 1;
        tried = tried.searched(setting, last)?;
    }
    Ok(Rival::of(id, tried))
}

/// Count of the free numbers of a rival's causes.
pub(crate) fn numbers(rival: &Rival) -> usize {
    rival.fitted.point.hypothesis.members.iter().map(|member| member.free.len()).sum()
}

/// True if `other` has the same held-out error as `best`, within what the groups' scatter allows.
pub(crate) fn as_good(best: &Rival, other: &Rival) -> bool {
    as_good_within(best, other, NEARLY)
}

/// The same with `nearly` in place of [`NEARLY`].
pub(crate) fn as_good_within(best: &Rival, other: &Rival, nearly: f64) -> bool {
    let difference = other.rms - best.rms;
    if difference <= EQUAL {
        return true;
    }
    let apart: Vec<f64> = other
        .held_out
        .squares
        .iter()
        .zip(&best.held_out.squares)
        .zip(&best.fitted.groups)
        .filter(|(_, group)| group.count > 0.0)
        .map(|((other, best), _)| other - best)
        .collect();
    let count = apart.len().max(2) as f64;
    let mean = apart.iter().sum::<f64>() / count;
    let variance = apart.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    difference < nearly && mean < DISAGREE * (variance / count).sqrt()
}

/// The angle between the changes of the prediction that two hypotheses make, degrees; samples weighted as in the fit.
pub(crate) fn angle_between(
    setting: &Setting<'_>,
    base: &Point,
    one: &Point,
    two: &Point,
) -> Result<f64, DiagnosisError> {
    let ready = [&base.hypothesis, &one.hypothesis, &two.hypothesis].map(|of| setting.ready(of));
    let [base_ready, one_ready, two_ready] = ready;
    let (base_ready, one_ready, two_ready) = (base_ready?, one_ready?, two_ready?);
    let products = map(setting.workers, setting.campaign.pieces.len(), |index| {
        let piece = setting.campaign.pieces.get(index).filter(|piece| piece.is_fitted())?;
        let start = base.start(index);
        let [none, one, two] = [&base_ready, &one_ready, &two_ready].map(|ready| piece.predict(ready, start));
        let samples = none.iter().zip(&one).zip(&two).zip(&piece.weights);
        Some(samples.fold((0.0, 0.0, 0.0), |(aa, ab, bb), (((none, one), two), weight)| {
            let (a, b) = (weight * (one - none), weight * (two - none));
            (aa + a * a, ab + a * b, bb + b * b)
        }))
    });
    let (aa, ab, bb) = products
        .into_iter()
        .flatten()
        .fold((0.0, 0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1, sum.2 + of.2));
    let cosine: f64 = ab / f64::sqrt(aa * bb).max(f64::MIN_POSITIVE);
    Ok(cosine.clamp(-1.0, 1.0).acos().to_degrees())
}
