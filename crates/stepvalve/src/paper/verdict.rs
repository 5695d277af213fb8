//! What became of the paper's statements, each from the numbers that were found.

use super::{Fact, Short};
use anyhow::{Context, Result};
use serde_json::{Value, json};

/// What became of a statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The numbers say the same.
    Agrees,
    /// They say otherwise.
    Refuted,
    /// What the paper gives doesn't decide it.
    Open,
}

impl Outcome {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Refuted => "refuted",
            Self::Open => "open",
        }
    }

    fn of(agrees: bool) -> Self {
        if agrees { Self::Agrees } else { Self::Refuted }
    }
}

/// A statement of the paper's, and what became of it.
pub struct Verdict {
    /// The statement.
    pub claim: &'static str,
    /// What became of it.
    pub outcome: Outcome,
    /// The numbers that say so.
    pub why: String,
}

impl Verdict {
    /// For paper.json.
    pub fn to_json(&self) -> Value {
        json!({ "claim": self.claim, "outcome": self.outcome.word(), "why": self.why })
    }
}

/// All of them in one sentence.
pub fn headline(verdicts: &[Verdict]) -> String {
    let count = |outcome| verdicts.iter().filter(|verdict| verdict.outcome == outcome).count();
    format!(
        "{} statements of the paper, held against its own numbers: {} refuted, {} in agreement, {} open.",
        verdicts.len(),
        count(Outcome::Refuted),
        count(Outcome::Agrees),
        count(Outcome::Open)
    )
}

/// The numbers by name.
struct Numbers<'a>(&'a [Fact]);

impl Numbers<'_> {
    fn get(&self, id: &str) -> Result<f64> {
        let fact = self.0.iter().find(|fact| fact.id == id);
        Ok(fact.with_context(|| format!("no number {id}"))?.value)
    }

    fn show(&self, id: &str) -> Result<String> {
        Ok(in_words(self.get(id)?))
    }

    /// The paper's own value of it.
    fn stated(&self, id: &str) -> Result<f64> {
        let fact = self.0.iter().find(|fact| fact.id == id).and_then(|fact| fact.stated);
        fact.with_context(|| format!("the paper states no {id}"))
    }
}

/// A number as a sentence holds it: three digits.
fn in_words(value: f64) -> String {
    let size = value.abs();
    let rounded = if size < 1e-3 { value } else { format!("{value:.2e}").parse().unwrap_or(value) };
    Short(rounded).to_string()
}

/// Equal to within what three digits say.
fn close(found: f64, stated: f64) -> bool {
    (found - stated).abs() <= 0.005 * stated.abs()
}

/// The verdicts.
///
/// # Errors
/// Where a number is missing.
pub fn verdicts(facts: &[Fact]) -> Result<Vec<Verdict>> {
    let numbers = Numbers(facts);
    Ok(vec![
        turning(&numbers)?,
        viscous(&numbers)?,
        static_ratio(&numbers)?,
        bristles(&numbers)?,
        mean(&numbers)?,
        level(&numbers)?,
        peak(&numbers)?,
    ])
}

fn turning(numbers: &Numbers<'_>) -> Result<Verdict> {
    let mut turns = 0.0;
    for set in ["initial", "revised"] {
        for rate in [200, 600] {
            turns += numbers.get(&format!("rotation_{rate}khz_{set}_follows"))?;
        }
    }
    Ok(Verdict {
        claim: "the motor turns the valve at 200 and 600 kHz with either parameter set",
        outcome: Outcome::of(turns == 4.0),
        why: format!(
            "it turns in {turns} of 4 cases; the revised set asks {} and {} N·m of a motor that holds {}",
            numbers.show("needed_revised_200khz")?,
            numbers.show("needed_revised_600khz")?,
            numbers.stated("needed_revised_200khz")?
        ),
    })
}

fn viscous(numbers: &Numbers<'_>) -> Result<Verdict> {
    let stated = numbers.stated("sigma2_radii")?;
    let (radii, diameters) = (numbers.get("sigma2_radii")?, numbers.get("sigma2_diameters")?);
    Ok(Verdict {
        claim: "σ2 = 0.4 N·m·s/rad is equation (4)",
        outcome: Outcome::of(close(radii, stated) || close(diameters, stated)),
        why: format!(
            "with 50 mm of spool and 46 cSt it gives {} (radii) or {} N·m·s/rad (diameters)",
            in_words(radii),
            in_words(diameters)
        ),
    })
}

