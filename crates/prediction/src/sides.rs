//! Where bristles with a memory may have come from before a run, of which no record tells.

/// In parts of the break-away deflection, if they were not relaxed.
pub(crate) const SIDES: [f64; 8] = [-1.0, 1.0, -0.5, 0.5, -0.75, 0.75, -0.25, 0.25];
/// Relaxed ones are given up where what others leave is clearly less.
const CLEARLY_LESS: f64 = 0.99;

/// The one of the others that leaves least, where that is clearly less than what relaxed bristles leave; else those.
pub(crate) fn clearer<T>(relaxed: T, others: impl Iterator<Item = T>, square: impl Fn(&T) -> f64) -> T {
    let other = others.min_by(|one, other| square(one).total_cmp(&square(other)));
    let clearer = other.filter(|other| square(other) < CLEARLY_LESS * square(&relaxed));
    clearer.unwrap_or(relaxed)
}
