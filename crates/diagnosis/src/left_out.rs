//! Pieces of a long log that are not fitted, but hold what the model does not say.

use crate::DiagnosisError;
use crate::begin::begin;
use crate::fit::equations::{Nuisances, Setting};
use crate::fit::gauss_newton::{fit, with_best_starts};
use crate::log::campaign::Campaign;
use crate::log::cut::{Choice, Place};
use crate::log::noise::estimate;
use crate::log::piece::Piece;
use crate::options::Options;
use crate::show::residual::left;
use crate::workers::Workers;
use log_data::{Log, median};
use std::collections::BTreeSet;
use valve_model::Model;

/// A piece stands out if its mean square, in the noise's, is so many times the largest of the quiet ones among those that are fitted. It decides
/// no verdict: what stands out is fitted too.
const STANDS_OUT: f64 = 1.2;
/// Quiet are those that hold at most so many times the noise's mean square. Where half of them hold more, what the model lacks acts nearly
/// everywhere, and a random sample shows it.
const QUIET: f64 = 2.0;
/// Most samples that are fitted beside the others because they stand out, in parts of these.
const AS_MANY: f64 = 0.5;

/// The pieces that hold more than those of `fitted` when `found` predicts them, the worst first as far as there is room. What acts seldom may be in
/// none of the pieces that were drawn.
pub(crate) fn stand_out(
    log: &Log,
    found: &Model,
    fitted: &BTreeSet<Place>,
    options: &Options,
    workers: &dyn Workers,
) -> Result<BTreeSet<Place>, DiagnosisError> {
    let mut campaign = Campaign::of(log, found, Choice::Predicted, (options.seed, workers))?;
    campaign.allow_all();
    let ready = campaign.ready(found)?;
    let first = begin(&campaign, &ready);
    estimate(&mut campaign, &ready, &first.starts, options, workers);
    let setting = Setting::new(&campaign, found, Nuisances::of(&campaign), workers);
    let all = |_: &Piece| true;
    let settled = fit(&setting, first, &all, campaign.kind.settling_steps)?.point;
    let settled = with_best_starts(&setting, &settled, &all)?;
    let left = left(&setting, &settled)?;
    let holds = campaign.pieces.iter().zip(&left).map(|(piece, left)| {
        let square: f64 = piece.in_deviations(&left.residual).iter().map(|value| value * value).sum();
        square / piece.count().max(1.0)
    });
    let pieces: Vec<(Place, f64, usize)> = campaign
        .places()
        .zip(holds)
        .zip(&campaign.pieces)
        .map(|((place, holds), piece)| (place, holds, piece.len()))
        .collect();
    Ok(worst(pieces, fitted))
}

fn worst(pieces: Vec<(Place, f64, usize)>, fitted: &BTreeSet<Place>) -> BTreeSet<Place> {
    let (known, mut others): (Vec<_>, Vec<_>) =
        pieces.into_iter().partition(|(place, ..)| fitted.contains(place));
    let holds: Vec<f64> = known.iter().map(|(_, holds, _)| *holds).collect();
    if median(&mut holds.clone()).is_none_or(|median| median > QUIET) {
        return BTreeSet::new();
    }
    let most = holds.into_iter().filter(|holds| *holds <= QUIET).fold(0.0, f64::max);
    let mut room = AS_MANY * known.iter().map(|(.., samples)| *samples as f64).sum::<f64>();
    others.retain(|(_, holds, _)| *holds > STANDS_OUT * most);
    others.sort_by(|a, b| b.1.total_cmp(&a.1));
    let fits = |(place, _, samples): (Place, f64, usize)| {
        room -= samples as f64;
        (room >= 0.0).then_some(place)
    };
    others.into_iter().map_while(fits).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::workers::OneAfterTheOther;
    use log_data::Run;
    use prediction::{Past, predict};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64Mcg;

    const RUNS: usize = 20;
    const NOISE_NM: f64 = 0.01;

    /// More torques than are fitted, each run another speed. In run `odd` something brakes for half a second.
    fn long(model: &Model, odd: Option<usize>) -> Log {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let noise = Normal::new(0.0, NOISE_NM).unwrap();
        let run = |number: usize| {
            let time_s: Vec<f64> = (0..8000).map(|k| 20.0 * number as f64 + 2e-3 * f64::from(k)).collect();
            let speed_rad_per_s = 0.5 + 0.02 * number as f64;
            let angle_rad = (0..8000).map(|k| 2e-3 * speed_rad_per_s * f64::from(k)).collect();
            let torque_nm = Some(vec![0.0; time_s.len()]);
            let mut run = Run { name: format!("{number}"), time_s, angle_rad, torque_nm, ..Run::default() };
            predict(&mut run, model, &Past::default()).unwrap();
            for (index, torque_nm) in run.torque_nm.iter_mut().flatten().enumerate() {
                let brakes = odd == Some(number) && (4000..4250).contains(&index);
                *torque_nm += noise.sample(&mut random) + if brakes { 20.0 * NOISE_NM } else { 0.0 };
            }
            run
        };
        Log { runs: (0..RUNS).map(run).collect(), ..Log::default() }
    }

    #[test]
    fn a_run_that_was_not_fitted_stands_out_where_something_acts_in_it_alone() {
        let model = fixtures::model(Vec::new());
        let fitted: BTreeSet<Place> = (0..RUNS).step_by(3).map(|run| (run, 0)).collect();
        let found = |odd: Option<usize>| {
            stand_out(&long(&model, odd), &model, &fitted, &Options::default(), &OneAfterTheOther).unwrap()
        };
        assert_eq!(found(None), BTreeSet::new());
        assert_eq!(found(Some(4)), BTreeSet::from([(4, 0)]));
        assert_eq!(found(Some(3)), BTreeSet::new(), "it is fitted already, and no measure of what is quiet");
    }

    #[test]
    fn the_worst_are_taken_as_far_as_there_is_room() {
        // What each piece holds, those that are fitted first; which of the others are taken.
        let table: [(&[f64], &[f64], &[usize]); 7] = [
            (&[1.0, 1.1, 0.9, 1.0], &[1.0, 1.3, 1.31], &[]),
            (&[1.0, 1.1, 0.9, 1.0], &[1.0, 1.4, 1.31], &[1]),
            (&[1.0, 1.1, 0.9, 1.0], &[5.0, 1.0, 6.0], &[0, 2]),
            (&[1.0, 1.1, 0.9, 1.0], &[5.0, 7.0, 6.0], &[1, 2]),
            (&[1.0, 9.0, 0.9, 1.0], &[1.0, 5.0, 1.0], &[1]),
            (&[5.0, 9.0, 6.0, 1.0], &[9.5, 10.0, 11.0], &[]),
            (&[], &[5.0, 6.0], &[]),
        ];
        for (known, others, expected) in table {
            let holds = known.iter().chain(others).enumerate();
            let pieces = holds.map(|(index, holds)| ((index, 0), *holds, 100)).collect();
            let fitted = (0..known.len()).map(|index| (index, 0)).collect();
            let expected: BTreeSet<Place> = expected.iter().map(|index| (known.len() + index, 0)).collect();
            assert_eq!(worst(pieces, &fitted), expected, "{known:?} {others:?}");
        }
    }
}
