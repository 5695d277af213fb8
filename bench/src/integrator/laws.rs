//! The laws and parameters that are compared: soft bristles, and the paper's Table 1 with torques at which it turns.

use super::motions::Motion;
use anyhow::{Context, Result};
use valve_model::{
    DahlParams, FrictionParams, LeuvenParams, LoadParams, LuGreParams, Model, MotorParams, StribeckParams,
    ValveParams,
};

/// A law with its parameters.
pub struct Contact {
    /// What the parameters are called.
    pub name: &'static str,
    /// The parameters.
    pub friction: FrictionParams,
}

impl Contact {
    /// The law's name.
    pub fn law(&self) -> &'static str {
        self.friction.law()
    }

    /// Whether the table has this motion for this contact: the other laws are there for two of them.
    pub fn can(&self, motion: &Motion) -> bool {
        matches!(self.friction, FrictionParams::LuGre(_)) || motion.for_all_laws
    }

    /// The shaft with this contact, as the reference knows it.
    ///
    /// # Errors
    /// Never, with the parameters of this file.
    pub fn valve(&self) -> Result<ValveParams> {
        ValveParams::new(&model(self.friction)).context("the shaft")
    }

    /// Law, shaft and contact as the peer's arguments.
    pub fn arguments(&self) -> Vec<String> {
        let curve =
            |p: &LuGreParams| [p.coulomb_torque_nm, p.static_torque_nm, p.stribeck_velocity_rad_per_s];
        let soft = soft();
        let (contact, extra) = match &self.friction {
            FrictionParams::LuGre(p) => {
                let [tc, ts, ws] = curve(p);
                let bristles =
                    [p.bristle_stiffness_nm_per_rad, p.bristle_damping_nm_s_per_rad, p.viscous_nm_s_per_rad];
                ([[tc, ts, ws], bristles].concat(), [0.0, 0.0, 0.0])
            }
            FrictionParams::Leuven(p) => {
                let bristles =
                    [p.bristle_stiffness_nm_per_rad, p.bristle_damping_nm_s_per_rad, p.viscous_nm_s_per_rad];
                let curve = [p.coulomb_torque_nm, p.static_torque_nm, p.stribeck_velocity_rad_per_s];
                let extra =
                    [p.transition_exponent, f64::from(p.maxwell_elements), p.maxwell_saturation_ratio];
                ([curve, bristles].concat(), extra)
            }
            FrictionParams::Dahl(p) => {
                let curve = [p.coulomb_torque_nm, soft.static_torque_nm, soft.stribeck_velocity_rad_per_s];
                let bristles = [p.bristle_stiffness_nm_per_rad, 0.0, p.viscous_nm_s_per_rad];
                ([curve, bristles].concat(), [p.dahl_exponent, 0.0, 0.0])
            }
            FrictionParams::Stribeck(p) => {
                let curve = [p.coulomb_torque_nm, p.static_torque_nm, p.stribeck_velocity_rad_per_s];
                let bristles = [soft.bristle_stiffness_nm_per_rad, 0.0, p.viscous_nm_s_per_rad];
                ([curve, bristles].concat(), [p.regularisation_velocity_rad_per_s, 0.0, 0.0])
            }
        };
        let motor = motor();
        let inertia = motor.rotor_inertia_kg_m2 + LOAD_INERTIA_KG_M2;
        let shaft =
            [inertia, motor.holding_torque_nm, f64::from(motor.rotor_teeth), motor.damping_nm_s_per_rad];
        let numbers = shaft.into_iter().chain(contact).chain(extra).map(|number| number.to_string());
        [self.law().to_owned()].into_iter().chain(numbers).collect()
    }
}

const LOAD_INERTIA_KG_M2: f64 = 1e-4;

/// Every contact of the table.
pub fn all() -> Vec<Contact> {
    let soft = soft();
    let stribeck = StribeckParams {
        coulomb_torque_nm: soft.coulomb_torque_nm,
        static_torque_nm: soft.static_torque_nm,
        stribeck_velocity_rad_per_s: soft.stribeck_velocity_rad_per_s,
        stribeck_exponent: soft.stribeck_exponent,
        viscous_nm_s_per_rad: soft.viscous_nm_s_per_rad,
        regularisation_velocity_rad_per_s: 1e-3,
    };
    let dahl = |dahl_exponent: f64| DahlParams {
        coulomb_torque_nm: soft.coulomb_torque_nm,
        bristle_stiffness_nm_per_rad: soft.bristle_stiffness_nm_per_rad,
        viscous_nm_s_per_rad: soft.viscous_nm_s_per_rad,
        dahl_exponent,
    };
    let leuven = LeuvenParams {
        coulomb_torque_nm: soft.coulomb_torque_nm,
        static_torque_nm: soft.static_torque_nm,
        stribeck_velocity_rad_per_s: soft.stribeck_velocity_rad_per_s,
        stribeck_exponent: soft.stribeck_exponent,
        bristle_stiffness_nm_per_rad: soft.bristle_stiffness_nm_per_rad,
        bristle_damping_nm_s_per_rad: soft.bristle_damping_nm_s_per_rad,
        viscous_nm_s_per_rad: soft.viscous_nm_s_per_rad,
        transition_exponent: 10.0,
        maxwell_elements: 10,
        maxwell_saturation_ratio: 1.3,
        maxwell_spacing_exponent: 1.0,
        maxwell_tail_exponent: 0.0,
        maxwell_curve_share: 0.0,
        maxwell_damping_share: 0.0,
    };
    vec![
        Contact { name: "soft", friction: FrictionParams::LuGre(soft) },
        Contact { name: "Table 1", friction: FrictionParams::LuGre(table_1()) },
        Contact { name: "soft", friction: FrictionParams::Leuven(leuven) },
        Contact { name: "soft, i = 1", friction: FrictionParams::Dahl(dahl(1.0)) },
        Contact { name: "soft, i = 2", friction: FrictionParams::Dahl(dahl(2.0)) },
        Contact { name: "soft", friction: FrictionParams::Stribeck(stribeck) },
    ]
}

/// σ0 = 1000, ω_s = 0.05.
pub fn soft() -> LuGreParams {
    LuGreParams::BENCH_RIG
}

/// Table 1's bristles, with torques and viscosity at which the motor can turn.
pub fn table_1() -> LuGreParams {
    LuGreParams {
        stribeck_velocity_rad_per_s: 0.001,
        bristle_stiffness_nm_per_rad: 1e5,
        bristle_damping_nm_s_per_rad: 316.277,
        ..soft()
    }
}

fn motor() -> MotorParams {
    MotorParams::BENCH_RIG
}

fn model(friction: FrictionParams) -> Model {
    Model {
        name: "bench".into(),
        motor: Some(motor()),
        load: Some(LoadParams { inertia_kg_m2: LOAD_INERTIA_KG_M2 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}
