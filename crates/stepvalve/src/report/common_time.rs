//! One time axis for two runs: the times of both, each time once.

/// Times closer than this are one: clocks of two runs agree no better.
const SAME_S: f64 = 1e-6;
/// Between samples that are further apart than so many times their usual distance there is a gap.
const GAP: f64 = 2.5;

/// Where a common time lies among a run's samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    /// The sample before or at it.
    row: usize,
    /// How far it is on the way to the next, 0 to 1.
    part: f64,
}

/// A run's samples on the common axis.
#[derive(Debug, PartialEq)]
pub struct Laid {
    places: Vec<Option<Place>>,
}

/// The times of both, ascending as they are themselves, and where each run's samples lie on them.
pub fn common(a: &[f64], b: &[f64]) -> (Vec<f64>, [Laid; 2]) {
    let (mut left, mut right) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    let mut times = Vec::with_capacity(a.len().max(b.len()));
    loop {
        let next = match (left.peek(), right.peek()) {
            (Some(x), Some(y)) => x.min(*y),
            (Some(one), None) | (None, Some(one)) => *one,
            (None, None) => break,
        };
        times.push(next);
        left.next_if(|time| *time - next <= SAME_S);
        right.next_if(|time| *time - next <= SAME_S);
    }
    let laid = [a, b].map(|own| lay(own, &times));
    (times, laid)
}

fn lay(own: &[f64], times: &[f64]) -> Laid {
    let gap_s = GAP * usual_distance(own);
    let mut row = 0;
    let places = times.iter().map(|time| {
        while own.get(row + 1).is_some_and(|next| *next <= *time + SAME_S) {
            row += 1;
        }
        let before = *own.get(row)?;
        if (time - before).abs() <= SAME_S {
            return Some(Place { row, part: 0.0 });
        }
        let distance = own.get(row + 1)? - before;
        (before < *time && distance <= gap_s).then(|| Place { row, part: (time - before) / distance })
    });
    Laid { places: places.collect() }
}

fn usual_distance(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.iter().zip(times.iter().skip(1)).map(|(a, b)| b - a).collect();
    log_data::median(&mut steps).unwrap_or(0.0)
}

impl Laid {
    /// A signal of the run on the common axis: its values, lines between them, NaN where the run has nothing.
    pub fn values<'a>(&'a self, own: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.places.iter().map(|place| {
            let Some(Place { row, part }) = *place else { return f64::NAN };
            let at = |row: usize| own.get(row).copied().unwrap_or(f64::NAN);
            if part == 0.0 { at(row) } else { (1.0 - part) * at(row) + part * at(row + 1) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_times_stay_as_they_are() {
        let time: Vec<f64> = (0..100).map(|k| f64::from(k) * 1e-3).collect();
        let near: Vec<f64> = time.iter().map(|t| t + 1e-10).collect();
        let (times, [a, b]) = common(&time, &near);
        assert_eq!(times, time);
        let own: Vec<f64> = (0..100).map(f64::from).collect();
        assert!(a.values(&own).eq(own.iter().copied()) && b.values(&own).eq(own.iter().copied()));
    }

    #[test]
    fn a_coarser_run_is_drawn_by_lines_and_a_gap_stays_one() {
        let fine: Vec<f64> = (0..13).map(f64::from).collect();
        let coarse = [0.0, 2.0, 4.0, 10.0, 12.0];
        let (times, [_, laid]) = common(&fine, &coarse);
        assert_eq!(times, fine);
        let found: Vec<f64> = laid.values(&[0.0, 20.0, 40.0, 100.0, 120.0]).collect();
        assert_eq!(found[..5], [0.0, 10.0, 20.0, 30.0, 40.0]);
        assert!(found[5..10].iter().all(|value| value.is_nan()), "{found:?}");
        assert_eq!(found[10..], [100.0, 110.0, 120.0]);
    }

    #[test]
    fn runs_that_do_not_meet_are_one_behind_the_other() {
        let (times, [a, b]) = common(&[0.0, 1.0], &[5.0, 6.0]);
        assert_eq!(times, [0.0, 1.0, 5.0, 6.0]);
        let nan = |values: Vec<f64>| values.iter().map(|value| value.is_nan()).collect::<Vec<_>>();
        assert_eq!(nan(a.values(&[1.0, 2.0]).collect()), [false, false, true, true]);
        assert_eq!(nan(b.values(&[1.0, 2.0]).collect()), [true, true, false, false]);
        assert!(common(&[], &[]).0.is_empty());
    }
}
