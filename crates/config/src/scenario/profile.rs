//! A quantity against time: linear between points, constant before the first and after the last.

/// Points of a quantity against time.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Profile {
    /// Time in seconds, strictly increasing, and value in SI (degrees Celsius for temperatures); at least one.
    pub points: Vec<(f64, f64)>,
}

impl Profile {
    /// A quantity that never changes.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self { points: vec![(0.0, value)] }
    }

    /// The smallest magnitude that is not zero; `None` where all are.
    #[must_use]
    pub fn least_but_none(&self) -> Option<f64> {
        self.points.iter().map(|(_, value)| value.abs()).filter(|value| *value > 0.0).reduce(f64::min)
    }

    /// The value at a time in seconds; NaN only for a profile without points.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let next = self.points.partition_point(|point| point.0 <= time_s);
        let before = next.checked_sub(1).and_then(|index| self.points.get(index));
        match (before, self.points.get(next)) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * ((time_s - a.0) / (b.0 - a.0)),
            (Some(only), None) | (None, Some(only)) => only.1,
            (None, None) => f64::NAN,
        }
    }
}
