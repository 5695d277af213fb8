//! The gain of the accepted causes on held-out runs, with a confidence interval from a bootstrap over runs.

use crate::fit::equations::Setting;
use crate::outcome::Gain;
use crate::show::residual::{PieceResidual, rms_as_fitted, rms_of, squares, squares_as_fitted};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Draws of the bootstrap.
const DRAWS: usize = 2000;

/// The gain on held-out runs.
pub(crate) fn gain(
    setting: &Setting<'_>,
    before: &[PieceResidual],
    after: &[PieceResidual],
    seed: u64,
) -> Gain {
    let wanted = setting.campaign.judges();
    let over_noise = |left: &[PieceResidual]| rms_as_fitted(setting, left, &wanted);
    let (over_noise_before, over_noise_after) = (over_noise(before), over_noise(after));
    let (before, after) = (squares(setting, before, &wanted), squares(setting, after, &wanted));
    let (rms_before, rms_after) = (rms_of(&before), rms_of(&after));
    let Part { ratio, ci95: ratio_ci95 } = part_left(&before, &after, seed);
    Gain {
        held_out_runs: setting.campaign.held_out(),
        rms_before,
        rms_after,
        over_noise_before,
        over_noise_after,
        ratio,
        ratio_ci95,
        closed_loop: None,
        unnamed: None,
    }
}

/// The part of an error that is left, and its 95 % interval.
pub(crate) struct Part {
    pub ratio: f64,
    pub ci95: [f64; 2],
}

/// The part of the error on held-out runs that is left, each sample counted by how well it is known.
pub(crate) fn part_left_as_fitted(
    setting: &Setting<'_>,
    before: &[PieceResidual],
    after: &[PieceResidual],
    seed: u64,
) -> Part {
    let wanted = setting.campaign.judges();
    let squares = |left: &[PieceResidual]| squares_as_fitted(setting, left, &wanted);
    part_left(&squares(before), &squares(after), seed)
}

/// The root of the ratio of two sums of squares over groups, with an interval from a bootstrap over the groups.
fn part_left(before: &[(f64, f64)], after: &[(f64, f64)], seed: u64) -> Part {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut ratios: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (mut one, mut two) = (0.0, 0.0);
            for _ in 0..before.len() {
                let drawn = random.random_range(0..before.len());
                one += before.get(drawn).map_or(0.0, |group| group.0);
                two += after.get(drawn).map_or(0.0, |group| group.0);
            }
            ratio(two.sqrt(), one.sqrt())
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    let at =
        |part: f64| ratios.get((part * (DRAWS - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN);
    let ratio = ratio(rms_of(after), rms_of(before));
    Part { ratio, ci95: [at(0.025).min(ratio), at(0.975).max(ratio)] }
}

fn ratio(after: f64, before: f64) -> f64 {
    if before > 0.0 { after / before } else { 1.0 }
}
