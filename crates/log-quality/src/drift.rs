//! A torque's zero that drifts: in sliding both ways the mean of measured less expected torque moves with time.

use crate::expected::Expected;
use crate::finding::{Finding, Kind, Place, Severity};
use crate::windows::{Source, Window, windows};
use log_data::{Channel, Log, Run};
use valve_model::Model;

/// Stretches of the log in which a zero is told, about; fewer than the second tell no trend.
const STRETCHES: usize = 16;
const LEAST: usize = 12;
/// A trend by Kendall's rank statistic so many standard deviations off: one in 16,000 is by chance.
const DEVIATIONS: f64 = 4.0;
/// Less than this part of the friction changes no result that matters.
const MATTERS: f64 = 0.05;

/// Pressures that differ by less than this part of the largest are one; and of pairs of runs that differ in it, the excess of those in
/// one order that makes a trend.
const ONE_PRESSURE: f64 = 0.1;
const MOSTLY: f64 = 0.6;

/// A stretch's middle, and the zero in it.
struct Zero {
    time_s: f64,
    zero_nm: f64,
    friction_nm: f64,
}

pub(crate) fn inspect(log: &Log, model: Option<&Model>) -> Option<Finding> {
    let expected = Expected::new(Some(model?), true)?;
    if !log.is_on_one_clock() || pressure_follows_time(log) {
        return None;
    }
    let source = Source { angle: Channel::Angle, measured: Channel::Torque, integrated: false, lag: false };
    let windows = windows(log, source);
    let parts = STRETCHES.div_ceil(windows.len().max(1));
    let mut zeros: Vec<Zero> = windows.iter().flat_map(|window| zeros(&expected, window, parts)).collect();
    zeros.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let trend = trend(&zeros);
    if zeros.len() < LEAST || trend.abs() < DEVIATIONS {
        return None;
    }
    let third = zeros.len() / 3;
    let mean = |part: &[Zero]| part.iter().map(|of| of.zero_nm).sum::<f64>() / part.len().max(1) as f64;
    let (first, last) = (mean(zeros.get(..third)?), mean(zeros.get(zeros.len() - third..)?));
    let friction = zeros.iter().map(|of| of.friction_nm).sum::<f64>() / zeros.len() as f64;
    ((last - first).abs() > MATTERS * friction).then(|| Finding {
        kind: Kind::ZeroDrift,
        severity: Severity::Note,
        evidence: format!(
            "the torque's zero, by sliding both ways, moves with time: from {first:.4} to {last:.4} N*m on average of the first and \
             the last third of {} stretches",
            zeros.len()
        ),
        place: Place::of(&[Channel::Torque], Vec::new()),
        mend: "let the transducer warm up, and record its zero before each run".to_owned(),
    })
}

/// Whether the pressure rises or falls from run to run over the log: a torque that goes by it then moves with time too, and is no zero.
fn pressure_follows_time(log: &Log) -> bool {
    let mean = |run: &&Run| {
        let values = run.pressure_drop_pa.as_ref()?.iter().filter(|value| value.is_finite());
        let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let runs = log.runs_in_time();
    let means: Vec<f64> = runs.iter().filter_map(mean).collect();
    let most = means.iter().map(|mean| mean.abs()).fold(0.0, f64::max);
    let mut order = 0.0;
    let mut pairs = 0.0;
    for (index, earlier) in means.iter().enumerate() {
        for later in
            means.iter().skip(index + 1).filter(|later| (*later - earlier).abs() > ONE_PRESSURE * most)
        {
            order += (later - earlier).signum();
            pairs += 1.0;
        }
    }
    pairs > 0.0 && f64::abs(order) > MOSTLY * pairs
}

/// The zeros of a window, cut into so many parts; of those that slide both ways.
fn zeros(expected: &Expected<'_>, window: &Window, parts: usize) -> Vec<Zero> {
    let rows = window.motions.len().div_ceil(parts).max(1);
    let motions = window.motions.chunks(rows);
    let parts = motions.zip(window.measured.chunks(rows)).enumerate();
    let zero = |(part, (motions, measured)): (usize, (&[_], &[f64]))| {
        let sums = expected.sums_of(motions, measured);
        let middle = (part * rows) as f64 + 0.5 * motions.len() as f64;
        let time_s = window.begin_s + middle * window.interval_s;
        Some(Zero { time_s, zero_nm: sums.zero()?, friction_nm: sums.expected_rms() })
    };
    parts.filter_map(zero).collect()
}

/// How many standard deviations the order of the zeros is off one without a trend (Kendall 1938).
fn trend(zeros: &[Zero]) -> f64 {
    let mut sum = 0.0;
    for (index, earlier) in zeros.iter().enumerate() {
        for later in zeros.iter().skip(index + 1) {
            let step = later.zero_nm - earlier.zero_nm;
            sum += if step == 0.0 { 0.0 } else { step.signum() };
        }
    }
    let count = zeros.len() as f64;
    sum / (count * (count - 1.0) * (2.0 * count + 5.0) / 18.0).sqrt()
}
