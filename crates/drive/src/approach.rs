//! Closing a gap without overshoot, in discrete time: the largest travel per cycle from which the drive can still brake.
//!
//! If the drive travels w micro-steps in this cycle and at most A less in each following cycle, braking covers
//! S(w) = w + (w − A) + (w − 2A) + … (positive terms only). The travel chosen is the w with S(w) = gap. The drive then
//! decelerates at A per cycle and stops on the target.

/// The largest travel in this cycle, micro-steps, from which the drive can brake within `gap` (≥ 0, micro-steps) if its
/// travel shrinks by at most `max_change` (> 0, micro-steps) per cycle.
pub(crate) fn largest_approach(gap: f64, max_change: f64) -> f64 {
    // m terms of the sum are positive while A·m(m−1)/2 ≤ gap < A·m(m+1)/2.
    let terms = ((1.0 + (1.0 + 8.0 * gap / max_change).sqrt()) / 2.0).floor().max(1.0);
    (gap + max_change * terms * (terms - 1.0) / 2.0) / terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn braking_way(mut way: f64, max_change: f64) -> f64 {
        let mut sum = 0.0;
        while way > 0.0 {
            sum += way;
            way -= max_change;
        }
        sum
    }

    proptest! {
        #[test]
        fn braking_covers_exactly_the_gap(gap in 0.0..1e6_f64, max_change in 0.5..1e4_f64) {
            let way = largest_approach(gap, max_change);
            prop_assert!((braking_way(way, max_change) - gap).abs() <= 1e-9 * (1.0 + gap));
        }
    }
}
