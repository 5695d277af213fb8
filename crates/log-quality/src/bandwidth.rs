//! A transducer slower than its record: neighbouring samples of the torque share their noise.
//!
//! Second differences of white noise are correlated by −2/3 from one to the next, behind a filter of first order by −1/2, until
//! samples are taken so far apart that they share nothing. Where motion or an oscillation is louder than noise they are more
//! alike at some distance before, and nothing is said; nor of a filter of higher order, which looks the same.

use crate::finding::{Finding, Kind, Place, Severity};
use crate::scale::median;
use log_data::{Channel, Log, Run};

/// Distances of samples that are tried, in rows.
const STRIDES: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// A correlation below this is that of white noise, nearly; above the other it is more than noise behind a filter of first order.
const WHITE: f64 = -0.6;
const NOISE: f64 = -0.45;
/// Steps of a record closer together than this part of what the transducer follows say nothing new.
const SLOWER: usize = 4;
/// Differences needed, and what is left out: so many times the usual one, as reversals make it.
const LEAST: usize = 200;
const FAR: f64 = 5.0;

pub(crate) fn inspect(log: &Log) -> Option<Finding> {
    let told: Vec<(&Run, usize)> =
        log.runs.iter().filter_map(|run| Some((run, stride(run.channel(Channel::Torque)?)?))).collect();
    let slow: Vec<&(&Run, usize)> = told.iter().filter(|(_, stride)| *stride >= SLOWER).collect();
    if slow.is_empty() || 2 * slow.len() < told.len() {
        return None;
    }
    let interval_s = median(slow.iter().map(|(run, _)| (run.end_s() - run.start_s()) / run.len() as f64));
    let apart_s = median(slow.iter().map(|(_, stride)| *stride as f64)) * interval_s;
    Some(Finding {
        kind: Kind::Bandwidth,
        severity: Severity::Note,
        evidence: format!(
            "torque is smooth from sample to sample: only {:.2} ms apart its noise is independent, as that of a transducer or a \
             filter of about {:.0} Hz; it is sampled at {:.0} Hz",
            1e3 * apart_s,
            1.0 / (std::f64::consts::PI * apart_s),
            1.0 / interval_s
        ),
        place: Place::of(&[Channel::Torque], slow.iter().map(|(run, _)| run.name.clone()).collect()),
        mend: format!(
            "it reads changes late, by up to {:.2} ms: diagnose may name a sensor-delay; --decimate keeps what it knows",
            0.5e3 * apart_s
        ),
    })
}

/// How many rows apart noise is independent; `None` where something else than noise shows at this or a shorter distance.
fn stride(values: &[f64]) -> Option<usize> {
    let correlations = STRIDES.into_iter().map(|stride| Some((stride, correlation(values, stride)?)));
    let noise = correlations.map_while(|of| of.filter(|(_, correlation)| *correlation <= NOISE));
    noise.into_iter().find(|(_, correlation)| *correlation <= WHITE).map(|(stride, _)| stride)
}

/// The correlation of second differences, over so many rows each, with the next ones.
fn correlation(values: &[f64], stride: usize) -> Option<f64> {
    let at = |row: usize| values.get(row).copied().unwrap_or(f64::NAN);
    let second = |row: usize| at(row) - 2.0 * at(row + stride) + at(row + 2 * stride);
    let rows = || 0..values.len().saturating_sub(3 * stride);
    let usual = median(rows().map(|row| second(row).abs()));
    let near = |row: &usize| second(*row).abs() <= FAR * usual && second(*row + stride).abs() <= FAR * usual;
    let (mut product, mut square, mut count) = (0.0, 0.0, 0_usize);
    for row in rows().filter(near) {
        let (one, next) = (second(row), second(row + stride));
        product += one * next;
        square += 0.5 * (one * one + next * next);
        count += 1;
    }
    (count >= LEAST && square > 0.0).then(|| product / square)
}
