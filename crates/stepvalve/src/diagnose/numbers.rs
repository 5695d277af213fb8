//! Of the report: how well these data confirm the numbers that the model came with.

use diagnosis::Found;
use report::{Block, Section, Table};
use study::words::short;

/// Of a normal distribution, 95 % lies within so many standard deviations.
const CERTAIN: f64 = 1.96;
/// What a number of the model is multiplied by; 1 is as given.
const FACTOR: &str = "factor";

/// The section; `None` where none of the model's numbers was allowed to be off.
pub fn section(found: &Found) -> Option<Section> {
    let covariance = &found.diagnosis.covariance;
    let variances = covariance.matrix.iter().enumerate().filter_map(|(place, row)| row.get(place));
    let numbers = covariance.of.iter().zip(variances).filter_map(|(name, variance)| {
        let (id, key) = name.strip_prefix("within_tolerance.")?.split_once('.')?;
        let corrected = found.diagnosis.within_tolerance.iter().find(|of| of.id.name() == id);
        // Of a number that was corrected the interval is the one that is told everywhere.
        let half = CERTAIN * variance.max(0.0).sqrt();
        let neutral = if key == FACTOR { 1.0 } else { 0.0 };
        let range = corrected.map_or([neutral - half, neutral + half], |of| of.found.ci95);
        Some(row(id, key, corrected.map(|of| of.found.value), range))
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
fn row(id: &str, key: &str, value: Option<f64>, [from, to]: [f64; 2]) -> Vec<String> {
    let shown = |value: f64| match key {
        FACTOR => format!("{:+.1}", 100.0 * (value - 1.0)),
        _ => short(value),
    };
    let unit = if key == FACTOR { "%" } else { "N·m" };
    let off = value.map_or("nothing".to_owned(), |value| format!("{} {unit}", shown(value)));
    vec![id.to_owned(), off, format!("{} to {} {unit}", shown(from), shown(to))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_and_how_sure_that_is() {
        let cases = [
            (("factor", None, [0.988, 1.012]), ["nothing", "-1.2 to +1.2 %"]),
            (("factor", Some(1.05), [1.038, 1.062]), ["+5.0 %", "+3.8 to +6.2 %"]),
            (("offset_nm", Some(-0.04), [-0.05, -0.03]), ["-0.0400 N·m", "-0.0500 to -0.0300 N·m"]),
            (("offset_nm", None, [-0.01, 0.01]), ["nothing", "-0.0100 to 0.0100 N·m"]),
        ];
        for ((key, value, range), expected) in cases {
            assert_eq!(row("coulomb-level", key, value, range)[1..], expected, "{key} {value:?}");
        }
    }
}
