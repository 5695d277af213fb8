//! What samples show by themselves: rails, single wild ones, channels that never change.

use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::{noise, quantile};
use log_data::{Channel, Log, Run};

/// Samples needed.
const LEAST: usize = 100;
/// Samples together at a rail that count as a stretch of it.
const STRETCH: usize = 3;
/// How unlikely stretches at a rail must be by chance: one in a billion, as a natural logarithm.
const UNLIKELY: f64 = 20.7;
/// A rail holds so many times as many samples as the next value that occurs. (The peak of a sine that is read in steps
/// holds 1/(√2 − 1) = 2.4 times as many.)
const MORE_THAN_A_PEAK: f64 = 5.0;
/// A run in which more than this part of neighbours are equal holds still.
const STILL: f64 = 0.3;
/// An angle that follows a line so exactly, in parts of its way, is no angle: 30 bits of an encoder.
const EXACT: f64 = 1e-9;
/// Noise of this part of the span from the tenth to the ninetieth per cent is all that there is. White noise has 0.35 to 0.39.
const ALL_OVER: f64 = 0.25;
/// How many deviations of the noise a single sample must be off. Of a billion normal ones none is by chance.
const WILD: f64 = 12.0;
/// So many of one value are a mark.
const A_MARK: usize = 3;

pub(crate) fn inspect(log: &Log) -> Vec<Finding> {
    let of_channels = [constant(log), no_motion(log), clipped(log), outliers(log)].into_iter().flatten();
    of_channels.chain(too_short(log)).chain(nothing_to_predict(log)).collect()
}

/// What was not looked at must not pass for good.
fn too_short(log: &Log) -> Option<Finding> {
    let short: Vec<&Run> = log.runs.iter().filter(|run| run.len() < LEAST).collect();
    let first = short.first()?;
    let runs: Vec<String> = short.iter().map(|run| run.name.clone()).collect();
    Some(Finding {
        kind: Kind::TooShort,
        severity: Severity::Note,
        evidence: format!(
            "{} than {LEAST} samples {}: {} has {}",
            if short.len() == 1 { "fewer" } else { "runs with fewer" },
            in_runs(&runs, log.runs.len()),
            first.name,
            first.len()
        ),
        place: Place::of(&[], runs),
        mend: "most checks need more, and were not made there; was more recorded than was imported?"
            .to_owned(),
    })
}

fn nothing_to_predict(log: &Log) -> Option<Finding> {
    let has = |channel| log.runs.iter().any(|run| run.channel(channel).is_some());
    if has(Channel::Torque) || has(Channel::AngleCommand) {
        return None;
    }
    Some(Finding {
        kind: Kind::NothingToPredict,
        severity: Severity::Note,
        evidence: "neither torque nor angle_command: no model can be held against an angle alone".to_owned(),
        place: Place::of(&[Channel::Torque, Channel::AngleCommand], Vec::new()),
        mend: "map the column of the torque (of a test rig) or of the command (of a stepper) in import, if the record has one"
            .to_owned(),
    })
}

fn constant(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in [Channel::Angle, Channel::AngleCommand, Channel::Torque] {
        let has = log.runs.iter().filter(|run| run.channel(channel).is_some() && run.len() >= LEAST).count();
        let runs: Vec<String> = log
            .runs
            .iter()
            .filter(|run| run.len() >= LEAST && run.channel(channel).is_some_and(never_changes))
            .map(|run| run.name.clone())
            .collect();
        if runs.is_empty() {
            continue;
        }
        let everywhere = runs.len() == has;
        found.push(Finding {
            kind: Kind::ConstantChannel,
            severity: if everywhere { Severity::Mistake } else { Severity::Note },
            evidence: format!("{channel} never changes {}", in_runs(&runs, log.runs.len())),
            place: Place::of(&[channel], runs),
            mend: "is it the right column, and was the instrument on?".to_owned(),
        });
    }
    found
}

/// An angle that no motion makes: the time itself, or noise without an end.
fn no_motion(log: &Log) -> Vec<Finding> {
    let runs: Vec<&Run> =
        log.runs.iter().filter(|run| run.len() >= LEAST && !never_changes(&run.angle_rad)).collect();
    let all = |of: fn(&Run) -> bool| !runs.is_empty() && runs.iter().all(|run| of(run));
    let says = if all(goes_with_time) {
        "the angle grows with the time alone, to the last digit"
    } else if all(jumps_all_over) {
        "the angle jumps from each sample to the next as far as it ever goes"
    } else {
        return Vec::new();
    };
    vec![Finding {
        kind: Kind::WrongAngle,
        severity: Severity::Mistake,
        evidence: format!("{says} {}", in_runs(&[], log.runs.len())),
        place: Place::of(&[Channel::Angle], Vec::new()),
        mend: "is the angle's column the right one?".to_owned(),
    }]
}

