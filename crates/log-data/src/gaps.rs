//! Missing samples: interpolated so that the motion goes on, and masked so that they have no weight.

use crate::{Channel, Log, MOST_MISSING, Run, lacking};
use std::borrow::Cow;

const CHANNELS: [Channel; 5] =
    [Channel::Angle, Channel::AngleCommand, Channel::Torque, Channel::PressureDrop, Channel::OilTemperature];

/// The log with its gaps bridged by straight lines, and for each run the samples that were interpolated in angle, command or torque: a
/// prediction follows these directly, or is compared with them. A channel that lacks more than [`MOST_MISSING`] is left as it is.
pub fn bridged(log: &Log) -> (Cow<'_, Log>, Vec<Vec<bool>>) {
    if !log.runs.iter().any(lacks) {
        return (Cow::Borrowed(log), vec![Vec::new(); log.runs.len()]);
    }
    let mut whole = log.clone();
    let masks = whole.runs.iter_mut().map(bridge).collect();
    (Cow::Owned(whole), masks)
}

/// One run, bridged alike.
pub fn bridged_run(run: &Run) -> Cow<'_, Run> {
    if !lacks(run) {
        return Cow::Borrowed(run);
    }
    let mut whole = run.clone();
    bridge(&mut whole);
    Cow::Owned(whole)
}

fn lacks(run: &Run) -> bool {
    CHANNELS.iter().any(|channel| lacking(run, *channel) > 0)
}

fn bridge(run: &mut Run) -> Vec<bool> {
    let mut mask = vec![false; run.len()];
    for channel in CHANNELS {
        let missing = lacking(run, channel);
        if missing == 0 || missing as f64 > MOST_MISSING * run.len() as f64 {
            continue;
        }
        let Some(mut values) = run.take_channel(channel) else { continue };
        let at_once = matches!(channel, Channel::Angle | Channel::AngleCommand | Channel::Torque);
        for (mask, value) in mask.iter_mut().zip(&values).filter(|_| at_once) {
            *mask |= value.is_nan();
        }
        fill(&run.time_s, &mut values);
        run.set_channel(channel, values);
    }
    mask
}

/// Interpolates linearly over the gaps; at the ends takes the nearest value.
fn fill(time_s: &[f64], values: &mut [f64]) {
    let known: Vec<(usize, f64)> =
        values.iter().copied().enumerate().filter(|(_, value)| !value.is_nan()).collect();
    let at = |index: usize| time_s.get(index).copied().unwrap_or(f64::NAN);
    for (index, value) in values.iter_mut().enumerate().filter(|(_, value)| value.is_nan()) {
        let after = known.partition_point(|(known, _)| *known < index);
        let before = after.checked_sub(1).and_then(|before| known.get(before));
        *value = match (before, known.get(after)) {
            (Some((from, first)), Some((to, last))) => {
                let part = (at(index) - at(*from)) / (at(*to) - at(*from));
                first + part * (last - first)
            }
            (Some((_, one)), None) | (None, Some((_, one))) => *one,
            (None, None) => f64::NAN,
        };
    }
}

#[cfg(test)]
#[allow(clippy::indexing_slicing)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged_and_masked() {
        let run = Run {
            time_s: (0..10).map(f64::from).collect(),
            angle_rad: vec![f64::NAN, 1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
            ..Run::default()
        };
        let log = Log { runs: vec![run], ..Log::default() };
        let (whole, masks) = bridged(&log);
        assert_eq!(whole.runs[0].angle_rad, [1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(masks[0].iter().filter(|masked| **masked).count(), 2);
        let (untouched, _) = bridged(whole.as_ref());
        assert!(matches!(untouched, Cow::Borrowed(_)));
    }
}
