//! The product's own recordings: what `stepvalve simulate` records of a valve that is not as the belief has it, for
//! `stepvalve diagnose` with the belief.
//!
//! From a seed: one of seven shipped and ten generated scenarios, an encoder, a mode, and how the truth differs from the
//! belief. Whoever uses it runs the program; this crate writes its input and the answer key.
#![forbid(unsafe_code)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "test support: small arrays of known sizes; a failure here is the test's message"
)]

mod answer;
mod changes;
mod scenarios;

pub use answer::{Answer, answer};
pub use changes::CHANGES;

use anyhow::{Context, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::path::Path;
use valve_model::{Effect, EffectId};

/// How the scenario is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// In one thread.
    InProcess,
    /// In processes on the clock.
    RealTime,
}

impl Mode {
    /// As `simulate --mode` takes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::InProcess => "in-process",
            Self::RealTime => "realtime",
        }
    }
}

/// A recording to be made.
#[derive(Debug, Clone)]
pub struct Recording {
    /// What it was drawn from.
    pub seed: u64,
    /// How it is run.
    pub mode: Mode,
    /// Scenario, encoder and mode, in a line.
    pub what: String,
    /// How the truth differs from the belief.
    pub change: Option<Effect>,
    scenario_toml: String,
    belief_toml: String,
    truth_toml: String,
    encoder: Encoder,
}

/// The encoder's count and noise, rad; both 0 where none is fitted.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Encoder {
    pub step_rad: f64,
    pub noise_rad: f64,
}

impl Recording {
    /// Draws one; `change` is one of [`CHANGES`], or none for a truth that is the belief.
    ///
    /// # Errors
    /// Where the repository's scenarios or models can't be read.
    pub fn draw(seed: u64, change: Option<EffectId>) -> Result<Self> {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let scenario = scenarios::draw(change.is_some(), &mut rng)?;
        let counts = [None, Some(4_000.0), Some(131_072.0), Some(1_000_000.0)][rng.random_range(0..4)];
        let mode = if rng.random_bool(0.5) { Mode::InProcess } else { Mode::RealTime };
        let change = change.map(|id| changes::draw(id, &scenario.belief, &mut rng));
        let (scenario_toml, encoder) = scenario.text(seed, counts)?;
        let mut truth_toml = scenario.belief_toml.clone();
        if let Some(change) = &change {
            truth_toml.push_str(&changes::toml(change));
        }
        let fitted = counts.map_or("none".to_owned(), |counts| counts.to_string());
        let what = format!("{}, encoder {fitted}, {}", scenario.name, mode.name());
        let belief_toml = scenario.belief_toml;
        Ok(Self { seed, mode, what, change, scenario_toml, belief_toml, truth_toml, encoder })
    }

    /// Writes `scenario.toml`, `truth.toml` and `belief.toml` into a folder.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for (name, text) in [
            ("scenario.toml", &self.scenario_toml),
            ("truth.toml", &self.truth_toml),
            ("belief.toml", &self.belief_toml),
        ] {
            std::fs::write(folder.join(name), text)
                .with_context(|| folder.join(name).display().to_string())?;
        }
        Ok(())
    }
}
