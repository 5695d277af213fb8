//! What a campaign hides, for whoever judges a finding.

use crate::hidden::LogKind;
use serde_json::{Map, Value, json};

/// One hidden effect.
#[derive(Debug, Clone)]
pub struct HiddenEffect {
    /// Its name.
    pub id: String,
    /// Its parameters, by the names of the product's effect where there is one.
    pub parameters: Map<String, Value>,
    /// Whether rig and product give it the same functional form, so that parameters may be compared.
    pub same_form: bool,
    /// Residual over noise, over the runs where it acts.
    pub strength: f64,
    /// The runs where it acts.
    pub acts_in: Vec<String>,
}

/// The truth about a campaign.
#[derive(Debug, Clone)]
pub struct Truth {
    /// The seed that it was drawn from.
    pub seed: u64,
    /// The log's kind.
    pub log: LogKind,
    /// What is hidden.
    pub effects: Vec<HiddenEffect>,
    /// Standard deviation of the noise of the predicted channel, N·m or rad.
    pub noise: f64,
    /// The encoder's step, rad.
    pub encoder_step_rad: f64,
    /// Causes that these data can't tell from the hidden one; empty where they can.
    pub twins: Vec<String>,
    /// Causes that a noisy encoder hardly tells from the hidden one: by itself or beside these it is named rightly.
    pub near_twins: Vec<String>,
    /// The verdict that a diagnosis should come to.
    pub verdict: &'static str,
}

impl Truth {
    /// For `truth.json`.
    pub fn json(&self) -> Value {
        let effects: Vec<Value> = self
            .effects
            .iter()
            .map(|effect| {
                json!({
                    "id": effect.id, "parameters": effect.parameters, "same_form": effect.same_form,
                    "strength": effect.strength, "acts_in": effect.acts_in,
                })
            })
            .collect();
        json!({
            "seed": self.seed,
            "log": match self.log { LogKind::Torque => "torque", LogKind::Angle => "angle" },
            "hidden": effects, "noise": self.noise, "encoder_step_rad": self.encoder_step_rad,
            "twins": self.twins, "near_twins": self.near_twins, "verdict": self.verdict,
        })
    }
}
