//! Whether this machine holds the stated period, by what was found and what was measured.

use super::finding::Finding;
use super::measure::Measurement;
use super::target::Target;
use serde::Serialize;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nothing stands in the way, and no wake-up was too late.
    InReach,
    /// Nothing stands in the way; fewer than one wake-up in 1000 was too late, none for so long that it stops the valve.
    InReachWithMisses,
    /// Something stands in the way, or wake-ups are too late too often or for too long.
    OutOfReach,
    /// It was not measured.
    Unknown,
}

impl Verdict {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::InReach => "in reach",
            Self::InReachWithMisses => "in reach, with missed messages",
            Self::OutOfReach => "OUT OF REACH",
            Self::Unknown => "unknown",
        }
    }
}

/// Judges, with the reasons.
pub fn judge(
    target: &Target,
    findings: &[Finding],
    measurement: Option<&Measurement>,
) -> (Verdict, Vec<String>) {
    let mut reasons: Vec<_> = findings
        .iter()
        .filter(|finding| finding.blocks)
        .map(|finding| format!("{}: {}", finding.what, finding.found))
        .collect();
    let mut misses = false;
    if let Some(measured) = measurement {
        let us = |ns: u64| ns as f64 / 1e3;
        let (late, all) = (measured.late, measured.wake_ups);
        if measured.p999_ns > target.tolerated_ns {
            reasons.push(format!(
                "{late} of {all} wake-ups, more than one in 1000, were later than the {} µs that the loop tolerates",
                us(target.tolerated_ns)
            ));
        }
        if measured.max_ns > target.silence_ns {
            reasons.push(format!(
                "a wake-up was {} µs late; after {} µs of silence (silence_cycles) the valve is stopped",
                us(measured.max_ns),
                us(target.silence_ns)
            ));
        }
        misses = late > 0;
    }
    if !reasons.is_empty() {
        return (Verdict::OutOfReach, reasons);
    }
    let Some(measured) = measurement else {
        return (Verdict::Unknown, vec!["it was not measured".to_owned()]);
    };
    let told = format!(
        "{} of {} wake-ups were later than the {} µs that the loop tolerates",
        measured.late,
        measured.wake_ups,
        target.tolerated_ns as f64 / 1e3
    );
    (if misses { Verdict::InReachWithMisses } else { Verdict::InReach }, vec![told])
}
