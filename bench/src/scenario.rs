//! The shipped sine scenario at any period and length: every cycle has the controller at work.

use anyhow::{Context, Result, anyhow};
use closed_loop::{Parts, wire};
use config::{parse_model, parse_scenario};
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item, Table, value};

/// The scenario that all benches run.
const SHIPPED: &str = "rt-config/scenarios/sine-1hz.toml";

/// Phases of plant, trajectory and controller in hundredths of the period: evenly spaced, so that cyclictest, which
/// knows only that, has the same.
const PHASES_PERCENT: [(&str, u64); 3] =
    [("plant-simulator", 0), ("trajectory-generator", 20), ("step-controller", 40)];

/// What is different from the shipped scenario.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    /// Length of a cycle, ns.
    pub period_ns: u64,
    /// Cycles between arming and the scenario's end.
    pub cycles: u64,
    /// Seed of the encoder's noise.
    pub seed: u64,
    /// The processes wake so long before their deadlines, ns; 0: they sleep to them.
    pub early_ns: u64,
}

impl Variant {
    /// So many cycles of 1 ms.
    pub fn of_1khz(cycles: u64) -> Self {
        Self { period_ns: 1_000_000, cycles, seed: 2, early_ns: 0 }
    }

    /// The offset of each process from the one before, ns.
    pub fn spacing_ns(&self) -> u64 {
        self.period_ns / 5
    }

    /// The scenario's text; models by absolute path.
    ///
    /// # Errors
    /// Where the shipped scenario is not what it was.
    pub fn text(&self) -> Result<String> {
        let path = repository().join(SHIPPED);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let mut scenario: DocumentMut = text.parse().context(SHIPPED)?;
        scenario.insert("period", value(format!("{}us", self.period_ns as f64 / 1e3)));
        scenario.insert("duration", value(self.cycles as f64 * self.period_ns as f64 / 1e9));
        scenario.insert("seed", value(i64::try_from(self.seed)?));
        for model in ["truth", "belief"] {
            let name = scenario.get(model).and_then(Item::as_str).context("a model")?.to_owned();
            let absolute = repository().join("rt-config/scenarios").join(name).canonicalize()?;
            scenario.insert(model, value(absolute.display().to_string()));
        }
        // Fifty cycles at 1 kHz: shorter ones shall bridge the same stalls.
        let silence = 50_000_000 / self.period_ns.max(1);
        table(&mut scenario, "safety")?
            .insert("silence_cycles", value(i64::try_from(silence.clamp(50, 500))?));
        let timing = table(&mut scenario, "timing")?;
        if self.early_ns > 0 {
            timing.insert("early", value(format!("{}us", self.early_ns as f64 / 1e3)));
        }
        for (process, percent) in PHASES_PERCENT {
            let section =
                timing.get_mut(process).and_then(Item::as_table_mut).context("a process's timing")?;
            section.insert("phase", value(format!("{}us", (self.period_ns * percent / 100) as f64 / 1e3)));
        }
        only_the_sine(&mut scenario)?;
        Ok(scenario.to_string())
    }

    /// Writes it to a file.
    ///
    /// # Errors
    /// As [`Self::text`], or where it can't be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, self.text()?).with_context(|| path.display().to_string())
    }

    /// The parts for one thread.
    ///
    /// # Errors
    /// Where the scenario or a model is refused.
    pub fn parts(&self) -> Result<Parts> {
        let text = self.text()?;
        let scenario = parse_scenario(&text, SHIPPED).map_err(|errors| anyhow!("{errors}"))?;
        let model = |path: &str| {
            let text = std::fs::read_to_string(path).with_context(|| path.to_owned())?;
            parse_model(&text, path).map_err(|errors| anyhow!("{errors}"))
        };
        let (truth, belief) = (model(&scenario.truth)?, model(&scenario.belief)?);
        Ok(wire(&scenario, &truth, &belief)?)
    }
}

/// The repository that this program was built from.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

fn table<'a>(scenario: &'a mut DocumentMut, name: &str) -> Result<&'a mut Table> {
    scenario.get_mut(name).and_then(Item::as_table_mut).with_context(|| format!("{SHIPPED}: no [{name}]"))
}

/// The sine from the beginning to the end; the hold of the shipped one would come in the middle of a longer run.
fn only_the_sine(scenario: &mut DocumentMut) -> Result<()> {
    let points =
        scenario.get_mut("set_point").and_then(Item::as_array_of_tables_mut).context("set-points")?;
    while points.len() > 1 {
        points.remove(points.len() - 1);
    }
    points.get_mut(0).context("a set-point")?.insert("time", value(0.005));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_period_that_is_measured_makes_a_scenario() {
        for period_us in [100, 125, 250, 500, 1000] {
            let variant =
                Variant { period_ns: period_us * 1000, cycles: 1000, seed: 7, early_ns: period_us * 100 };
            let parts = variant.parts().unwrap();
            assert_eq!(parts.timeline.period_ns, variant.period_ns);
            assert_eq!(parts.timeline.disarm_cycle - parts.timeline.arm_cycle, 1000);
        }
    }
}
