//! What unit tests of several files begin with.

use valve_model::{Effect, FrictionParams, LoadParams, LuGreParams, Model};

/// LuGre friction, a load, and these effects.
pub(crate) fn model(effects: Vec<Effect>) -> Model {
    let friction = FrictionParams::LuGre(LuGreParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 2e-4,
    });
    Model {
        name: String::new(),
        motor: None,
        load: Some(LoadParams { inertia_kg_m2: 1e-3 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects,
    }
}
