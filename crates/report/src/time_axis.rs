//! The common time axis of a run, and its signals reduced to what a page can hold.
//!
//! A run that fits is kept sample by sample. A longer one is cut into buckets of equally many samples; of each
//! bucket a signal keeps its smallest and its largest value in the order in which they came, at the times of the
//! bucket's first and middle sample. So the points are a signal again, with every peak in it. Windows of
//! particular interest (around a fault) are kept sample by sample within a run that is otherwise reduced.

use crate::ReportError;
use crate::encode;
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::Arc;

/// What the arrays of one page's time plots may take, before base64 adds a third: with it a page stays under 13 MB.
const DATA_BYTES: usize = 9_000_000;

/// A run of samples kept alike: each `stride` samples become two points, or each sample one where `stride` is 1.
#[derive(Debug, PartialEq)]
struct Segment {
    samples: Range<usize>,
    stride: usize,
}

impl Segment {
    fn points(&self) -> usize {
        if self.stride == 1 { self.samples.len() } else { 2 * self.samples.len().div_ceil(self.stride) }
    }
}

#[derive(Debug)]
struct Plan {
    samples: usize,
    segments: Vec<Segment>,
    time_s: Vec<f64>,
}

/// The times of a run's samples, reduced; shared by all signals sampled at these times. Clones are the same axis.
#[derive(Debug, Clone)]
pub struct TimeAxis {
    plan: Arc<Plan>,
}

/// A signal on its [`TimeAxis`], reduced.
#[derive(Debug, Clone)]
pub struct Trace {
    pub(crate) axis: TimeAxis,
    pub(crate) offset: f64,
    pub(crate) values: Vec<f32>,
}

impl TimeAxis {
    /// The axis for `series` signals that share a page, so that the page stays under about 13 MB. `time_s` are the
    /// samples' times (s). `details` are windows (s, from and to, the most important first) to be kept sample by
    /// sample as far as half the room goes.
    ///
    /// # Errors
    /// [`ReportError::Time`] where a time is not finite or earlier than the one before.
    pub fn new(time_s: &[f64], series: usize, details: &[(f64, f64)]) -> Result<Self, ReportError> {
        Self::with_points(time_s, DATA_BYTES / (size_of::<f64>() + size_of::<f32>() * series.max(1)), details)
    }

    /// As [`TimeAxis::new`], for at most about `max_points` points in each signal (at least 1000).
    ///
    /// # Errors
    /// [`ReportError::Time`] where a time is not finite or earlier than the one before.
    pub fn with_points(
        time_s: &[f64],
        max_points: usize,
        details: &[(f64, f64)],
    ) -> Result<Self, ReportError> {
        check(time_s)?;
        let segments = plan(time_s, max_points.max(1000), details);
        let mut points = Vec::with_capacity(segments.iter().map(Segment::points).sum());
        for segment in &segments {
            let times = time_s.get(segment.samples.clone()).unwrap_or_default();
            for bucket in times.chunks(segment.stride) {
                points.extend(bucket.first());
                if segment.stride > 1 {
                    points.extend(bucket.get(bucket.len() / 2));
                }
            }
        }
        Ok(Self { plan: Arc::new(Plan { samples: time_s.len(), segments, time_s: points }) })
    }

    /// Number of samples of the run.
    pub fn samples(&self) -> usize {
        self.plan.samples
    }

    /// How many samples stand behind two points, where the axis is reduced; 1 where nothing is.
    pub fn stride(&self) -> usize {
        self.plan.segments.iter().map(|segment| segment.stride).max().unwrap_or(1)
    }

