//! What a judgement begins with.

use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Correction;
use crate::fit::equations::Point;

/// What a judgement begins with: the start of a fit, the corrections that are allowed, and the causes that can be tested.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub first: &'a Point,
    pub corrections: &'a [Correction],
    pub able: &'a [Candidate],
    pub seed: u64,
}
