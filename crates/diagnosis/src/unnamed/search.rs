//! The search for laws: elementary functions and their products are screened by the residual that they would leave, the best are fitted
//! through the model, and of those that do equally well the simplest is taken.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::{Correction, Member};
use crate::extend::stroke::{tells_apart, turns};
use crate::extend::suspected::{candidate_of, why_not_suspected};
use crate::fit::equations::{Point, Setting};
use crate::measure::doubt::is_noise;
use crate::name::own::AtBounds;
use crate::name::screen::{orders_of, screen_with};
use crate::name::threshold::FLOOR;
use crate::name::tried::{EQUAL, STEPS, Tried};
use crate::show::colour::is_coloured;
use crate::show::residual::left;
use crate::show::structure::structure;
use crate::show::waves::order_of_its_own;
use crate::show::whiteness::is_white;
use crate::unnamed::factor::{AROUND, Factor};
use crate::unnamed::knots::knots;
use crate::unnamed::library::{Suggested, library, may_depend};
use crate::unnamed::term::Term;
use crate::unnamed::tone::tone_over_the_clock;
use valve_model::{ActsOn, Covariate, EffectId};

/// Laws at most.
const MOST_LAWS: usize = 3;
/// Columns that are screened at once: they share one pass over the log, and each is multiplied by each.
const AT_ONCE: usize = 24;
/// Single functions of which every product is screened, where a simulation is dear, and beside laws. Where it is cheap, the first law is
/// looked for among all products: of two functions that swing about none, alone neither shows.
const HEADS: usize = 8;
/// Laws that are fitted, of those the ones of the same quantities, and the part of the best one's screened gain that they must have.
const FITTED: usize = 8;
const ALIKE: usize = 2;
const NEAR: f64 = 0.7;
/// A simpler law is taken if it cuts as much of the held-out error, up to this part.
const AS_MUCH: f64 = 0.03;
/// A law must cut the held-out mean square by this part: less is within the misfit of the others' forms.
const LEAST_PART: f64 = 0.1;

/// The laws that were found, in the order of the last members of the hypothesis.
#[derive(Clone)]
pub(crate) struct Laws {
    pub terms: Vec<Term>,
    pub tried: Tried,
    /// Others that did as well as the last one, as they were fitted in its place.
    pub rivals: Vec<(Term, Member)>,
}

/// A law with what the screening expects of it.
struct Ranked {
    term: Term,
    gain: f64,
    member: Member,
}

/// Searches from `begin` on. First the fit without a law, then with one law and more, each with those before it; last, those of them that
/// the others don't make idle.
pub(crate) fn search(setting: &Setting<'_>, begin: Point) -> Result<Vec<Laws>, DiagnosisError> {
    let mut laws = Laws { terms: Vec::new(), tried: Tried::from(setting, begin, STEPS)?, rivals: Vec::new() };
    let mut stages: Vec<Laws> = vec![laws.clone()];
    while laws.terms.len() < MOST_LAWS && !setting.is_over() {
        let kept = setting.sensitivities(&laws.tried.fitted.point)?;
        let quick = Setting { kept: kept.as_ref(), ..*setting };
        let seen = left(setting, &laws.tried.fitted.point)?;
        let structure = structure(setting, &seen);
        // Few of a slow residual's samples are independent: before any law, it may depend on something all the same.
        let is_colour = || !laws.terms.is_empty() && is_coloured(setting, &seen, &structure);
        if is_noise(&structure) && (is_white(setting, &seen) || is_colour()) {
            break;
        }
        let suggested = Suggested {
            orders: orders_of(setting, &seen),
            tone: tone_over_the_clock(setting, &seen),
            order: order_of_its_own(setting, &seen),
        };
        let mut ranked = ranking(&quick, &laws.tried, &suggested, laws.terms.is_empty())?;
        // The same functions again would only be fitted against themselves, with huge numbers of either sign.
        ranked.retain(|of| !laws.terms.iter().any(|known| known.is_same(&of.term)));
        let mut good = best_of(&quick, &laws.tried, shortlist(ranked))?.into_iter();
        let Some((term, tried)) = good.next() else { break };
        laws.rivals = rivals_of(&term, good);
        laws.terms.push(term);
        laws.tried = Tried::from(setting, tried.fitted.point, STEPS)?;
        stages.push(laws.clone());
    }
    if laws.terms.len() > 1 {
        let all = laws.terms.len();
        let fewer = without_idle(setting, laws)?;
        stages.extend((fewer.terms.len() < all).then_some(fewer));
    }
    Ok(stages)
}