    /// Whether the two are the same axis, not only alike.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.plan, &other.plan)
    }

    /// Reduces a signal of one value per sample; NaN and infinite values are gaps. A bucket has a gap only where
    /// all its samples are missing.
    ///
    /// # Errors
    /// [`ReportError::SampleCount`] where `values` are not as many as the axis has samples.
    pub fn trace(&self, values: impl IntoIterator<Item = f64>) -> Result<Trace, ReportError> {
        let mut values = values.into_iter();
        let mut found = 0;
        let mut points = Vec::with_capacity(self.plan.time_s.len());
        for segment in &self.plan.segments {
            let mut left = segment.samples.len();
            while left > 0 {
                let size = left.min(segment.stride);
                found += reduce(values.by_ref().take(size), segment.stride, &mut points);
                left -= size;
            }
        }
        let excess = values.count();
        if found + excess != self.plan.samples {
            return Err(ReportError::SampleCount { found: found + excess, expected: self.plan.samples });
        }
        let offset = encode::middle(&points);
        let values = points.into_iter().map(|value| (value - offset) as f32).collect();
        Ok(Trace { axis: self.clone(), offset, values })
    }

    /// For the page's script: times, and how the samples stand behind the points, `[first point, first sample, stride]`.
    pub(crate) fn to_json(&self) -> Value {
        let mut point = 0;
        let mut segments = Vec::new();
        for segment in &self.plan.segments {
            segments.push(json!([point, segment.samples.start, segment.stride]));
            point += segment.points();
        }
        json!({
            "samples": self.plan.samples,
            "segments": segments,
            "time": encode::float64(self.plan.time_s.iter().copied()),
        })
    }

    /// One sentence on what the page holds of the run.
    pub(crate) fn describe(&self) -> String {
        let samples = crate::html::grouped(self.plan.samples);
        if self.plan.samples == 1 {
            return "1 sample.".to_owned();
        }
        if self.stride() == 1 {
            return format!("{samples} samples, all in this page.");
        }
        let whole: usize = self.plan.segments.iter().filter(|s| s.stride == 1).map(|s| s.samples.len()).sum();
        let details = if whole > 0 {
            format!(" {} samples in windows of interest are here one by one.", crate::html::grouped(whole))
        } else {
            String::new()
        };
        format!(
            "{samples} samples; this page holds the smallest and the largest of every {}, so that no peak is lost.{details}",
            crate::html::grouped(self.stride())
        )
    }
}

fn check(time_s: &[f64]) -> Result<(), ReportError> {
    let mut before_s = f64::NEG_INFINITY;
    for (row, &found_s) in time_s.iter().enumerate() {
        if !(found_s.is_finite() && found_s >= before_s) {
            return Err(ReportError::Time { row, found_s, before_s });
        }
        before_s = found_s;
    }
    Ok(())
}

/// Adds one bucket's points; gives the number of samples it had.
fn reduce(bucket: impl Iterator<Item = f64>, stride: usize, points: &mut Vec<f64>) -> usize {
    let (mut low, mut high) = ((f64::NAN, 0), (f64::NAN, 0));
    let mut size = 0;
    for value in bucket {
        size += 1;
        if value.is_finite() {
            if low.0.is_nan() || value < low.0 {
                low = (value, size);
            }
            if high.0.is_nan() || value > high.0 {
                high = (value, size);
            }
        }
    }
    let (first, second) = if low.1 <= high.1 { (low.0, high.0) } else { (high.0, low.0) };
    if size > 0 {
        points.push(first);
        if stride > 1 {
            points.push(second);
        }
    }
    size
}

fn plan(time_s: &[f64], max_points: usize, details: &[(f64, f64)]) -> Vec<Segment> {
    let samples = time_s.len();
    if samples <= max_points {
        return vec![Segment { samples: 0..samples, stride: 1 }];
    }
    let whole = whole_windows(time_s, max_points / 2, details);
    let kept: usize = whole.iter().map(ExactSizeIterator::len).sum();
    let stride = (2 * (samples - kept)).div_ceil(max_points - kept).max(2);
    let mut segments = Vec::new();
    let mut end = 0;
    for window in whole {
        if window.start > end {
            segments.push(Segment { samples: end..window.start, stride });
        }
        end = window.end;
        segments.push(Segment { samples: window, stride: 1 });
    }
    if end < samples {
        segments.push(Segment { samples: end..samples, stride });
    }
    segments
}

/// The windows as ranges of samples, in order, apart from each other, together at most `room` long. One that does
/// not fit keeps its middle.
fn whole_windows(time_s: &[f64], mut room: usize, details: &[(f64, f64)]) -> Vec<Range<usize>> {
    let mut windows: Vec<Range<usize>> = Vec::new();
    for &(from_s, to_s) in details {
        let from = time_s.partition_point(|&time| time < from_s);
        let to = time_s.partition_point(|&time| time <= to_s);
        let length = to.saturating_sub(from).min(room);
        if length > 0 {
            room -= length;
            let start = from + (to - from - length) / 2;
            windows.push(start..start + length);
        }
    }
    windows.sort_by_key(|window| window.start);
    let mut apart: Vec<Range<usize>> = Vec::new();
    for window in windows {
        match apart.last_mut() {
            Some(last) if window.start <= last.end => last.end = last.end.max(window.end),
            _ => apart.push(window),
        }
    }
    apart
}

#[cfg(test)]
mod tests;
