//! What can be wrong with a campaign's texts.

use closed_loop::WiringError;
use config::{ConfigError, ConfigErrors};
use thiserror::Error;

/// Why texts make no campaign.
#[derive(Debug, Error)]
pub enum CampaignError {
    /// A text is wrong by itself.
    #[error(transparent)]
    Text(#[from] ConfigErrors),
    /// The plan does not fit its scenarios.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Plan(Vec<ConfigError>),
    /// A scenario and its models can't be wired.
    #[error("{file}: {source}")]
    Wiring {
        /// The scenario's file.
        file: String,
        /// Why not.
        source: WiringError,
    },
}
