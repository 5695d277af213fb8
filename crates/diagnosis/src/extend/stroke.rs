//! Which harmonics of a turn can be told apart on a stroke.

use crate::log::facts::Facts;

/// Whether harmonics of these orders can be told apart on a stroke of this many turns. A function with orders up to k has 2kS + 1
/// independent values on S turns (Shannon); n orders have 2n coefficients. With more than that, harmonics cancel each other at
/// amplitudes that mean nothing. A single order has none to cancel it: on a short stroke it is a slope and a curvature.
pub(crate) fn tells_apart(orders: &[usize], turns: f64) -> bool {
    let highest = orders.iter().max().copied().unwrap_or(0) as f64;
    orders.len() == 1 || orders.len() as f64 <= highest * turns + 0.5
}

/// The span of the log's angle, in turns.
pub(crate) fn turns(facts: &Facts) -> f64 {
    ((facts.angle_rad.1 - facts.angle_rad.0) / std::f64::consts::TAU).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_turn_tells_half_the_orders_apart() {
        assert!(tells_apart(&[1], 0.5) && tells_apart(&[2], 0.5) && tells_apart(&[2, 4, 6], 0.5));
        assert!(!tells_apart(&[1, 2], 0.5) && !tells_apart(&[1, 2, 3, 4, 5], 0.5));
        assert!(tells_apart(&[1, 2, 3, 4, 5, 6], 1.0));
        assert!(tells_apart(&[1], 0.1) && !tells_apart(&[1, 3], 0.1));
    }
}
