//! Conditions that a log goes through once: then nothing in it tells what goes by them from what goes by the time.

use crate::log::campaign::Campaign;
use crate::log::driven::Driven;
use crate::show::conditions::mean_in_run;
use crate::unnamed::library::drifts;
use crate::unnamed::term::Term;

/// A level that is nearer to an earlier one than this part of the range is the same again.
const SAME_PART: f64 = 0.1;

/// Whether a law goes by what only grows while the log is made.
pub(crate) fn goes_by_time(term: &Term) -> bool {
    term.covariates().any(drifts)
}

/// The conditions, as the tests of a residual call them, that only rose, or only fell, from run to run.
pub(crate) fn passed_once(campaign: &Campaign) -> Vec<&'static str> {
    let once = |of: fn(&Driven) -> &[f64]| goes_one_way(&levels(campaign, of));
    let conditions = [("pressure", once(Driven::pressure_pa)), ("temperature", once(Driven::temperature_c))];
    conditions.into_iter().filter(|(_, once)| *once).map(|(name, _)| name).collect()
}

/// The mean of a condition in each run that has it, in the runs' order.
fn levels(campaign: &Campaign, of: fn(&Driven) -> &[f64]) -> Vec<f64> {
    (0..campaign.runs.len()).filter_map(|run| mean_in_run(campaign, run, of)).collect()
}

/// Whether levels change, and never come back.
fn goes_one_way(levels: &[f64]) -> bool {
    let never_falls = |levels: &[f64]| {
        let (least, most) = levels
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), of| (of.min(least), of.max(most)));
        let mut reached = f64::NEG_INFINITY;
        let falls = levels.iter().any(|level| {
            reached = reached.max(*level);
            reached - level > SAME_PART * (most - least)
        });
        most > least && !falls
    };
    let turned: Vec<f64> = levels.iter().map(|level| -level).collect();
    never_falls(levels) || never_falls(&turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_back_is_not_passed_once() {
        for (levels, once) in [
            (&[1.0, 2.0, 3.0, 5.0][..], true),
            (&[5.0, 3.0, 3.0, 1.0], true),
            (&[1.0, 1.02, 1.0, 5.0], true),
            (&[1.0, 5.0, 1.0], false),
            (&[1.0, 3.0, 2.0, 5.0], false),
            (&[4.0, 4.0, 4.0], false),
            (&[], false),
        ] {
            assert_eq!(goes_one_way(levels), once, "{levels:?}");
        }
    }
}
