//! report.html: the answer in one sentence, then what it rests on.

use diagnosis::{Found, Verdict};
use log_data::Log;
use report::{Block, Page, Section, Table};

/// The answer in one sentence.
pub fn headline(found: &Found) -> String {
    let diagnosis = &found.diagnosis;
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.id.as_str()).collect();
    match diagnosis.verdict {
        Verdict::NoDiscrepancy => "The model agrees with the measurement to within its noise.".to_owned(),
        Verdict::Unexplained => "The model misses something that no known cause explains.".to_owned(),
        Verdict::Ambiguous => {
            "The model misses something, and these data can't tell which cause it is.".to_owned()
        }
        _ => format!(
            "The model lacks {}: with it the error on runs not used for fitting falls from {:.3e} to {:.3e}.",
            names.join(" and "),
            diagnosis.gain.rms_before,
            diagnosis.gain.rms_after
        ),
    }
}

/// The page.
pub fn page(found: &Found, log: &Log, log_file: &str, model_file: &str, headline: &str) -> String {
    let mut page = Page::new(format!("Diagnosis: {}", log.title), headline);
    let rows = found
        .diagnosis
        .causes
        .iter()
        .flat_map(|cause| {
            cause.parameters.iter().map(|(key, of)| (cause.id.clone(), key.clone(), of.clone()))
        })
        .map(|(id, key, of)| {
            vec![id, key, format!("{:.5}", of.value), format!("{:.5} to {:.5}", of.ci95[0], of.ci95[1])]
        })
        .collect();
    let header = ["cause", "parameter", "value", "95 %"].map(str::to_owned).to_vec();
    page.sections.push(Section::new("Parameters").with(Block::Table(Table { header, rows })));
    page.sections.push(Section::new("Made from").with(Block::Text(format!("{log_file} and {model_file}"))));
    page.to_html()
}
