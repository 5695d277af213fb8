//! Fixtures of unit tests in several files.

use valve_model::{Effect, LoadParams, Model};

/// LuGre friction, a load, no motor, and these effects.
pub(crate) fn model(effects: Vec<Effect>) -> Model {
    Model { motor: None, load: Some(LoadParams { inertia_kg_m2: 1e-3 }), effects, ..Model::bench_rig() }
}
