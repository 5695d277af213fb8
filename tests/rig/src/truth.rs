//! What a campaign hides, for whoever judges a finding.

use crate::log_kind::LogKind;
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

/// What is not as it should be although it is no hidden effect: of the real family.
#[derive(Debug, Clone, Default)]
pub struct Imperfect {
    /// The standard deviation that the model's numbers are known with, as a part of each.
    pub tolerance: f64,
    /// What may be named beside what is hidden, since it is there: a transducer that follows late, an angle's zero.
    pub also_true: Vec<String>,
    /// How much later than the angle a torque's transducer is where the torque is slow, s; also where it hardly shows.
    pub torque_lag_s: Option<f64>,
    /// What was drawn, for whoever looks at a case.
    pub world: Map<String, Value>,
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
    /// The real family's imperfections.
    pub imperfect: Option<Imperfect>,
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
        let mut all = json!({
            "seed": self.seed,
            "log": match self.log { LogKind::Torque => "torque", LogKind::Angle => "angle" },
            "hidden": effects, "noise": self.noise, "encoder_step_rad": self.encoder_step_rad,
            "twins": self.twins, "near_twins": self.near_twins, "verdict": self.verdict,
        });
        if let (Some(of), Some(all)) = (&self.imperfect, all.as_object_mut()) {
            all.insert("tolerance".to_owned(), json!(of.tolerance));
            all.insert("also_true".to_owned(), json!(of.also_true));
            all.insert("torque_lag_s".to_owned(), json!(of.torque_lag_s));
            all.insert("world".to_owned(), json!(of.world));
        }
        all
    }
}
