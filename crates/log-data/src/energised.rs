//! What of a recording of our own the model can predict: the rows in which the motor carries its whole current.

use crate::Run;

/// A stretch of fewer rows is not worth a run.
pub(crate) const LEAST_ROWS: usize = 50;

/// Cuts a run to the longest stretch in which its `command_energise` and `command_current_ratio`, where it has them, say that the
/// motor carries its whole current: a disarmed rotor goes where it likes.
pub fn cut_to_energised(run: &mut Run) {
    let of = |name: &str| run.extra(name).map(|extra| extra.values.as_slice());
    let Some(energised) = of("command_energise") else { return };
    let ratio = of("command_current_ratio");
    let whole = |row: usize| {
        let full = ratio.and_then(|ratio| ratio.get(row)).is_none_or(|ratio| *ratio == 1.0);
        energised.get(row) == Some(&1.0) && full
    };
    let missed = |row: usize| energised.get(row).is_some_and(|value| value.is_nan());
    let mut longest = 0..0;
    let mut stretch = 0..0;
    for row in 0..run.len() {
        if whole(row) || missed(row) && !stretch.is_empty() {
            stretch = if stretch.is_empty() { row..row + 1 } else { stretch.start..row + 1 };
            if stretch.len() > longest.len() {
                longest = stretch.clone();
            }
        } else {
            stretch = 0..0;
        }
    }
    if longest.len() >= LEAST_ROWS && longest.len() < run.len() {
        run.keep_rows(longest);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::Extra;

    #[test]
    fn what_is_disarmed_is_cut_off() {
        let mut run = Run {
            time_s: (0..200).map(f64::from).collect(),
            angle_rad: (0..200).map(f64::from).collect(),
            ..Run::default()
        };
        let whole = run.clone();
        cut_to_energised(&mut run);
        assert_eq!(run, whole);
        // A missed row in the midst of it, and nothing known of the first.
        let energised = |row: usize| match row {
            0 | 60 => f64::NAN,
            1..10 | 150.. => 0.0,
            _ => 1.0,
        };
        run.extra = vec![Extra {
            name: "command_energise".to_owned(),
            unit: "1".to_owned(),
            values: (0..200).map(energised).collect(),
        }];
        cut_to_energised(&mut run);
        assert_eq!((run.time_s[0], run.len()), (10.0, 140));
        assert_eq!(run.angle_rad.len(), 140);
    }
}