fn static_ratio(numbers: &Numbers<'_>) -> Result<Verdict> {
    Ok(Verdict {
        claim: "T_s/T_c = 1.2 of Table 1 confirms equation (12)",
        outcome: Outcome::Open,
        why: format!(
            "the ratio, {}, was made by (12); the revised set has {}",
            numbers.show("static_ratio_table_1")?,
            numbers.show("static_ratio_revised")?
        ),
    })
}

fn bristles(numbers: &Numbers<'_>) -> Result<Verdict> {
    let (root, stated) = (numbers.get("root_of_stiffness")?, numbers.stated("root_of_stiffness")?);
    let copied = close(root, stated);
    Ok(Verdict {
        claim: "σ0, σ1 and ω_s are this valve's",
        outcome: if copied { Outcome::Refuted } else { Outcome::Open },
        why: format!(
            "σ1 = {stated} is √σ0 = {root:.3}, as in the textbook's example; ω_s is {} micro-steps a second",
            numbers.show("stribeck_microsteps_per_s")?
        ),
    })
}

fn mean(numbers: &Numbers<'_>) -> Result<Verdict> {
    let stated = numbers.stated("rotation_200khz_rig_mean")?;
    let means = [numbers.get("rotation_200khz_rig_mean")?, numbers.get("rotation_600khz_rig_mean")?];
    Ok(Verdict {
        claim: "the torque is 1.5 N·m on average at both rates",
        outcome: Outcome::of(means.iter().all(|mean| close(*mean, stated))),
        why: format!(
            "rig.toml, whose σ2 is that of equation (4), gives {} and {} N·m",
            in_words(means[0]),
            in_words(means[1])
        ),
    })
}

fn level(numbers: &Numbers<'_>) -> Result<Verdict> {
    let ratio = numbers.get("coulomb_over_measured")?;
    Ok(Verdict {
        claim: "T_c = 2 N·m fits the measured mean",
        outcome: Outcome::of(close(ratio, 1.0)),
        why: format!("it is {} times the mean, which holds all friction in sliding", in_words(ratio)),
    })
}

fn peak(numbers: &Numbers<'_>) -> Result<Verdict> {
    Ok(Verdict {
        claim: "the 3 N·m at the start are T_s",
        outcome: Outcome::Open,
        why: format!(
            "the peak depends on the ramp, which is not given: with T_s = 3 it is {} N·m at 0.001 and {} N·m at 100 rad/s²",
            numbers.show("peak_slowest_rig")?,
            numbers.show("peak_at_100_rig")?
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fact(id: &str, value: f64, stated: f64) -> Fact {
        Fact { group: "", id: id.to_owned(), text: String::new(), value, unit: "1", stated: Some(stated) }
    }

    #[test]
    fn a_statement_agrees_or_is_refuted_by_its_number() {
        for (verdict, id, value, stated, outcome) in [
            (level as fn(&Numbers<'_>) -> _, "coulomb_over_measured", 1.0, 1.0, Outcome::Agrees),
            (level, "coulomb_over_measured", 1.33, 1.0, Outcome::Refuted),
        ] {
            let facts = [fact(id, value, stated)];
            assert_eq!(verdict(&Numbers(&facts)).unwrap().outcome, outcome, "{id} {value}");
        }
        let sigma2 = |radii| [fact("sigma2_radii", radii, 0.4), fact("sigma2_diameters", 1.0, 0.4)];
        assert_eq!(viscous(&Numbers(&sigma2(0.4))).unwrap().outcome, Outcome::Agrees);
        assert_eq!(viscous(&Numbers(&sigma2(1e-4))).unwrap().outcome, Outcome::Refuted);
        let mean = |second| {
            [fact("rotation_200khz_rig_mean", 1.5, 1.5), fact("rotation_600khz_rig_mean", second, 1.5)]
        };
        assert_eq!(super::mean(&Numbers(&mean(1.507))).unwrap().outcome, Outcome::Agrees);
        assert_eq!(super::mean(&Numbers(&mean(2.0))).unwrap().outcome, Outcome::Refuted);
        assert!(level(&Numbers(&[])).is_err());
    }
}
