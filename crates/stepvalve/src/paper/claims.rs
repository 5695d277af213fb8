//! What the paper's numbers say about each other: no simulation, the equations alone.

use super::Fact;
use std::f64::consts::{PI, TAU};
use valve_model::{ClearanceParams, OilParams, SealParams};

/// Table 1 and section 5 of the paper.
const OUTER_M: f64 = 0.0096;
const INNER_M: f64 = 0.0097;
const WINDOW_M2: f64 = 8.75e-5;
const STATIC_NM: f64 = 6.2153;
const COULOMB_NM: f64 = 5.179;
const STRIBECK_RAD_PER_S: f64 = 0.001;
const STIFFNESS: f64 = 1e5;
const DAMPING: f64 = 316.277;
const VISCOUS: f64 = 0.4;
const HOLDING_NM: f64 = 6.0;
const REVISED_COULOMB_NM: f64 = 2.0;
const REVISED_STATIC_NM: f64 = 3.0;
const MEASURED_MEAN_NM: f64 = 1.5;
const MICROSTEP_RAD: f64 = TAU / (500.0 * 225.0);
/// Not given by the paper: the spool's length in the sleeve, m, and the oil.
const LENGTH_M: f64 = 0.05;
const OIL: OilParams = OilParams {
    density_kg_per_m3: 853.0,
    kinematic_viscosity_m2_per_s: 46e-6,
    reference_temperature_c: 40.0,
};

fn fact(id: &str, value: f64, unit: &'static str, stated: Option<f64>, text: &str) -> Fact {
    Fact { group: "", id: id.to_owned(), text: text.to_owned(), value, unit, stated }
}

/// All of them.
pub fn facts() -> Vec<Fact> {
    let groups = [
        ("Viscous friction: equation (4) and Table 1", viscous()),
        ("Seals: equations (7) to (9) and (12)", seals()),
        ("Speeds and bristles of Table 1", speeds()),
    ];
    let named =
        |(group, facts): (&'static str, Vec<Fact>)| facts.into_iter().map(move |fact| Fact { group, ..fact });
    groups.into_iter().flat_map(named).collect()
}

/// σ2 of equation (4), with Table 1's "diameters" as radii and as diameters.
fn viscous() -> Vec<Fact> {
    let sigma2 = |scale: f64| {
        let clearance = ClearanceParams {
            spool_radius_m: OUTER_M * scale,
            sleeve_radius_m: INNER_M * scale,
            length_m: LENGTH_M,
            grooves: 0,
            groove_width_m: 0.0,
            opening_area_m2: WINDOW_M2,
        };
        clearance.viscous_nm_s_per_rad(&OIL)
    };
    let torque = |pulse_rate_hz: f64| VISCOUS * pulse_rate_hz * MICROSTEP_RAD;
    vec![
        fact(
            "sigma2_radii",
            sigma2(1.0),
            "N·m·s/rad",
            Some(VISCOUS),
            "equation (4), 50 mm of spool, 46 cSt, Table 1's diameters taken as radii",
        ),
        fact("sigma2_diameters", sigma2(0.5), "N·m·s/rad", Some(VISCOUS), "the same, taken as diameters"),
        fact("viscous_torque_200khz", torque(200e3), "N·m", None, "Table 1's σ2 alone at 200 kHz"),
        fact("viscous_torque_600khz", torque(600e3), "N·m", None, "Table 1's σ2 alone at 600 kHz"),
        fact(
            "needed_revised_200khz",
            REVISED_COULOMB_NM + torque(200e3),
            "N·m",
            Some(HOLDING_NM),
            "revised T_c and Table 1's σ2 at 200 kHz, beside the holding torque",
        ),
        fact(
            "needed_revised_600khz",
            REVISED_COULOMB_NM + torque(600e3),
            "N·m",
            Some(HOLDING_NM),
            "the same at 600 kHz",
        ),
        fact(
            "needed_initial_start",
            STATIC_NM,
            "N·m",
            Some(HOLDING_NM),
            "initial T_s, beside the holding torque",
        ),
    ]
}

/// The seal width that equations (7) and (8) need for Table 1's T_c; the ratio of (12).
fn seals() -> Vec<Fact> {
    let width = |radius_m: f64| {
        COULOMB_NM / (TAU * radius_m * radius_m * 20e6 * SealParams::FRICTION_COEFFICIENT_AT_20_MPA)
    };
    let o_ring_mm = |diameter_m: f64| (PI * diameter_m * diameter_m / 4.0).sqrt() * 1e3;
    vec![
        fact(
            "seal_width_radii",
            width(OUTER_M) * 1e3,
            "mm",
            None,
            "total seal width b for T_c = 5.179 by (7), (8), 9.6 mm taken as a radius",
        ),
        fact(
            "seal_width_diameters",
            width(0.5 * OUTER_M) * 1e3,
            "mm",
            None,
            "the same, 9.6 mm taken as a diameter",
        ),
        fact(
            "o_ring_width",
            o_ring_mm(2.62e-3),
            "mm",
            None,
            "width (9) of one O-ring of 2.62 mm, for comparison",
        ),
        fact(
            "static_ratio_table_1",
            STATIC_NM / COULOMB_NM,
            "1",
            Some(SealParams::STATIC_RATIO),
            "T_s/T_c of Table 1: it is (12), so (12) is not confirmed by it",
        ),
        fact(
            "static_ratio_revised",
            REVISED_STATIC_NM / REVISED_COULOMB_NM,
            "1",
            Some(SealParams::STATIC_RATIO),
            "T_s/T_c of the revised set",
        ),
        fact(
            "coulomb_over_measured",
            REVISED_COULOMB_NM / MEASURED_MEAN_NM,
            "1",
            Some(1.0),
            "the fitted T_c over the measured mean, which includes all friction in sliding",
        ),
    ]
}

/// Speeds and bristles.
fn speeds() -> Vec<Fact> {
    vec![
        fact(
            "ratio_speed_low",
            0.05 / OUTER_M,
            "rad/s",
            None,
            "0.05 m/s at the spool, from where (12) is claimed",
        ),
        fact(
            "ratio_speed_high",
            0.3 / OUTER_M,
            "rad/s",
            None,
            "0.3 m/s at the spool, up to where (12) is claimed",
        ),
        fact("speed_200khz", 200e3 * MICROSTEP_RAD, "rad/s", None, "the shaft at 200 kHz"),
        fact("speed_600khz", 600e3 * MICROSTEP_RAD, "rad/s", None, "the shaft at 600 kHz"),
        fact(
            "stribeck_microsteps_per_s",
            STRIBECK_RAD_PER_S / MICROSTEP_RAD,
            "1/s",
            None,
            "Table 1's Stribeck velocity in micro-steps a second",
        ),
        fact(
            "root_of_stiffness",
            STIFFNESS.sqrt(),
            "1",
            Some(DAMPING),
            "√σ0: the textbook example's σ1 for a mass of 1 kg",
        ),
    ]
}