/// Whether the angle is the time, in seconds or in a thousandth or a thousand of them: no encoder is so exact.
fn goes_with_time(run: &Run) -> bool {
    let (first, last) = (run.angle_rad.first().copied(), run.angle_rad.last().copied());
    let (Some(first), Some(last)) = (first, last) else { return false };
    let slope = (last - first) / (run.end_s() - run.start_s());
    let line = |time_s: f64| first + slope * (time_s - run.start_s());
    let off = run.time_s.iter().zip(&run.angle_rad).map(|(time_s, angle)| (angle - line(*time_s)).abs());
    // A missing sample is none of the time's.
    slope != 0.0
        && off.fold(0.0, |most: f64, off| if off <= most { most } else { off })
            <= EXACT * (last - first).abs()
}

/// Whether neighbours differ as much as any two samples.
fn jumps_all_over(run: &Run) -> bool {
    let values = &run.angle_rad;
    let (low, high) = (quantile(values.iter().copied(), 0.1), quantile(values.iter().copied(), 0.9));
    // Of white noise the span is 2.6 (normal) or 2.8 (even) standard deviations.
    high > low && noise(values) > ALL_OVER * (high - low)
}

fn never_changes(values: &[f64]) -> bool {
    let mut known = values.iter().filter(|value| value.is_finite());
    let first = known.next();
    first.is_some() && known.all(|value| Some(value) == first)
}

/// What a channel does at the largest, or smallest, value that it ever takes.
#[derive(Default)]
struct AtRail {
    samples: usize,
    stretches: usize,
    /// The negative logarithm of how likely as many equal neighbours are by chance, as they are elsewhere in their run.
    unlikely: f64,
    first: Option<(String, usize, usize)>,
    runs: Vec<String>,
}

fn clipped(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in [Channel::Torque, Channel::PressureDrop, Channel::Flow] {
        for sign in [1.0, -1.0] {
            let runs: Vec<(&Run, &[f64])> = log
                .runs
                .iter()
                .filter_map(|run| Some((run, run.channel(channel)?)))
                .filter(|(_, values)| values.len() >= LEAST)
                .collect();
            let signed = || runs.iter().flat_map(|(_, values)| values.iter().map(move |value| sign * value));
            let rail = sign * signed().filter(|value| value.is_finite()).fold(f64::NEG_INFINITY, f64::max);
            let opposite = sign * signed().filter(|value| value.is_finite()).fold(f64::INFINITY, f64::min);
            // A torque that ends at both its rails stands still at neither. Pressures and flows are switched between two levels.
            let rails = if channel == Channel::Torque { [rail, opposite] } else { [rail; 2] };
            // A channel that holds still, or has no noise, has plateaus that are no rails.
            let moving: Vec<(&Run, &[f64])> =
                runs.iter().copied().filter(|(_, values)| stands_still(values, rails) < STILL).collect();
            let at = at_rail(moving.into_iter(), rail, rails);
            // A closed valve has no flow, and a pump at rest makes no pressure.
            let is_none = channel != Channel::Torque && rail == 0.0;
            if is_none || at.unlikely < UNLIKELY || !piles_up(&at, signed(), sign * rail) {
                continue;
            }
            let (run, from, to) = at.first.unwrap_or_default();
            found.push(Finding {
                kind: Kind::Clipped,
                severity: Severity::Mistake,
                evidence: format!(
                    "{channel} ends at {rail:.6} {}: {} samples in {} stretches are exactly that {}, the first in run {run}, \
                     rows {from} to {to}; elsewhere neighbours differ",
                    channel.unit(),
                    at.samples,
                    at.stretches,
                    in_runs(&at.runs, log.runs.len())
                ),
                place: Place::of(&[channel], at.runs).rows(from, to),
                mend: "measure with a larger range; or take these samples for missing (import --missing, with the value as the file has it)".to_owned(),
            });
        }
    }
    found
}

/// The part of neighbours that are equal, of those that are not at a rail.
fn stands_still(values: &[f64], rails: [f64; 2]) -> f64 {
    let (equal, all) = values.windows(2).fold((0.0, 0.0), |(equal, all), pair| match pair {
        [a, b] if a == b && rails.contains(a) => (equal, all),
        [a, b] if a.is_finite() && b.is_finite() => (equal + f64::from(u8::from(a == b)), all + 1.0),
        _ => (equal, all),
    });
    if all > 0.0 { equal / all } else { 1.0 }
}

/// Whether far more samples are at the rail than at the next value that occurs: of numbers that come in steps, too, the
/// largest is the rarest but at a peak of a slow motion.
fn piles_up(at: &AtRail, signed: impl Iterator<Item = f64>, rail: f64) -> bool {
    let (mut next, mut count) = (f64::NEG_INFINITY, 0.0);
    for value in signed.filter(|value| *value < rail) {
        if value > next {
            (next, count) = (value, 0.0);
        }
        count += f64::from(u8::from(value == next));
    }
    at.samples as f64 > MORE_THAN_A_PEAK * count
}

