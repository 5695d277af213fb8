//! Where an expression has no finite value, found by intervals: the range of the variables is halved until each part is sure to
//! be sound, or is as small as a pole is looked for.

use crate::interval::Interval;
use crate::program::Program;

/// A range is halved so often at most.
const HALVINGS: u32 = 14;
/// Parts that are looked at, at most; beyond it the rest counts as sound.
const MOST_PARTS: usize = 20_000;

/// Where an expression may have no finite value.
#[derive(Debug, Clone, PartialEq)]
pub struct Pole {
    /// Characters before the operation in the text.
    pub at: usize,
    /// The middle of the part where that is, for each variable.
    pub near: Vec<f64>,
}

/// A part of the ranges, and how often each was halved.
#[derive(Clone)]
struct Part {
    ranges: Vec<Interval>,
    halvings: Vec<u32>,
}

/// Where the program has no finite value while its variables are within their ranges; `None` where it has one throughout.
///
/// It may name a place without a pole, if the expression comes so near to one that intervals can't tell.
pub fn pole(program: &Program, ranges: &[(f64, f64)]) -> Option<Pole> {
    let whole = ranges.iter().map(|(low, high)| Interval::new(*low, *high)).collect();
    let mut open = vec![Part { ranges: whole, halvings: vec![0; ranges.len()] }];
    for _ in 0..MOST_PARTS {
        let part = open.pop()?;
        let Some(at) = unsound(program, &part.ranges) else { continue };
        let Some(widest) = widest(program, &part) else {
            let near = part.ranges.iter().map(|range| 0.5 * (range.low + range.high)).collect();
            return Some(Pole { at, near });
        };
        open.extend(halves(part, widest));
    }
    None
}

/// The place of the first operation that might have no finite value.
fn unsound(program: &Program, ranges: &[Interval]) -> Option<usize> {
    let mut first = None;
    program.run_watched(ranges, |index, made: Interval| {
        if first.is_none() && !made.is_sound() {
            first = Some(index);
        }
    });
    first.map(|index| program.places.get(index).map_or(0, |at| usize::from(*at)))
}

/// The variable that was halved least among those that the program uses.
fn widest(program: &Program, part: &Part) -> Option<usize> {
    let open = part.halvings.iter().enumerate().filter(|(_, count)| **count < HALVINGS);
    open.filter(|(place, _)| program.uses(*place)).min_by_key(|(_, count)| **count).map(|(place, _)| place)
}

fn halves(part: Part, place: usize) -> [Part; 2] {
    let mut halves = [part.clone(), part];
    for (upper, half) in [false, true].into_iter().zip(&mut halves) {
        if let (Some(range), Some(count)) = (half.ranges.get_mut(place), half.halvings.get_mut(place)) {
            // Not at the middle, where people put corners and zeros.
            let cut = range.low + 0.487 * (range.high - range.low);
            *range = if upper { Interval::new(cut, range.high) } else { Interval::new(range.low, cut) };
            *count += 1;
        }
    }
    halves
}
