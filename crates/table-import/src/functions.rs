//! Functions of a whole column: what a row's own numbers don't tell, such as an integral over time.

use crate::filter::{bridged, low_pass};
use anyhow::{anyhow, bail, ensure};
use std::f64::consts::TAU;

/// A function of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Function {
    Integral,
    Derivative,
    Difference,
    Unwrap,
    LowPass,
    Fill,
    Hold,
    Shift,
    Mean,
    Median,
    First,
    Last,
}

use Function::{
    Derivative, Difference, Fill, First, Hold, Integral, Last, LowPass, Mean, Median, Shift, Unwrap,
};

/// Names, how many numbers may follow the column, and what `--help` says.
const FUNCTIONS: &[(&str, Function, std::ops::RangeInclusive<usize>, &str)] = &[
    ("integral", Integral, 0..=0, "integral(x): over time (trapezoids), from 0 at the first row"),
    ("derivative", Derivative, 0..=0, "derivative(x): by time, from the rows before and after"),
    ("difference", Difference, 0..=0, "difference(x): from the row before"),
    (
        "unwrap",
        Unwrap,
        0..=1,
        "unwrap(x), unwrap(x, period): an angle that folds over, unfolded; period 2*pi",
    ),
    (
        "lowpass",
        LowPass,
        1..=1,
        "lowpass(x, hz): Butterworth, forwards and backwards: no delay, half is left at hz",
    ),
    ("fill", Fill, 0..=0, "fill(x): missing samples on the straight line between their neighbours"),
    ("hold", Hold, 0..=0, "hold(x): missing samples as the last one before them"),
    ("shift", Shift, 1..=1, "shift(x, n): n rows later; negative n: earlier"),
    ("mean", Mean, 0..=0, "mean(x), median(x): of all rows taken"),
    ("median", Median, 0..=0, ""),
    ("first", First, 0..=0, "first(x), last(x): that is not missing"),
    ("last", Last, 0..=0, ""),
];

/// Functions and operators as `--help` lists them.
pub fn functions_help() -> String {
    let mut text = "\
In expressions:
  + - * / ^ ( ), 1.5e3, pi, row (from 0); columns by name, c1 to cN, or {any name at all}
  < <= > >= == != && ||          1 where it holds, else 0; for --where
  abs sqrt exp ln log10 sin cos tan asin acos atan atan2(y, x) min(a, b) max(a, b) floor ceil round signum
Functions of a whole column:
"
    .to_owned();
    for line in FUNCTIONS.iter().map(|(.., help)| *help).filter(|help| !help.is_empty()) {
        text.push_str("  ");
        text.push_str(line);
        text.push('\n');
    }
    text
}

impl Function {
    /// The function of this name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        FUNCTIONS.iter().find(|(known, ..)| *known == name).map(|(_, function, ..)| *function)
    }

    /// Whether it needs the rows' times.
    pub(crate) fn needs_time(self) -> bool {
        matches!(self, Integral | Derivative | LowPass)
    }

    /// Checks the numbers behind the column.
    pub(crate) fn check(self, numbers: &[f64]) -> Result<(), String> {
        let Some((name, _, count, _)) = FUNCTIONS.iter().find(|(_, function, ..)| *function == self) else {
            return Ok(());
        };
        if !count.contains(&numbers.len()) {
            return Err(format!(
                "{name}: {} numbers behind the column, expected {}",
                numbers.len(),
                count.end()
            ));
        }
        match (self, numbers) {
            (Shift, [rows]) if rows.fract() != 0.0 => Err(format!("shift: {rows}, expected whole rows")),
            (LowPass, [hz]) | (Unwrap, [hz]) if !(hz.is_finite() && *hz > 0.0) => {
                Err(format!("{name}: {hz}, expected a number above zero"))
            }
            _ => Ok(()),
        }
    }

    /// The function of all rows. `time_s` is there for those that need it.
    ///
    /// # Errors
    /// No time to refer to, or a corner that the sampling doesn't carry.
    pub(crate) fn of(
        self,
        values: Vec<f64>,
        numbers: &[f64],
        time_s: Option<&[f64]>,
    ) -> anyhow::Result<Vec<f64>> {
        let number = numbers.first().copied();
        let time = || time_s.ok_or_else(|| anyhow!("needs --map time, and can't stand in it"));
        let constant = |value: f64| vec![value; values.len()];
        Ok(match self {
            Integral => integral(&values, time()?),
            Derivative => derivative(&values, time()?),
            Difference => difference(&values),
            Unwrap => unwrap(values, number.unwrap_or(TAU)),
            LowPass => filtered(&values, time()?, number.unwrap_or(f64::NAN))?,
            Fill => bridged(&values),
            Hold => hold(values),
            Shift => shifted(&values, number.unwrap_or(0.0)),
            Mean => constant(mean(&values)),
            Median => constant(median(&values)),
            First => constant(known(&values).next().unwrap_or(f64::NAN)),
            Last => constant(known(&values).last().unwrap_or(f64::NAN)),
        })
    }
}

fn known(values: &[f64]) -> impl Iterator<Item = f64> {
    values.iter().copied().filter(|value| !value.is_nan())
}