fn at_rail<'a>(runs: impl Iterator<Item = (&'a Run, &'a [f64])>, rail: f64, rails: [f64; 2]) -> AtRail {
    let mut all = AtRail::default();
    for (run, values) in runs {
        let mut begin = 0;
        let chance = stands_still(values, rails).max(1.0 / values.len() as f64);
        for (stretch, part) in
            values.chunk_by(|a, b| (*a == rail) == (*b == rail)).map(|part| (part.len(), part))
        {
            if stretch >= STRETCH && part.first() == Some(&rail) {
                all.samples += stretch;
                all.stretches += 1;
                all.unlikely -= (stretch - 1) as f64 * chance.ln();
                all.first.get_or_insert_with(|| (run.name.clone(), begin + 1, begin + stretch));
                if all.runs.last() != Some(&run.name) {
                    all.runs.push(run.name.clone());
                }
            }
            begin += stretch;
        }
    }
    all
}

fn outliers(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in
        [Channel::Angle, Channel::Torque, Channel::PressureDrop, Channel::Flow, Channel::OilTemperature]
    {
        let mut runs = Vec::new();
        let (mut count, mut first, mut one_value) = (0, None, true);
        for run in &log.runs {
            let Some(values) = run.channel(channel).filter(|values| values.len() >= LEAST) else { continue };
            let wild = wild(values);
            if let Some((row, value)) = wild.first() {
                let first = first.get_or_insert_with(|| (run.name.clone(), row + 1, *value));
                one_value &= wild.iter().all(|(_, value)| *value == first.2);
                count += wild.len();
                runs.push(run.name.clone());
            }
        }
        if let Some((run, row, value)) = first {
            let is_mark = one_value && count >= A_MARK;
            let mend = if is_mark {
                "all are one value: a mark for missing samples? Then --missing and that mark, as it stands in the file"
            } else {
                "diagnose takes them for missing; --missing or --where leaves them out of the log"
            };
            found.push(Finding {
                kind: Kind::Outliers,
                severity: Severity::Note,
                evidence: format!(
                    "{count} sample(s) of {channel} stand alone, far from both neighbours, the first in run {run}, row {row}: \
                     {value:.6} {}",
                    channel.unit()
                ),
                place: Place::of(&[channel], runs).rows(row, row),
                mend: mend.to_owned(),
            });
        }
    }
    found
}

/// The log without samples that stand alone, far from both neighbours, in angle, torque and pressure: they are NaN, as missing ones are.
/// One of them can hold more of the sum of squares than all others, and none is of the motion.
#[must_use]
pub fn without_wild(mut log: Log) -> Log {
    for run in &mut log.runs {
        let channels = [Some(&mut run.angle_rad), run.torque_nm.as_mut(), run.pressure_drop_pa.as_mut()];
        for values in channels.into_iter().flatten().filter(|values| values.len() >= LEAST) {
            for (row, _) in wild(values) {
                if let Some(value) = values.get_mut(row) {
                    *value = f64::NAN;
                }
            }
        }
    }
    log
}

/// Samples that are far from both neighbours, on the same side of both, while those agree.
fn wild(values: &[f64]) -> Vec<(usize, f64)> {
    let far = |three: &[f64], least: f64| match three {
        [before, at, after] => {
            let (one, other) = (at - before, at - after);
            let nearer = one.abs().min(other.abs());
            one * other > 0.0 && nearer > least && (before - after).abs() < 0.2 * nearer
        }
        _ => false,
    };
    // A step that one in a hundred exceeds: what motion, steps of an encoder and reversals make. Steps up to a sample that may be wild, and
    // down again, are none of them: of many such samples they would be the usual ones.
    let may_be: Vec<bool> = values.windows(3).map(|three| far(three, 0.0)).collect();
    let at = |row: usize| row.checked_sub(1).and_then(|row| may_be.get(row)).copied().unwrap_or(false);
    let steps = || {
        let pairs = values.windows(2).enumerate().filter(|(row, _)| !at(*row) && !at(row + 1));
        pairs.map(|(_, pair)| (pair.last().unwrap_or(&0.0) - pair.first().unwrap_or(&0.0)).abs())
    };
    // An encoder at rest flickers by its step, and does nothing else.
    let least = values.windows(2).map(|pair| match pair {
        [one, other] if one != other => (one - other).abs(),
        _ => f64::INFINITY,
    });
    let step = least.fold(f64::INFINITY, f64::min);
    let usual = quantile(steps(), 0.99).max(noise(values)).max(if step.is_finite() { step } else { 0.0 });
    let is_wild = |three: &[f64]| far(three, WILD * usual);
    let rows = values.windows(3).enumerate().filter(|(_, three)| is_wild(three));
    rows.filter_map(|(row, three)| Some((row + 1, *three.get(1)?))).collect()
}
