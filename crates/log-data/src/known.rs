//! What of a run is left where a channel lacks many samples.

use crate::energised::LEAST_ROWS;
use crate::{Channel, Run};
use std::ops::Range;

/// Gaps are bridged where a channel lacks at most this part of a run's samples. Where it lacks more, too much of what is
/// predicted would rest on straight lines.
pub const MOST_MISSING: f64 = 0.2;

/// How many samples of a channel are missing; 0 of a channel that the run does not have.
pub fn lacking(run: &Run, channel: Channel) -> usize {
    run.channel(channel).map_or(0, |values| values.iter().filter(|value| value.is_nan()).count())
}

/// Cuts a run to the longest stretch in which each of `needed` has its samples, if one of them lacks more than
/// [`MOST_MISSING`]; takes out the channels of `useful` that do then. What was done, in words; empty where nothing was.
pub fn cut_to_known(run: &mut Run, needed: &[Channel], useful: &[Channel]) -> Vec<String> {
    let mut done = Vec::new();
    let poor = |run: &Run, channel: Channel| lacking(run, channel) as f64 > MOST_MISSING * run.len() as f64;
    if let Some(channel) = needed.iter().copied().find(|channel| poor(run, *channel)) {
        let (missing, of) = (lacking(run, channel), run.len());
        let rows = longest_known(run, needed);
        let what = if rows.is_empty() {
            "left out".to_owned()
        } else {
            format!("used in rows {} to {} alone", rows.start + 1, rows.end)
        };
        done.push(format!(
            "run {} is {what}: {missing} of its {of} samples of {channel} are missing",
            run.name
        ));
        run.keep_rows(rows);
    }
    for channel in useful.iter().copied() {
        if !run.is_empty() && poor(run, channel) {
            let (missing, of) = (lacking(run, channel), run.len());
            done.push(format!(
                "run {} is taken as one without {channel}: {missing} of {of} samples of it are missing",
                run.name
            ));
            run.take_channel(channel);
        }
    }
    done
}

fn longest_known(run: &Run, needed: &[Channel]) -> Range<usize> {
    let known = |row: usize| {
        needed.iter().filter_map(|channel| run.channel(*channel)?.get(row)).all(|value| !value.is_nan())
    };
    let (mut longest, mut start) = (0..0, 0);
    for row in 0..run.len() {
        if !known(row) {
            start = row + 1;
        } else if row + 1 - start > longest.len() {
            longest = start..row + 1;
        }
    }
    if longest.len() < LEAST_ROWS { 0..0 } else { longest }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests {
    use super::*;

    /// Ten times a hundred rows, with these hundreds of the torque and of the pressure missing.
    fn run(torque: &[usize], pressure: &[usize]) -> Run {
        let values = |missing: &[usize]| {
            (0..1000).map(|row| if missing.contains(&(row / 100)) { f64::NAN } else { row as f64 }).collect()
        };
        Run {
            name: "one".to_owned(),
            time_s: values(&[]),
            angle_rad: values(&[]),
            torque_nm: Some(values(torque)),
            pressure_drop_pa: Some(values(pressure)),
            ..Run::default()
        }
    }

    #[test]
    fn what_is_used_of_a_run_that_lacks_samples() {
        let all: Vec<usize> = (0..10).collect();
        type Case<'a> = (&'a [usize], &'a [usize], Range<usize>, bool, usize);
        let table: [Case; 6] = [
            (&[], &[], 0..1000, true, 0),
            // A fifth is bridged.
            (&[3, 7], &[2, 5], 0..1000, true, 0),
            (&[2, 3, 4], &[], 500..1000, true, 1),
            (&[5, 7, 9], &[], 0..500, true, 1),
            (&[], &[2, 3, 4], 0..1000, false, 1),
            (&all, &[], 0..0, true, 1),
        ];
        for (torque, pressure, rows, has_pressure, notes) in table {
            let mut cut = run(torque, pressure);
            let told = cut_to_known(&mut cut, &[Channel::Angle, Channel::Torque], &[Channel::PressureDrop]);
            assert_eq!(told.len(), notes, "{told:?}");
            assert_eq!(cut.time_s, rows.map(|row| row as f64).collect::<Vec<_>>(), "{torque:?} {pressure:?}");
            assert_eq!(cut.torque_nm.as_ref().unwrap().len(), cut.len());
            assert_eq!(cut.pressure_drop_pa.is_some(), has_pressure);
        }
        let mut short = run(&[], &[]);
        short.torque_nm.as_mut().unwrap()[49..].fill(f64::NAN);
        let told = cut_to_known(&mut short, &[Channel::Angle, Channel::Torque], &[]);
        assert!(short.is_empty() && told[0].contains("left out"), "a short stretch is no run: {told:?}");
    }
}
