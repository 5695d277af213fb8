//! A pattern search (Hooke and Jeeves, J. ACM 8, 1961) over the numbers of one cause, for losses so rough that slopes are useless,
//! as with stick-slip.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::Free;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, POOR, loss_at};
use crate::log::piece::Piece;
use crate::numerics::loss::Loss;

/// Pattern sizes, in finite-difference steps of each number.
const SIZES: [f64; 3] = [8.0, 4.0, 2.0];
/// Most numbers that are searched; more would take too long.
const MOST: usize = 3;
/// Most successive moves of one number.
const IN_A_ROW: usize = 4;

/// True if a fit of an angle log ended far above noise.
pub(crate) fn ended_poorly(setting: &Setting<'_>, fitted: &Fitted) -> bool {
    let count: f64 = fitted.groups.iter().map(|group| group.count).sum();
    setting.loss() == Loss::OwnNoise && fitted.loss > (1.0 + POOR) * count
}

/// A point with better numbers of one member than a fit that ended far above noise; `None` if there is none, or the fit is good.
pub(crate) fn search(
    setting: &Setting<'_>,
    fitted: &Fitted,
    member: usize,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Option<Point>, DiagnosisError> {
    let of_member = |free: &Free| matches!(free, Free::Number(of, _) if *of == member);
    let numbers: Vec<Free> = fitted.point.hypothesis.free().into_iter().filter(of_member).collect();
    if !ended_poorly(setting, fitted) || numbers.is_empty() || numbers.len() > MOST || setting.is_over() {
        return Ok(None);
    }
    let (mut best, mut least) = (fitted.point.clone(), fitted.loss);
    for size in SIZES {
        for free in numbers.iter().filter(|_| !setting.is_over()) {
            for way in [size, -size] {
                let before = least;
                for _ in 0..IN_A_ROW {
                    let Some(hypothesis) = moved(&best, *free, way) else { break };
                    match if_possible(loss_at(setting, &best, hypothesis, wanted))? {
                        Some((trial, loss)) if loss < least => (best, least) = (trial, loss),
                        _ => break,
                    }
                }
                if least < before {
                    break;
                }
            }
        }
    }
    Ok((least < fitted.loss).then_some(best))
}

/// The hypothesis with one number moved by `steps` of its finite-difference step; `None` if it is at a bound.
fn moved(point: &Point, free: Free, steps: f64) -> Option<crate::extend::hypothesis::Hypothesis> {
    let mut there = point.hypothesis.clone();
    let at = there.get(free);
    there.set(free, at + steps * there.step(free).abs());
    (there.get(free) != at).then_some(there)
}
