//! Draws campaigns from seeds, each by its family.

use crate::campaign::Campaign;
use crate::hidden::{Family, Hidden};
use crate::ordered::OrderedRun;
use crate::{exact, real};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

impl Campaign {
    /// Draws a campaign; the same for the same seed and wish.
    pub fn draw(seed: u64, hidden: &Hidden) -> Self {
        Self::try_draw(seed, hidden)
            .unwrap_or_else(|| panic!("seed {seed}, {hidden:?}: the rotor loses steps whatever is drawn"))
    }

    /// The same; `None` where the rotor loses steps whatever is drawn.
    pub fn try_draw(seed: u64, hidden: &Hidden) -> Option<Self> {
        match hidden.family {
            Family::Exact => exact::try_draw(seed, hidden),
            Family::Real => real::try_draw(seed, hidden),
        }
    }
}

impl Campaign {
    /// The machine of a campaign of the exact family, with the runs of several orders made behind the campaign's own, one after the
    /// other. The log holds those of the last order.
    pub fn try_order(seed: u64, hidden: &Hidden, orders: &[Vec<OrderedRun>]) -> Option<Self> {
        match hidden.family {
            Family::Exact => exact::try_order(seed, hidden, orders),
            Family::Real => None,
        }
    }
}

/// The seed's own choice among some, for those who draw what to hide.
pub fn choose<T: Clone>(seed: u64, from: &[T]) -> T {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    from[rng.random_range(0..from.len())].clone()
}
