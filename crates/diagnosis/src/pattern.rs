//! A pattern search (Hooke and Jeeves, J. ACM 8, 1961) over the numbers of the cause that came last: on a floor so rough that
//! slopes say nothing, as where a rotor sticks and slips, what counts is whether a point is better.

use crate::DiagnosisError;
use crate::fit::{Fitted, POOR, loss_at};
use crate::hypothesis::Free;
use crate::linear::{Point, Setting};
use crate::loss::Loss;
use crate::piece::Piece;

/// Sizes of the pattern, in steps of each number.
const SIZES: [f64; 3] = [8.0, 4.0, 2.0];
/// A pattern over more numbers than this would take too long.
const MOST: usize = 3;
/// Moves of one number in a row.
const IN_A_ROW: usize = 4;

/// A better point than where a fit ended with much left; `None` where there is none, or little is left.
pub(crate) fn search(
    setting: &Setting<'_>,
    fitted: &Fitted,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Option<Point>, DiagnosisError> {
    let count: f64 = fitted.groups.iter().map(|group| group.count).sum();
    let numbers = numbers_of_last(&fitted.point);
    let rough = Loss::of(setting) == Loss::OwnNoise && fitted.loss > (1.0 + POOR) * count;
    if !rough || numbers.is_empty() || numbers.len() > MOST {
        return Ok(None);
    }
    let (mut best, mut least) = (fitted.point.clone(), fitted.loss);
    for size in SIZES {
        for free in &numbers {
            for way in [size, -size] {
                let before = least;
                for _ in 0..IN_A_ROW {
                    let Some(hypothesis) = moved(&best, *free, way) else { break };
                    let (trial, loss) = loss_at(setting, &best, hypothesis, wanted)?;
                    if loss >= least {
                        break;
                    }
                    (best, least) = (trial, loss);
                }
                if least < before {
                    break;
                }
            }
        }
    }
    Ok((least < fitted.loss).then_some(best))
}

fn numbers_of_last(point: &Point) -> Vec<Free> {
    let last = point.hypothesis.members.len().checked_sub(1);
    let of_last = |free: &Free| matches!(free, Free::Number(member, _) if Some(*member) == last);
    point.hypothesis.free().into_iter().filter(of_last).collect()
}

/// The hypothesis with one number moved by so many of its steps; `None` where its bound is in the way.
fn moved(point: &Point, free: Free, steps: f64) -> Option<crate::hypothesis::Hypothesis> {
    let mut there = point.hypothesis.clone();
    let at = there.get(free);
    there.set(free, at + steps * there.step(free).abs());
    (there.get(free) != at).then_some(there)
}
