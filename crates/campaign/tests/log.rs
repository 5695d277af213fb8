//! The log of rows: cut at every length, changed in every byte, it gives back the rows before, and never wrong ones.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)]

mod common;

use campaign::log::{Contents, Head, LogError, begin, read, row};
use campaign::{Diagnosed, Failure, MotionMetrics, Row, Stage};
use proptest::prelude::*;

fn head() -> Head {
    Head::new(&common::campaign(common::THREE).unwrap(), "1.2.3")
}

fn rows() -> Vec<Row> {
    let motion = MotionMetrics {
        error_rms_rad: 1e-3,
        error_peak_rad: 2e-3,
        measured_error_rms_rad: f64::MAX,
        measured_error_peak_rad: -0.0,
        final_error_rad: 5e-324,
        torque_reserve_min_nm: -3.5,
        pulse_rate_peak_hz: 2e5,
        limiting_cycles: u64::MAX,
        lost_steps: 3,
        alarms: 5,
        fault: 2,
        fault_cycle: 17,
    };
    let diagnosed = Diagnosed {
        verdict: "explained".to_owned(),
        causes: vec!["coulomb-level".to_owned()],
        ambiguous: vec![vec!["a".to_owned(), "b".to_owned()]],
        residual_rms_rad: 1e-4,
        gain_ratio: 0.5,
    };
    let failure = Failure { stage: Stage::Simulation, reason: "truth.toml:3:4: found ö".to_owned() };
    vec![
        Row { run: 7, motion: Some(motion), diagnosed: Some(diagnosed), failure: None },
        Row { run: 0, motion: None, diagnosed: None, failure: Some(failure) },
        Row { run: 3, motion: None, diagnosed: None, failure: None },
    ]
}

/// The log, and where its head and each row end.
fn written() -> (Vec<u8>, Vec<usize>) {
    let mut bytes = begin(&head()).unwrap();
    let mut ends = vec![bytes.len()];
    for one in rows() {
        bytes.extend(row(&one).unwrap());
        ends.push(bytes.len());
    }
    (bytes, ends)
}

fn check(contents: &Contents, whole_rows: usize, ends: &[usize]) {
    let expected: Vec<Row> = rows().into_iter().take(whole_rows).collect();
    assert_eq!(contents.rows.len(), whole_rows);
    assert!(expected.iter().all(|row| contents.rows[&row.run] == *row));
    assert_eq!(contents.whole_bytes, ends[whole_rows]);
}

#[test]
fn cut_at_every_length() {
    let (bytes, ends) = written();
    assert_eq!(read(&bytes).unwrap().head, head());
    for length in 0..=bytes.len() {
        let whole = ends.iter().filter(|end| **end <= length).count();
        match read(&bytes[..length]) {
            Ok(contents) => check(&contents, whole - 1, &ends),
            Err(error) => {
                assert_eq!(whole, 0, "{length}");
                assert!(matches!(error, LogError::Format | LogError::Head { .. }), "{error}");
            }
        }
    }
}

#[test]
fn every_byte_changed() {
    let (bytes, ends) = written();
    // The head is long: its beginning, its end, and some of what is between. All rows.
    let places = (0..300).chain((300..ends[0]).step_by(97)).chain(ends[0] - 20..bytes.len());
    for place in places {
        for bit in 0..8 {
            let mut changed = bytes.clone();
            changed[place] ^= 1 << bit;
            let before = ends.iter().filter(|end| **end <= place).count();
            match read(&changed) {
                Ok(contents) => {
                    // The row that is damaged is lost, and no other.
                    let others: Vec<Row> = rows()
                        .into_iter()
                        .enumerate()
                        .filter(|(at, _)| at + 1 != before)
                        .map(|of| of.1)
                        .collect();
                    assert_eq!(contents.rows.len(), others.len(), "byte {place}, bit {bit}");
                    assert!(others.iter().all(|row| contents.rows[&row.run] == *row));
                    let is_last = before == rows().len();
                    assert_eq!(contents.whole_bytes, ends[if is_last { before - 1 } else { rows().len() }]);
                    let damaged = if is_last { 0 } else { ends[before] - ends[before - 1] };
                    assert_eq!(contents.damaged_bytes, damaged);
                }
                Err(_) => assert_eq!(before, 0, "byte {place}, bit {bit}"),
            }
        }
    }
}

#[test]
fn what_changed_is_named() {
    let one = head();
    assert!(one.differences(&one).is_empty());
    let mut other = one.clone();
    other.program_version = "2.0.0".to_owned();
    other.plan.text = other.plan.text.replace("runs = 16", "runs = 17");
    other.bases[0].belief.text.push_str("[extra]\n");
    other.bases[0].truth.file = "elsewhere/truth.toml".to_owned();
    // What changes no row: comments, and how many may fail.
    let mut alike = one.clone();
    alike.bases[0].truth.text.push_str("# a comment\n");
    alike.plan.text.insert_str(0, "failure_limit = 3\n");
    assert!(one.differences(&alike).is_empty(), "{:?}", one.differences(&alike));
    let found = one.differences(&other).join("; ");
    assert!(
        found.starts_with(
            "stepvalve 1.2.3 is 2.0.0 now; the plan plan.toml, line 7; the belief belief.toml, line"
        ),
        "{found}"
    );
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
        let (log, ends) = written();
        let more = [&log[..], &bytes].concat();
        let contents = read(&more).unwrap();
        prop_assert!(contents.whole_bytes >= ends[3]);
        prop_assert!(rows().iter().all(|row| contents.rows[&row.run] == *row));
    }
}
