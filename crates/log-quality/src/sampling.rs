//! When samples were taken: gaps, uneven intervals, samples and channels that are missing, samples that are repeated.

use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::median;
use log_data::{Channel, Log, Run};

/// A step of time is a gap from so many intervals on.
const GAP_INTERVALS: f64 = 1.5;
/// Intervals that are off by more than this part are uneven.
const EVEN: f64 = 0.1;
/// A clock of hardware keeps its intervals within this part, but for one in twenty. One of software does not, and pauses
/// when its computer does something else.
const STEADY: f64 = 0.02;
const MOSTLY: f64 = 0.05;
/// A run that lost more than this part of its length to pauses lost something that matters.
const LOST: f64 = 0.05;
/// Where the clock is uneven, a step is a gap from so many intervals on: less is the logger's own manner.
const UNEVEN_GAP_INTERVALS: f64 = 5.0;
/// Rows needed to say anything of intervals.
const LEAST_ROWS: usize = 20;
/// Repetitions of each sample that are looked for.
const REPEATED: std::ops::RangeInclusive<usize> = 2..=10;

pub(crate) fn inspect(log: &Log) -> Vec<Finding> {
    [gaps(log), doubled(log), missing_samples(log), missing_channels(log)].into_iter().flatten().collect()
}

/// The steps of a run's clock.
struct Clock {
    interval_s: f64,
    /// The part of steps that are no gap, and yet off by more than [`EVEN`].
    uneven: f64,
    /// Whether it is hardware's.
    steady: bool,
    gaps: usize,
    lost: f64,
    first: (usize, f64),
}

impl Clock {
    fn of(run: &Run) -> Option<Self> {
        if run.len() < LEAST_ROWS {
            return None;
        }
        let steps =
            || run.time_s.windows(2).map(|pair| pair.last().unwrap_or(&0.0) - pair.first().unwrap_or(&0.0));
        let interval_s = median(steps());
        let off = |by: f64| {
            let within = steps().filter(|step| *step < GAP_INTERVALS * interval_s);
            within.filter(|step| (step / interval_s - 1.0).abs() > by).count() as f64 / run.len() as f64
        };
        let (uneven, steady) = (off(EVEN), off(STEADY) <= MOSTLY);
        let reach = if steady { GAP_INTERVALS } else { UNEVEN_GAP_INTERVALS };
        let gaps = || steps().enumerate().filter(|(_, step)| *step > reach * interval_s);
        let lost_s: f64 = gaps().map(|(_, step)| step - interval_s).sum();
        Some(Self {
            interval_s,
            uneven,
            steady,
            gaps: gaps().count(),
            lost: lost_s / (run.end_s() - run.start_s()),
            first: gaps().next().map_or((0, 0.0), |(row, step)| (row + 1, step)),
        })
    }
}

fn gaps(log: &Log) -> Vec<Finding> {
    let clocks: Vec<(&Run, Clock)> = log.runs.iter().filter_map(|run| Some((run, Clock::of(run)?))).collect();
    let mut found = Vec::new();
    let named = |keep: &dyn Fn(&Clock) -> bool| -> Vec<String> {
        clocks.iter().filter(|(_, clock)| keep(clock)).map(|(run, _)| run.name.clone()).collect()
    };
    let with_gaps = named(&|clock| clock.gaps > 0);
    if let Some((run, first)) = clocks.iter().find(|(_, clock)| clock.gaps > 0) {
        let (row, step_s) = first.first;
        let count: usize = clocks.iter().map(|(_, clock)| clock.gaps).sum();
        let most = clocks.iter().map(|(_, clock)| clock.lost).fold(0.0, f64::max);
        let matters = |clock: &Clock| clock.gaps > 0 && (clock.steady || clock.lost > LOST);
        let severity =
            if clocks.iter().any(|(_, clock)| matters(clock)) { Severity::Mistake } else { Severity::Note };
        found.push(Finding {
            kind: Kind::Gaps,
            severity,
            evidence: format!(
                "{count} gap(s) {}; the first in run {} between rows {row} and {}: {step_s:.4} s, where {:.4} s are usual; \
                 up to {:.1} % of a run's length",
                in_runs(&with_gaps, log.runs.len()),
                run.name,
                row + 1,
                first.interval_s,
                100.0 * most
            ),
            place: Place::of(&[Channel::Time], with_gaps).rows(row, row + 1),
            mend: "make each stretch a run of its own (--rows), or find where rows were lost".to_owned(),
        });
    }
    let uneven = named(&|clock| clock.uneven > EVEN);
    if !uneven.is_empty() {
        let most = clocks.iter().map(|(_, clock)| clock.uneven).fold(0.0, f64::max);
        found.push(Finding {
            kind: Kind::UnevenSampling,
            severity: Severity::Note,
            evidence: format!(
                "the interval between samples varies {}: up to {:.0} % of them are off by more than 10 %",
                in_runs(&uneven, log.runs.len()),
                100.0 * most
            ),
            place: Place::of(&[Channel::Time], uneven),
            mend:
                "speeds and accelerations are the less exact; time stamps of the sampling itself would help"
                    .to_owned(),
        });
    }
    found
}

