//! What is wrong with the log itself, beside what the model gets wrong, in words and in diagnosis.json.

use anyhow::Context;
use diagnosis::Diagnosis;
use log_quality::{Finding, Severity};

fn mistakes(found: &[Finding]) -> impl Iterator<Item = &Finding> {
    found.iter().filter(|finding| finding.severity == Severity::Mistake)
}

/// The sentence that comes before any answer from a log with mistakes in it.
pub fn mistaken(found: &[Finding]) -> Option<String> {
    let kinds: Vec<&str> = mistakes(found).map(|finding| finding.kind.name()).collect();
    (!kinds.is_empty()).then(|| {
        format!(
            "The log itself is wrong ({}): mend it first, and believe none of the rest before.",
            kinds.join(", ")
        )
    })
}

/// What to mend in the log before anything that was found in it is believed.
pub fn mend_first(found: &[Finding]) -> Vec<String> {
    let end = |mend: &str| if mend.ends_with('?') { "" } else { "." };
    mistakes(found)
        .map(|of| format!("Mend the log first: {}. {}{}", of.evidence, of.mend, end(&of.mend)))
        .collect()
}

/// diagnosis.json, with `data_quality`; where the log itself is wrong, what comes next is to mend it.
///
/// # Errors
/// A number that JSON has no form of, which none is.
pub fn json(diagnosis: &Diagnosis, found: &[Finding]) -> anyhow::Result<String> {
    let mut all = serde_json::to_value(diagnosis).context("diagnosis.json")?;
    if let Some(fields) = all.as_object_mut() {
        fields.insert("data_quality".to_owned(), serde_json::to_value(found).context("data_quality")?);
        let mend = mend_first(found);
        if !mend.is_empty() {
            fields.insert("next_experiment".to_owned(), mend.join(" ").into());
        }
    }
    serde_json::to_string_pretty(&all).context("diagnosis.json")
}
