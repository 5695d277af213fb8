//! Lost steps in an angle log: where the rotor falls behind (or gets ahead) by whole tooth pitches, and stays there.

use crate::log::initial_state::InitialState;
use crate::log::piece::Piece;
use crate::log::ready::Ready;
use log_data::median;

/// A sample is after the jump if its residual is within this fraction of the jump from it. The jump must last to the piece's end.
const LEAST: f64 = 0.6;
/// How far the residual at the end may be from whole pitches, in pitches.
const WHOLE: f64 = 0.2;
/// Least number of samples after the jump.
const AFTER: usize = 20;

/// The sample at which a piece loses steps, and the jump, rad; `None` if it loses none.
pub(crate) fn find(piece: &Piece, ready: &Ready, pitch_rad: f64) -> Option<(usize, f64)> {
    let predicted = piece.predict(ready, InitialState::default());
    let residual: Vec<f64> =
        piece.measured.iter().zip(&predicted).map(|(measured, model)| measured - model).collect();
    let tail = residual.get(residual.len().saturating_sub(AFTER.max(residual.len() / 20))..)?;
    let off = median(&mut tail.to_vec())? / pitch_rad;
    let teeth = off.round();
    if teeth == 0.0 || (off - teeth).abs() > WHOLE {
        return None;
    }
    let jump = teeth * pitch_rad;
    // The last sample that doesn't show the jump.
    let last = residual.iter().rposition(|value| (value - jump).abs() > LEAST * jump.abs());
    let from = last.map_or(0, |last| last + 1);
    (residual.len() - from >= AFTER).then_some((from, jump))
}
