//! Of the report: how well these data confirm the numbers that the model came with.

use diagnosis::Found;
use report::{Block, Section, Table};
use study::words::short;

/// Of a normal distribution, 95 % lies within so many standard deviations.
const CERTAIN: f64 = 1.96;

/// The section; `None` where none of the model's numbers was allowed to be off.
pub fn section(found: &Found) -> Option<Section> {
    let covariance = &found.diagnosis.covariance;
    let variances = covariance.matrix.iter().enumerate().filter_map(|(place, row)| row.get(place));
    let numbers = covariance.of.iter().zip(variances).filter_map(|(name, variance)| {
        let (id, key) = name.strip_prefix("within_tolerance.")?.split_once('.')?;
        let deviation = variance.max(0.0).sqrt();
        let corrected = &found.diagnosis.within_tolerance;
        let value = corrected.iter().find(|of| of.id.name() == id).map(|of| of.found.value);
        Some(row(id, key, value, CERTAIN * deviation))
    });
    let rows: Vec<Vec<String>> = numbers.collect();
    let header = ["number", "differs by", "with 95 % certainty within"].map(str::to_owned).to_vec();
    let section = Section::new("The numbers that the model came with").with(Block::Text(
        "As far as these data tell, and the tolerance that was allowed; what isn't narrower than that tolerance (--tolerance), \
         they don't tell."
            .to_owned(),
    ));
    (!rows.is_empty()).then(|| section.with(Block::Table(Table { header, rows })))
}

/// A factor is off by a part of it, an offset by itself.
fn row(id: &str, key: &str, value: Option<f64>, half: f64) -> Vec<String> {
    let (off, half, unit) = match key {
        "factor" => (100.0 * value.map_or(0.0, |value| value - 1.0), 100.0 * half, "%"),
        _ => (value.unwrap_or(0.0), half, "N·m"),
    };
    let shown = |value: f64| match key {
        "factor" => format!("{value:+.1}"),
        _ => short(value),
    };
    let found = if value.is_some() { format!("{} {unit}", shown(off)) } else { "nothing".to_owned() };
    vec![id.to_owned(), found, format!("{} to {} {unit}", shown(off - half), shown(off + half))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_and_how_sure_that_is() {
        let cases = [
            (("factor", None, 0.012), ["nothing", "-1.2 to +1.2 %"]),
            (("factor", Some(1.05), 0.012), ["+5.0 %", "+3.8 to +6.2 %"]),
            (("offset_nm", Some(-0.04), 0.01), ["-0.0400 N·m", "-0.0500 to -0.0300 N·m"]),
            (("offset_nm", None, 0.01), ["nothing", "-0.0100 to 0.0100 N·m"]),
        ];
        for ((key, value, half), expected) in cases {
            assert_eq!(row("coulomb-level", key, value, half)[1..], expected, "{key} {value:?}");
        }
    }
}