fn mean(values: &[f64]) -> f64 {
    let (sum, count) = known(values).fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

fn median(values: &[f64]) -> f64 {
    log_data::median(&mut known(values).collect::<Vec<f64>>()).unwrap_or(f64::NAN)
}

/// A row whose sample is missing lies on the trapezoid across the gap.
fn integral(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let bridged = bridged(values);
    let (mut sum, mut before) = (0.0, None);
    let step = |(value, time): (&f64, &f64)| {
        if let Some((value_before, time_before)) = before.replace((*value, *time)) {
            sum += 0.5 * (value + value_before) * (time - time_before);
        }
        sum
    };
    bridged.iter().zip(time_s).map(step).collect()
}

/// At the ends from the one neighbour; missing beside a missing sample.
fn derivative(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let at = |index: usize| (values.get(index).copied(), time_s.get(index).copied());
    let slope = |from: usize, to: usize| match (at(from), at(to)) {
        ((Some(a), Some(from_s)), (Some(b), Some(to_s))) => (b - a) / (to_s - from_s),
        _ => f64::NAN,
    };
    let last = values.len().saturating_sub(1);
    (0..values.len()).map(|index| slope(index.saturating_sub(1), (index + 1).min(last))).collect()
}

fn difference(values: &[f64]) -> Vec<f64> {
    let before = std::iter::once(f64::NAN).chain(values.iter().copied());
    values.iter().zip(before).map(|(value, before)| value - before).collect()
}

fn unwrap(mut values: Vec<f64>, period: f64) -> Vec<f64> {
    let (mut turns, mut before) = (0.0, f64::NAN);
    for value in &mut values {
        if !value.is_nan() {
            // The first comparison is with NaN, which rounds to NaN and so counts as no turn.
            let jumped = ((*value - before) / period).round();
            turns -= if jumped.is_nan() { 0.0 } else { jumped };
            before = *value;
            *value += turns * period;
        }
    }
    values
}

fn hold(mut values: Vec<f64>) -> Vec<f64> {
    let mut last = f64::NAN;
    for value in &mut values {
        last = if value.is_nan() { last } else { *value };
        *value = last;
    }
    values
}

fn shifted(values: &[f64], rows: f64) -> Vec<f64> {
    let from = |index: usize| {
        let from = index as f64 - rows;
        (from >= 0.0).then(|| values.get(from as usize).copied()).flatten().unwrap_or(f64::NAN)
    };
    (0..values.len()).map(from).collect()
}

fn filtered(values: &[f64], time_s: &[f64], corner_hz: f64) -> anyhow::Result<Vec<f64>> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return Ok(Vec::new()) };
    let steps = time_s.len().saturating_sub(1) as f64;
    if steps < 1.0 {
        bail!("lowpass: 1 row, expected more");
    }
    let rate_hz = steps / (last - first);
    ensure!(
        corner_hz < 0.5 * rate_hz,
        "lowpass: {corner_hz} Hz, expected less than half of the sampling rate, {rate_hz} Hz"
    );
    Ok(low_pass(values, corner_hz / rate_hz))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, values: &[f64], numbers: &[f64]) -> Vec<f64> {
        let time_s: Vec<f64> = (0..values.len()).map(|k| 0.5 * k as f64).collect();
        Function::named(name).unwrap().of(values.to_vec(), numbers, Some(&time_s)).unwrap()
    }

    #[test]
    fn each_function_of_a_short_column() {
        let gap = f64::NAN;
        let same = |found: Vec<f64>, expected: &[f64]| {
            assert_eq!(format!("{found:?}"), format!("{expected:?}"));
        };
        same(of("integral", &[1.0, 3.0, gap, 7.0], &[]), &[0.0, 1.0, 3.0, 6.0]);
        same(of("derivative", &[1.0, 2.0, 5.0], &[]), &[2.0, 4.0, 6.0]);
        same(of("difference", &[1.0, 2.0, 5.0], &[]), &[gap, 1.0, 3.0]);
        same(of("unwrap", &[170.0, -170.0, gap, -10.0, 160.0], &[360.0]), &[170.0, 190.0, gap, 350.0, 520.0]);
        same(of("fill", &[1.0, gap, 3.0], &[]), &[1.0, 2.0, 3.0]);
        same(of("hold", &[gap, 1.0, gap, 3.0], &[]), &[gap, 1.0, 1.0, 3.0]);
        same(of("shift", &[1.0, 2.0, 3.0], &[1.0]), &[gap, 1.0, 2.0]);
        same(of("shift", &[1.0, 2.0, 3.0], &[-2.0]), &[3.0, gap, gap]);
        same(of("mean", &[1.0, gap, 3.0], &[]), &[2.0, 2.0, 2.0]);
        same(of("median", &[9.0, gap, 3.0, 4.0], &[]), &[4.0; 4]);
        same(of("first", &[gap, 2.0, 3.0], &[]), &[2.0; 3]);
        same(of("last", &[1.0, 2.0, gap], &[]), &[2.0; 3]);
    }

    #[test]
    fn what_can_not_be() {
        let low_pass = Function::named("lowpass").unwrap();
        assert!(low_pass.check(&[]).is_err() && low_pass.check(&[-1.0]).is_err());
        let error = low_pass.of(vec![1.0; 4], &[1.0], Some(&[0.0, 0.5, 1.0, 1.5])).unwrap_err();
        assert!(error.to_string().contains("half of the sampling rate, 2 Hz"), "{error}");
        assert!(Function::named("shift").unwrap().check(&[0.5]).is_err());
        assert!(Function::named("integral").unwrap().of(vec![1.0], &[], None).is_err());
    }
}
