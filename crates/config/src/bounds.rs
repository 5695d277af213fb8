//! The range a quantity may lie in, and how a message says it.

use crate::units::{Dimension, display_si};

/// Any angle of a scenario, rad.
pub(crate) const ANGLE: Bounds = Bounds::either_sign(1e6);

/// Any pressure drop of a scenario, Pa.
pub(crate) const PRESSURE: Bounds = Bounds::within(0.0, 1e8);

/// A range of values in SI; the lower end may be excluded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    lowest: f64,
    highest: f64,
    lowest_excluded: bool,
}

impl Bounds {
    /// From `lowest` to `highest`, both included.
    pub(crate) const fn within(lowest: f64, highest: f64) -> Self {
        Self { lowest, highest, lowest_excluded: false }
    }

    /// Above zero, up to `highest`.
    pub(crate) const fn positive(highest: f64) -> Self {
        Self { lowest: 0.0, highest, lowest_excluded: true }
    }

    /// From `-size` to `size`.
    pub(crate) const fn either_sign(size: f64) -> Self {
        Self::within(-size, size)
    }

    /// Whether a value lies in the range; never for NaN.
    pub(crate) fn contain(&self, value: f64) -> bool {
        let above = if self.lowest_excluded { value > self.lowest } else { value >= self.lowest };
        above && value <= self.highest
    }

    /// Its ends, and whether the lower one is excluded.
    pub(crate) fn ends(&self) -> (f64, f64, bool) {
        (self.lowest, self.highest, self.lowest_excluded)
    }

    /// "a time from 100 us to 10 ms".
    pub(crate) fn describe(&self, dimension: Dimension) -> String {
        // Those of angles and speeds are round in SI.
        let show = |value| match dimension {
            Dimension::Angle | Dimension::Speed => display_si(value, dimension),
            _ => dimension.display(value),
        };
        let (low, high) = (show(self.lowest), show(self.highest));
        if self.lowest_excluded {
            format!("{} above {low} and at most {high}", dimension.name())
        } else {
            format!("{} from {low} to {high}", dimension.name())
        }
    }
}