/// Those of the laws that do as well, without curves over what another is a formula of.
fn rivals_of(term: &Term, as_good: impl Iterator<Item = (Term, Tried)>) -> Vec<(Term, Member)> {
    let mut rivals: Vec<(Term, Member)> = Vec::new();
    for (other, tried) in as_good {
        let apart = |known: &Term| !known.bends_to(&other) && !other.bends_to(known);
        let last = tried.fitted.point.hypothesis.members.last();
        if let Some(member) = last.filter(|_| apart(term) && rivals.iter().all(|(known, _)| apart(known))) {
            rivals.push((other, member.clone()));
        }
    }
    rivals
}

/// All laws that are screened, best first.
fn ranking(
    setting: &Setting<'_>,
    base: &Tried,
    suggested: &Suggested,
    is_first: bool,
) -> Result<Vec<Ranked>, DiagnosisError> {
    let facts = &setting.campaign.facts;
    let of = |acts_on: &ActsOn| (*acts_on, library(*acts_on, facts, suggested));
    let has_viscous = facts.viscous > 0.0;
    let acting: Vec<ActsOn> =
        ActsOn::ALL.into_iter().filter(|on| *on != ActsOn::Viscous || has_viscous).collect();
    let libraries: Vec<(ActsOn, Vec<Factor>)> = acting.iter().map(of).collect();
    let single = |(acts_on, factors): &(ActsOn, Vec<Factor>)| -> Vec<Term> {
        factors.iter().map(|factor| Term { acts_on: *acts_on, factors: vec![factor.clone()] }).collect()
    };
    let mut ranked = screened(setting, base, libraries.iter().flat_map(single).collect())?;
    let heads = if facts.kind.smooth && is_first { ranked.len() } else { HEADS };
    let mut products: Vec<Term> = Vec::new();
    for (place, head) in ranked.iter().take(heads).enumerate() {
        let Some((_, factors)) = libraries.iter().find(|(acts_on, _)| *acts_on == head.term.acts_on) else {
            continue;
        };
        // What goes by the rest has to be simulated.
        let is_dear = |of: Covariate| of == Covariate::TimeAtRest && place >= HEADS;
        if head.term.covariates().any(is_dear) {
            continue;
        }
        let others = factors.iter().filter(|factor| head.term.takes(factor.of) && !is_dear(factor.of));
        for product in others.map(|factor| head.term.times(factor)) {
            if !products.iter().any(|known| known.is_same(&product)) {
                products.push(product);
            }
        }
    }
    ranked.extend(screened(setting, base, products)?);
    ranked.extend(screened(setting, base, curves(setting))?);
    ranked.extend(screened(setting, base, around_the_turn(setting, &libraries))?);
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    if let Some(best) = ranked.iter().find(|of| !of.term.is_listed()).filter(|of| of.term.factors.len() == 2)
    {
        let factors = libraries.iter().find(|(acts_on, _)| *acts_on == best.term.acts_on);
        let others = factors.into_iter().flat_map(|(_, factors)| factors);
        let new = others.filter(|factor| best.term.takes(factor.of));
        let longer: Vec<Term> = new.map(|factor| best.term.times(factor)).collect();
        ranked.extend(screened(setting, base, longer)?);
        ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    }
    Ok(ranked)
}

