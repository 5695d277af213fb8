//! The numbers that are free already when candidates are screened, and what those at their bounds may do.

use crate::extend::hypothesis::Hypothesis;
use crate::numerics::gram::{Gram, solve};
use valve_model::EffectId;

/// What the screening lets numbers do that are at their bounds. None moves on: that would promise what no fit can keep, and leave nothing to
/// any candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AtBounds {
    /// They stay, as beside a cause: it is what they were moved for that it competes with.
    Stay,
    /// They come back beside a candidate that does better what they were moved for, as a law does that no cause came near.
    ComeBack,
}

/// The columns of the numbers that are free already.
pub(crate) struct Own {
    pub columns: Vec<usize>,
    /// Those at their bounds that may come back.
    at_bound: Vec<AtBound>,
}

struct AtBound {
    column: usize,
    /// The sign of the changes that it can't make.
    outward: f64,
    of: Option<EffectId>,
}

impl Own {
    /// Of the first `width` numbers of a hypothesis.
    pub fn of(hypothesis: &Hypothesis, width: usize, at_bounds: AtBounds) -> Self {
        let (mut columns, mut at_bound) = (Vec::new(), Vec::new());
        for (column, free) in hypothesis.free().into_iter().take(width).enumerate() {
            match hypothesis.outward(free) {
                None => columns.push(column),
                Some(outward) if at_bounds == AtBounds::ComeBack => {
                    at_bound.push(AtBound { column, outward, of: hypothesis.id_of(free) });
                }
                Some(_) => {}
            }
        }
        Self { columns, at_bound }
    }

    /// With those at their bounds that come back beside the columns of a candidate, in the optimum by the normal equations `total`. A number
    /// that the candidate itself is does not.
    pub fn beside(&self, total: &Gram, candidate: EffectId, columns: &[usize]) -> Vec<usize> {
        let mut back: Vec<&AtBound> = self.at_bound.iter().filter(|of| of.of != Some(candidate)).collect();
        while !back.is_empty() {
            let own = || self.columns.iter().copied().chain(back.iter().map(|of| of.column));
            let all: Vec<usize> = own().chain(columns.iter().copied()).collect();
            let Some((beta, _)) = solve(total, &all) else { break };
            let moved = beta.iter().skip(self.columns.len());
            let comes_back: Vec<bool> =
                back.iter().zip(moved).map(|(of, change)| change * of.outward < 0.0).collect();
            if comes_back.iter().all(|back| *back) {
                return own().collect();
            }
            let mut kept = comes_back.into_iter();
            back.retain(|_| kept.next() == Some(true));
        }
        self.columns.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// A number at its upper bound (column 0), a candidate that does much the same (1), and a residual of so much of either.
    fn beside(of_number: f64, of_candidate: f64, candidate: EffectId) -> Vec<usize> {
        let rows = DMatrix::from_fn(60, 3, |row, column| {
            let at = 0.1 * row as f64;
            let (number, law) = (at.sin(), at.sin() + 0.5 * at.cos());
            match column {
                0 => number,
                1 => law,
                _ => of_number * number + of_candidate * law,
            }
        });
        let total = Gram { matrix: rows.tr_mul(&rows), count: 60.0 };
        let number = AtBound { column: 0, outward: 1.0, of: Some(EffectId::ViscousLevel) };
        let own = Own { columns: Vec::new(), at_bound: vec![number] };
        own.beside(&total, candidate, &[1])
    }

    #[test]
    fn a_number_comes_back_beside_what_does_better_and_never_moves_on() {
        let none: Vec<usize> = Vec::new();
        assert_eq!(beside(-1.0, 2.0, EffectId::FlowTorque), [0], "it was moved too far for want of the law");
        assert_eq!(beside(1.0, 2.0, EffectId::FlowTorque), none, "more of it is wanted");
        assert_eq!(beside(-1.0, 2.0, EffectId::ViscousLevel), none, "the candidate is that number");
    }
}
