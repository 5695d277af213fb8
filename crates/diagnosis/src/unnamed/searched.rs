//! Laws searched for beside the accepted causes, and in their place: several causes together can stand in for one law that the list lacks.

use crate::DiagnosisError;
use crate::fit::equations::Point;
use crate::measure::doubt::is_noise;
use crate::measure::gain::{Part, gain, part_left_as_fitted};
use crate::measure::judgement::Judgement;
use crate::name::tried::Tried;
use crate::show::residual::PieceResidual;
use crate::show::structure::structure;
use crate::unnamed::factor::Factor;
use crate::unnamed::kept::{HARDLY_MORE, Kept, MOST_LEFT};
use crate::unnamed::search::search;

/// Laws that hold on the runs held out, and what they were found beside.
pub(crate) struct Searched {
    pub begin: Point,
    /// The fit of `begin`, and what it leaves.
    pub without_laws: Tried,
    pub bare: Vec<PieceResidual>,
    pub kept: Kept,
}

impl Searched {
    /// Searches from `begin` on; `before` is what is left where no law is taken. `None` where no law holds.
    fn from(
        judged: &Judgement<'_>,
        begin: Point,
        before: &[PieceResidual],
    ) -> Result<Option<Self>, DiagnosisError> {
        let campaign = judged.setting.campaign;
        let found = campaign.with_reserve_for_laws(|| search(&judged.setting, begin.clone()))?;
        let mut stages = found.into_iter();
        let Some(without_laws) = stages.next().map(|laws| laws.tried) else { return Ok(None) };
        let (_, bare) = judged.everywhere(&without_laws.fitted)?;
        let mut kept: Option<Kept> = None;
        for laws in stages {
            let found = Kept::of(judged, &bare, laws)?;
            let holds =
                found.ci95[1] < 1.0 && gain(&judged.setting, before, &found.after, judged.seed).ratio <= 1.0;
            let most = kept.as_ref().map_or(MOST_LEFT, |kept| {
                let fewer = found.laws.terms.len() < kept.laws.terms.len();
                kept.part * if fewer { HARDLY_MORE } else { MOST_LEFT }
            });
            if holds && found.part <= most {
                kept = Some(found);
            }
        }
        Ok(kept.map(|kept| Self { begin, without_laws, bare, kept }))
    }

    /// Whether they leave no more than noise.
    fn leaves_noise(&self, judged: &Judgement<'_>) -> bool {
        is_noise(&structure(&judged.setting, &self.kept.after))
    }

    /// Whether these laws, found without causes, leave no more than noise and serve better than causes and `laws` beside them, which leave
    /// `left`.
    fn serves_better(
        &self,
        judged: &Judgement<'_>,
        (causes, laws): (usize, usize),
        left: &[PieceResidual],
    ) -> bool {
        let setting = &judged.setting;
        // Laws that leave something unexplained are no better known than the causes.
        if !self.leaves_noise(judged) {
            return false;
        }
        let part = part_left_as_fitted(setting, left, &self.kept.after, judged.seed);
        let terms = &self.kept.laws.terms;
        let bends = terms.iter().flat_map(|term| &term.factors).any(Factor::is_curve);
        is_better((terms.len(), bends), (causes, laws), &part)
    }
}

/// Whether so many laws serve better in the place of so many causes and laws beside them, of whose error they leave `part` on the runs held
/// out: with fewer terms they leave clearly less, or hardly more. A curve can follow several causes, so it must leave less; and where no law
/// held beside the causes, these alone are not given up for as much.
fn is_better((alone, bends): (usize, bool), (causes, laws): (usize, usize), part: &Part) -> bool {
    let as_good = laws > 0 && !bends && part.ratio <= HARDLY_MORE;
    alone < causes + laws && (as_good || part.ratio <= MOST_LEFT && part.ci95[1] < 1.0)
}

/// Whether laws that are searched for from `bare` on, without causes, leave no more than noise.
pub(crate) fn alone_leave_noise(judged: &Judgement<'_>, bare: Point) -> Result<bool, DiagnosisError> {
    let found = Searched::from(judged, bare, &judged.before)?;
    Ok(found.is_some_and(|found| found.leaves_noise(judged)))
}

/// The laws found from `begin` on, or those found from `bare` on, the same without causes, where these serve better. `before` is what the
/// accepted causes leave.
pub(crate) fn beside_or_instead(
    judged: &Judgement<'_>,
    (begin, bare): (Point, Point),
    before: &[PieceResidual],
) -> Result<Option<Searched>, DiagnosisError> {
    let causes = begin.hypothesis.members.len() - bare.hypothesis.members.len();
    let beside = Searched::from(judged, begin, before)?;
    // What the causes leave may count as noise: then nothing tells whether laws leave no more.
    let counts_misfit = judged.noise.share < 1.0;
    if causes == 0 || counts_misfit || judged.setting.workers.is_over() {
        return Ok(beside);
    }
    let Some(instead) = Searched::from(judged, bare, &judged.before)? else { return Ok(beside) };
    let (laws, left) = match &beside {
        Some(beside) => (beside.kept.laws.terms.len(), beside.kept.after.as_slice()),
        None => (0, before),
    };
    let better = instead.serves_better(judged, (causes, laws), left);
    Ok(if better { Some(instead) } else { beside })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn when_laws_take_the_place_of_causes() {
        // Laws alone, whether one is a curve; causes, laws beside them; part of their error, its upper end; taken.
        type Case = ((usize, bool), (usize, usize), f64, f64, bool);
        let cases: [Case; 9] = [
            ((1, false), (1, 1), 1.0, 1.1, true),
            ((1, false), (1, 1), 1.06, 1.1, false),
            ((1, true), (1, 1), 1.0, 1.1, false),
            ((1, true), (1, 1), 0.7, 0.9, true),
            ((1, false), (2, 0), 1.0, 1.1, false),
            ((1, false), (2, 0), 0.7, 0.9, true),
            ((1, false), (2, 0), 0.7, 1.1, false),
            ((2, false), (1, 1), 0.7, 0.9, false),
            ((1, false), (1, 0), 0.7, 0.9, false),
        ];
        for (alone, beside, ratio, upper, expected) in cases {
            let part = Part { ratio, ci95: [0.5 * ratio, upper] };
            assert_eq!(is_better(alone, beside, &part), expected, "{alone:?} {beside:?} {ratio} {upper}");
        }
    }
}