/// How often the values of a channel are held, and in which rhythm.
struct Held {
    every: usize,
    part: f64,
}

/// Samples that repeat in a rhythm: equal to the one before but where a new one is due, and new ones change. Samples that are
/// equal by chance or at rest are so in any phase of the rhythm alike.
fn held(values: &[f64]) -> Option<Held> {
    let equal: Vec<bool> = values.windows(2).map(|pair| pair.first() == pair.last()).collect();
    if equal.len() < 10 * LEAST_ROWS {
        return None;
    }
    REPEATED.filter_map(|every| rhythm(&equal, every)).max_by(|a, b| a.part.total_cmp(&b.part))
}

fn rhythm(equal: &[bool], every: usize) -> Option<Held> {
    let count = |phase: usize| {
        let steps = || equal.iter().skip(phase).step_by(every);
        (steps().filter(|equal| **equal).count() as f64, steps().count().max(1) as f64)
    };
    let counts: Vec<(f64, f64)> = (0..every).map(count).collect();
    let (due, (new, of)) = counts
        .iter()
        .enumerate()
        .min_by(|a, b| (a.1.0 / a.1.1).total_cmp(&(b.1.0 / b.1.1)))
        .map(|(phase, count)| (phase, *count))?;
    let others: Vec<&(f64, f64)> =
        counts.iter().enumerate().filter(|(phase, _)| *phase != due).map(|(_, c)| c).collect();
    let held = others.iter().map(|(equal, of)| equal / of).fold(1.0, f64::min);
    // Nine in ten are repeated where they should be, and where a new one is due half of them are new at least.
    (held > 0.9 && new / of < 0.5).then_some(Held { every, part: held - new / of })
}

fn doubled(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in [Channel::Torque, Channel::Angle] {
        let runs: Vec<(&Run, Held)> =
            log.runs.iter().filter_map(|run| Some((run, held(run.channel(channel)?)?))).collect();
        let Some((_, first)) = runs.first() else { continue };
        let names: Vec<String> = runs.iter().map(|(run, _)| run.name.clone()).collect();
        found.push(Finding {
            kind: Kind::DoubledSamples,
            severity: Severity::Mistake,
            evidence: format!(
                "{channel} holds every value for {} samples {}: the record is {0} times as fast as what it records",
                first.every,
                in_runs(&names, log.runs.len())
            ),
            place: Place::of(&[channel], names),
            mend: format!("take every {}th row (--every {0})", first.every),
        });
        // The torque says it all; an angle that holds beside it is the same fact.
        break;
    }
    found
}

fn missing_samples(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in Channel::ALL.iter().skip(1) {
        let of = |run: &Run| run.channel(*channel).map_or(0, |v| v.iter().filter(|v| v.is_nan()).count());
        let runs: Vec<&Run> = log.runs.iter().filter(|run| of(run) > 0).collect();
        let Some(first) = runs.first() else { continue };
        let (count, all) =
            (runs.iter().map(|run| of(run)).sum::<usize>(), log.runs.iter().map(Run::len).sum::<usize>());
        let row =
            first.channel(*channel).and_then(|v| v.iter().position(|v| v.is_nan())).map_or(0, |row| row + 1);
        let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
        found.push(Finding {
            kind: Kind::MissingSamples,
            severity: Severity::Note,
            evidence: format!(
                "{count} samples of {channel} are missing {} ({:.2} % of the log), the first in run {}, row {row}",
                in_runs(&names, log.runs.len()),
                100.0 * count as f64 / all.max(1) as f64,
                first.name
            ),
            place: Place::of(&[*channel], names).rows(row, row),
            mend: "in import, fill(x) bridges short gaps and --where leaves rows out".to_owned(),
        });
    }
    found
}

fn missing_channels(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    for channel in Channel::ALL.iter().skip(1) {
        let without: Vec<String> = log
            .runs
            .iter()
            .filter(|run| run.channel(*channel).is_none())
            .map(|run| run.name.clone())
            .collect();
        if !without.is_empty() && without.len() < log.runs.len() {
            found.push(Finding {
                kind: Kind::MissingChannel,
                severity: Severity::Note,
                evidence: format!("{channel} is missing {}", in_runs(&without, log.runs.len())),
                place: Place::of(&[*channel], without),
                mend: "diagnose does without the channel; if that explains nothing, it asks the runs that have it alone".to_owned(),
            });
        }
    }
    found
}
