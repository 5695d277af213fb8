//! A scenario with its models, as they are before anything is varied.

use crate::error::CampaignError;
use closed_loop::{Parts, wire};
use config::{
    Editable, Scenario, Target, belief_warnings, check_against_models, parse_model, parse_scenario,
};
use serde::{Deserialize, Serialize};
use valve_model::Model;

/// A text and the name of its file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The file, as errors name it.
    pub file: String,
    /// Its text.
    pub text: String,
}

/// The three texts of a scenario.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BaseTexts {
    /// The scenario.
    pub scenario: Source,
    /// The simulated plant's model.
    pub truth: Source,
    /// The controller's model.
    pub belief: Source,
}

impl BaseTexts {
    /// One of them.
    pub fn of(&self, target: Target) -> &Source {
        match target {
            Target::Scenario => &self.scenario,
            Target::Truth => &self.truth,
            Target::Belief => &self.belief,
        }
    }
}

/// The texts, read and checked. What a run does not vary is not read again.
#[derive(Debug, Clone)]
pub(crate) struct Base {
    pub(crate) texts: BaseTexts,
    pub(crate) scenario: Scenario,
    pub(crate) truth: Model,
    pub(crate) belief: Model,
    pub(crate) parts: Parts,
    editable: [Editable; 3],
}

impl Base {
    pub(crate) fn new(texts: BaseTexts) -> Result<Self, CampaignError> {
        let scenario = parse_scenario(&texts.scenario.text, &texts.scenario.file)?;
        let truth = parse_model(&texts.truth.text, &texts.truth.file)?;
        let belief = parse_model(&texts.belief.text, &texts.belief.file)?;
        let file = &texts.scenario.file;
        check_against_models(&scenario, &truth, &belief, &texts.scenario.text, file)?;
        let parts = wire(&scenario, &truth, &belief)
            .map_err(|source| CampaignError::Wiring { file: file.clone(), source })?;
        // Their readers took them as TOML.
        let editable = Target::ALL.map(|target| Editable::new(&texts.of(target).text).unwrap_or_default());
        Ok(Self { texts, scenario, truth, belief, parts, editable })
    }

    /// A text to be changed.
    pub(crate) fn editable(&self, target: Target) -> &Editable {
        let [truth, belief, scenario] = &self.editable;
        match target {
            Target::Truth => truth,
            Target::Belief => belief,
            Target::Scenario => scenario,
        }
    }

    /// What is allowed but may surprise.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = self.scenario.warnings();
        warnings.extend(belief_warnings(&self.scenario, &self.belief));
        warnings
    }
}