/// A free curve over each quantity, as a torque and as a factor of the levels.
fn curves(setting: &Setting<'_>) -> Vec<Term> {
    let facts = &setting.campaign.facts;
    let curve = |of: Covariate| Some(Factor::curve(of, knots(setting.campaign, of)?));
    let all: Vec<Factor> =
        Covariate::ALL.into_iter().filter(|of| facts.varies(*of)).filter_map(curve).collect();
    let over = |acts_on: ActsOn| {
        let own = all.iter().filter(move |curve| may_depend(acts_on, curve.of, facts));
        own.map(move |curve| Term { acts_on, factors: vec![curve.clone()] })
    };
    [ActsOn::Torque, ActsOn::Level].into_iter().flat_map(over).collect()
}

/// A curve around the turn times the pressure or the temperature: a sector that rubs, and what presses on it. Alone it is the list's.
fn around_the_turn(setting: &Setting<'_>, libraries: &[(ActsOn, Vec<Factor>)]) -> Vec<Term> {
    let orders: Vec<usize> = (1..=AROUND).collect();
    if !tells_apart(&orders, turns(&setting.campaign.facts)) {
        return Vec::new();
    }
    let presses = |factor: &&Factor| matches!(factor.of, Covariate::PressureDrop | Covariate::OilTemperature);
    let times =
        |acts_on: ActsOn, factor: &Factor| Term { acts_on, factors: vec![Factor::around(), factor.clone()] };
    let of = |(acts_on, factors): &(ActsOn, Vec<Factor>)| -> Vec<Term> {
        factors.iter().filter(presses).map(|factor| times(*acts_on, factor)).collect()
    };
    libraries.iter().flat_map(of).collect()
}

/// The laws with what they would gain, best first.
fn screened(setting: &Setting<'_>, base: &Tried, terms: Vec<Term>) -> Result<Vec<Ranked>, DiagnosisError> {
    let mut ranked = Vec::new();
    for chunk in chunks(&terms) {
        if setting.is_over() {
            break;
        }
        let able: Vec<(Candidate, &Term)> = chunk
            .iter()
            .enumerate()
            .filter_map(|(index, term)| Some((candidate(setting, term, &format!("screened-{index}"))?, term)))
            .collect();
        let candidates: Vec<Candidate> = able.iter().map(|(candidate, _)| candidate.clone()).collect();
        for of in screen_with(setting, &candidates, &base.fitted, AtBounds::ComeBack)?.ranked {
            let term = able.iter().find(|(candidate, _)| candidate.id == of.member.candidate.id);
            if let Some((_, term)) = term {
                ranked.push(Ranked { term: (*term).clone(), gain: of.gain, member: of.member });
            }
        }
    }
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(ranked)
}

/// Terms in their order, so many together that they have about [`AT_ONCE`] columns.
fn chunks(terms: &[Term]) -> Vec<&[Term]> {
    let (mut chunks, mut rest) = (Vec::new(), terms);
    while !rest.is_empty() {
        let mut columns = 0;
        let is_within = |term: &&Term| {
            let before = columns;
            columns += term.columns();
            before < AT_ONCE
        };
        let (chunk, others) = rest.split_at(rest.iter().take_while(is_within).count());
        chunks.push(chunk);
        rest = others;
    }
    chunks
}

fn candidate(setting: &Setting<'_>, term: &Term, name: &str) -> Option<Candidate> {
    let facts = &setting.campaign.facts;
    let suspect = term.suspect(name)?;
    why_not_suspected(&suspect, facts).is_none().then(|| candidate_of(&suspect, facts))
}

/// Those that are fitted: the best, no more than a few of the same quantities, and none that the list has.
fn shortlist(ranked: Vec<Ranked>) -> Vec<Ranked> {
    let new: Vec<Ranked> = ranked.into_iter().filter(|of| !of.term.is_listed()).collect();
    let least = new.first().map_or(f64::INFINITY, |best| NEAR * best.gain);
    let mut chosen: Vec<Ranked> = Vec::new();
    for of in new {
        let alike = chosen.iter().filter(|other| other.term.has_quantities_of(&of.term)).count();
        if of.gain > FLOOR && of.gain >= least && alike < ALIKE && chosen.len() < FITTED {
            chosen.push(of);
        }
    }
    chosen
}

