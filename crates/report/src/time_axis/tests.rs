//! Reduction keeps what matters, whatever the signal.

use super::*;
use proptest::prelude::*;

/// The trace's points as values again, NaN for gaps.
fn values(trace: &Trace) -> Vec<f64> {
    trace.values.iter().map(|&value| f64::from(value) + trace.offset).collect()
}

fn same(found: f64, expected: f64, span: f64) -> bool {
    (found - expected).abs() <= 1e-7 * span.max(1e-300) || (found.is_nan() && !expected.is_finite())
}

fn signal() -> impl Strategy<Value = Vec<f64>> {
    let sample = prop_oneof![
        8 => -1e3..1e3f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(5e6),
    ];
    prop::collection::vec(sample, 0..6000)
}

proptest! {
    #[test]
    fn every_bucket_keeps_its_extremes(
        samples in signal(),
        max_points in 1000..3000usize,
        windows in prop::collection::vec((0.0..6.0f64, 0.0..1.0f64), 0..4),
    ) {
        let time: Vec<f64> = (0..samples.len()).map(|k| k as f64 * 1e-3).collect();
        let details: Vec<(f64, f64)> = windows.iter().map(|(from, length)| (*from, from + length)).collect();
        let axis = TimeAxis::with_points(&time, max_points, &details).unwrap();
        let trace = axis.trace(samples.iter().copied()).unwrap();
        let points = values(&trace);
        prop_assert_eq!(points.len(), axis.plan.time_s.len());
        prop_assert!(points.len() <= max_points + 2 * axis.plan.segments.len());
        prop_assert!(axis.plan.time_s.is_sorted());

        let mut next_point = 0;
        let mut next_sample = 0;
        for segment in &axis.plan.segments {
            prop_assert_eq!(segment.samples.start, next_sample);
            for bucket in samples[segment.samples.clone()].chunks(segment.stride) {
                let (low, high) = encode::span(bucket.iter().copied());
                let count = if segment.stride == 1 { 1 } else { 2 };
                let kept = &points[next_point..next_point + count];
                let finite = low <= high;
                let (low, high) = if finite { (low, high) } else { (f64::NAN, f64::NAN) };
                let (least, most) = if finite { encode::span(kept.iter().copied()) } else { (kept[0], kept[count - 1]) };
                prop_assert!(same(least, low, 1e7) && same(most, high, 1e7), "{:?} of {:?}", kept, bucket);
                next_point += count;
            }
            next_sample = segment.samples.end;
        }
        prop_assert_eq!(next_sample, samples.len());
    }
}

#[test]
fn ten_million_samples_fit_and_the_window_is_whole() {
    let time: Vec<f64> = (0..10_000_000).map(|k| f64::from(k) * 1e-3).collect();
    let axis = TimeAxis::new(&time, 13, &[(8000.0, 8010.0)]).unwrap();
    let points = axis.plan.time_s.len();
    assert!(points * (8 + 4 * 13) < DATA_BYTES + 1000, "{points}");
    assert!(points > 140_000, "{points}: the room is used");
    let window = axis.plan.segments.iter().find(|segment| segment.stride == 1).unwrap();
    assert_eq!(window.samples, 8_000_000..8_010_001);
    assert!(
        axis.describe().starts_with("10\u{202f}000\u{202f}000 samples; this page holds"),
        "{}",
        axis.describe()
    );
}

#[test]
fn a_window_larger_than_the_room_keeps_its_middle() {
    let time: Vec<f64> = (0..10_000).map(f64::from).collect();
    let axis = TimeAxis::with_points(&time, 1000, &[(2000.0, 7999.0), (0.0, 9.0)]).unwrap();
    let whole: Vec<_> = axis.plan.segments.iter().filter(|segment| segment.stride == 1).collect();
    assert_eq!(whole.len(), 1);
    assert_eq!(whole[0].samples, 4750..5250);
}

#[test]
fn a_window_of_one_sample_keeps_a_gap_that_its_bucket_would_lose() {
    let time: Vec<f64> = (0..4000).map(f64::from).collect();
    let gaps = |details: &[(f64, f64)]| {
        let axis = TimeAxis::with_points(&time, 1000, details).unwrap();
        let signal = time.iter().map(|&time| if time == 2001.0 { f64::NAN } else { time });
        values(&axis.trace(signal).unwrap()).iter().filter(|value| value.is_nan()).count()
    };
    assert_eq!((gaps(&[]), gaps(&[(2001.0, 2001.0)])), (0, 1));
}

#[test]
fn the_order_of_extremes_is_that_of_the_samples() {
    let time: Vec<f64> = (0..4000).map(f64::from).collect();
    let axis = TimeAxis::with_points(&time, 1000, &[]).unwrap();
    let falling = values(&axis.trace((0..4000).map(|k| -f64::from(k))).unwrap());
    assert!(falling.windows(2).all(|pair| pair[0] > pair[1]), "{falling:?}");
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let axis = TimeAxis::new(&[0.0, 1.0, 2.0], 1, &[]).unwrap();
    let found = |values: &[f64]| axis.trace(values.iter().copied()).unwrap_err().to_string();
    assert_eq!(found(&[1.0, 2.0]), "a signal of 2 samples on a time axis of 3");
    assert_eq!(found(&[1.0; 5]), "a signal of 5 samples on a time axis of 3");
    let time = |time: &[f64]| TimeAxis::new(time, 1, &[]).unwrap_err().to_string();
    assert!(time(&[0.0, 2.0, 1.0]).starts_with("row 2: time 1 s after 2 s"), "{}", time(&[0.0, 2.0, 1.0]));
    assert!(time(&[f64::NAN]).starts_with("row 0: time NaN s"));
}
