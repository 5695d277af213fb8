//! Inputs of a judgement.

use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Correction;
use crate::fit::equations::Point;

/// Inputs of a judgement: the start of a fit, the corrections that are allowed, and the causes that can be tested.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub first: &'a Point,
    pub corrections: &'a [Correction],
    pub able: &'a [Candidate],
    pub seed: u64,
}