/// The laws that cut about as much as the best one, the simplest first; none if that doesn't cut enough.
fn best_of(
    setting: &Setting<'_>,
    base: &Tried,
    shortlist: Vec<Ranked>,
) -> Result<Vec<(Term, Tried)>, DiagnosisError> {
    let hypothesis = &base.fitted.point.hypothesis;
    let taken = |name: &str| {
        let is_so_called = |id: EffectId| id.name() == name;
        let own = hypothesis.members.iter().any(|member| is_so_called(member.candidate.id));
        own || setting.given.effects.iter().any(|effect| is_so_called(effect.id()))
    };
    let mut fitted: Vec<(Term, Tried)> = Vec::new();
    for of in shortlist {
        if setting.is_over() {
            break;
        }
        let Some(named) = candidate(setting, &of.term, &of.term.name(taken)) else { continue };
        let member = Member::new(&named, of.member.numbers, of.member.free);
        let begin = Point { hypothesis: hypothesis.with(member), starts: base.fitted.point.starts.clone() };
        if let Some(tried) = if_possible(Tried::from(setting, begin, STEPS))? {
            fitted.push((of.term, tried));
        }
    }
    let least = fitted.iter().map(|(_, tried)| tried.rms).fold(f64::INFINITY, f64::min);
    let enough =
        base.rms - least >= FLOOR && base.rms.powi(2) - least.powi(2) >= LEAST_PART * base.rms.powi(2);
    if !enough {
        return Ok(Vec::new());
    }
    let as_good = least + EQUAL.max(AS_MUCH * (base.rms - least));
    fitted.retain(|(_, tried)| tried.rms <= as_good);
    fitted.sort_by_key(|(term, _)| term.complexity());
    Ok(fitted)
}

/// The laws less those without which the others leave about as little.
fn without_idle(setting: &Setting<'_>, mut laws: Laws) -> Result<Laws, DiagnosisError> {
    let least = laws.tried.rms;
    for index in (0..laws.terms.len()).rev() {
        if laws.terms.len() < 2 || setting.is_over() {
            break;
        }
        let place = laws.tried.fitted.point.hypothesis.members.len() - laws.terms.len() + index;
        let Some(fewer) = without(setting, &laws.tried, place, None)? else { continue };
        if part_cut(&fewer, least) < LEAST_PART {
            // They were fitted in the place of the last one.
            if index + 1 == laws.terms.len() {
                laws.rivals.clear();
            }
            laws.terms.remove(index);
            laws.tried = fewer;
        }
    }
    Ok(laws)
}

/// The fit without a member; `instead` is a correction that takes its place.
pub(crate) fn without(
    setting: &Setting<'_>,
    tried: &Tried,
    place: usize,
    instead: Option<&Correction>,
) -> Result<Option<Tried>, DiagnosisError> {
    let point = &tried.fitted.point;
    let mut hypothesis = point.hypothesis.without(place);
    hypothesis.corrections.extend(instead.cloned());
    let begin = Point { hypothesis, starts: point.starts.clone() };
    if_possible(Tried::from(setting, begin, STEPS))
}

/// The part of the mean square without something that is cut by it, down to the RMS `least`.
pub(crate) fn part_cut(without: &Tried, least: f64) -> f64 {
    1.0 - (least / without.rms).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_term_is_screened_once_and_few_columns_at_a_time() {
        let harmonic = Term { acts_on: ActsOn::Torque, factors: vec![Factor::harmonic(1)] };
        let saturating = Term { acts_on: ActsOn::Level, factors: vec![Factor::saturating(1.0)] };
        for count in [0, 1, 9, 10, 57] {
            let terms: Vec<Term> =
                [&harmonic, &saturating].into_iter().cycle().take(count).cloned().collect();
            let chunks = chunks(&terms);
            assert_eq!(chunks.concat(), terms);
            for chunk in chunks {
                let columns: usize = chunk.iter().map(Term::columns).sum();
                let last = chunk.last().map_or(0, Term::columns);
                assert!(columns - last < AT_ONCE && last > 0, "{columns}");
            }
        }
    }
}
