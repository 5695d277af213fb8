//! What is wrong with a log, on the terminal.

use crate::say::say;
use log_quality::{Finding, Severity};

/// Prints findings, the gravest first.
pub fn show(found: &[Finding]) {
    for finding in found {
        let grave = match finding.severity {
            Severity::Mistake => "MISTAKE",
            Severity::Note => "note",
        };
        say(format_args!("{grave} {}: {}", finding.kind.name(), finding.evidence));
        say(format_args!("  {}", finding.mend));
    }
}
