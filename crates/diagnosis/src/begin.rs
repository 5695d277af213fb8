//! How a campaign begins: the first states of its pieces, and a model that predicts numbers.

use crate::DiagnosisError;
use crate::extend::hypothesis::Hypothesis;
use crate::fit::equations::Point;
use crate::log::campaign::Campaign;
use crate::log::ready::Ready;
use crate::workers::{Workers, map};
use log_data::AngleZero;

/// The given model, with each piece from its first state.
pub(crate) fn begin(campaign: &Campaign, ready: &Ready) -> Point {
    let common = campaign.angle_zero == Some(AngleZero::Common);
    let hypothesis = Hypothesis { zero_rad: common.then_some(0.0), ..Hypothesis::default() };
    Point { hypothesis, starts: campaign.pieces.iter().map(|piece| piece.first_start(ready)).collect() }
}

/// Refuses a model whose prediction is not finite.
pub(crate) fn check_finite(
    campaign: &Campaign,
    ready: &Ready,
    first: &Point,
    workers: &dyn Workers,
) -> Result<(), DiagnosisError> {
    let bad = map(workers, campaign.pieces.len(), |index| {
        let piece = campaign.pieces.get(index)?;
        let predicted = piece.predict(ready, first.start(index));
        let row = predicted.iter().position(|value| !value.is_finite())?;
        Some((piece.run, piece.rows.start + row + 1, predicted.get(row).copied().unwrap_or(f64::NAN)))
    });
    match bad.into_iter().flatten().next() {
        None => Ok(()),
        Some((run, row, found)) => Err(DiagnosisError::NotFinite {
            run: campaign.runs.get(run).map_or(String::new(), |run| run.0.clone()),
            row,
            channel: campaign.kind.channel,
            found,
        }),
    }
}
