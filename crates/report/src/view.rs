//! What a plot shows at first where a few wild values would flatten all others.

use crate::html::{grouped, number};

/// At most this part of the values may be left out, half of it on either side.
const LEFT_OUT: f64 = 0.01;
/// Values are left out where the axis would be so many times as long with them.
const FLATTENED: f64 = 3.0;
/// Room above and below what the rest spans, in parts of that.
const ROOM: f64 = 0.25;
/// Fewer values are all shown.
const LEAST: usize = 200;

/// A part of the y axis, and what lies outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    pub(crate) low: f64,
    pub(crate) high: f64,
    outside: usize,
    of: usize,
    least: f64,
    most: f64,
}

/// The part of the axis to show at first; `None` where no value would flatten the others.
pub(crate) fn view(values: impl Iterator<Item = f64>) -> Option<View> {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if finite.len() < LEAST {
        return None;
    }
    finite.sort_by(f64::total_cmp);
    let at = |part: f64| finite.get((part * (finite.len() - 1) as f64).round() as usize).copied();
    let (least, most) = (at(0.0)?, at(1.0)?);
    let (low, high) = (at(LEFT_OUT / 2.0)?, at(1.0 - LEFT_OUT / 2.0)?);
    let room = ROOM * (high - low);
    let (low, high) = ((low - room).max(least), (high + room).min(most));
    if high <= low || most - least < FLATTENED * (high - low) {
        return None;
    }
    let outside = finite.iter().filter(|value| **value < low || **value > high).count();
    Some(View { low, high, outside, of: finite.len(), least, most })
}

impl View {
    /// What is left out, in words.
    pub(crate) fn note(&self, unit: &str) -> String {
        let (points, lie) = if self.outside == 1 { ("point", "lies") } else { ("points", "lie") };
        format!(
            "{} of {} {points} {lie} outside the picture, which would reach from {} to {} {unit}: a double click shows all.",
            grouped(self.outside),
            grouped(self.of),
            number(self.least),
            number(self.most)
        )
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_few_wild_values_are_left_out_and_told() {
        let tame = || (0..1000).map(|k| f64::from(k % 20) / 10.0 - 1.0);
        assert_eq!(view(tame()), None);
        let found = view(tame().chain([80.0, -300.0])).unwrap();
        assert!(found.low >= -1.5 && found.high <= 1.5, "{found:?}");
        assert!(
            found.note("N·m").starts_with("2 of 1\u{202f}002 points lie outside"),
            "{}",
            found.note("N·m")
        );
        // A tenth of all is no outlier, and few points are all shown.
        assert_eq!(view(tame().chain((0..100).map(|_| 80.0))), None);
        assert_eq!(view((0..50).map(f64::from).chain([1e9])), None);
        // A channel that holds still but for some samples is shown whole: there is no other span.
        assert_eq!(view((0..1000).map(|k| if k == 3 { 1.0 } else { 0.0 })), None);
    }
}
