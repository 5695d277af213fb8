//! The paper's equations 4 to 12 against its own numbers.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use valve_model::*;

const OIL: OilParams = OilParams {
    density_kg_per_m3: 853.0,
    kinematic_viscosity_m2_per_s: 46e-6,
    reference_temperature_c: 40.0,
};

fn spool(scale: f64) -> ClearanceParams {
    ClearanceParams {
        spool_radius_m: scale * 0.0096,
        sleeve_radius_m: scale * 0.0097,
        length_m: 0.05,
        grooves: 0,
        groove_width_m: 0.0,
        opening_area_m2: 8.75e-5,
    }
}

#[test]
fn viscous_friction_of_table_1() {
    // Diameters as radii, and as diameters.
    let as_radii = spool(1.0).viscous_nm_s_per_rad(&OIL);
    let as_diameters = spool(0.5).viscous_nm_s_per_rad(&OIL);
    assert!((as_radii - 1.0e-4).abs() < 0.05e-4, "{as_radii}");
    assert!((as_diameters - 2.4e-5).abs() < 0.1e-5, "{as_diameters}");
    let grooved = ClearanceParams { grooves: 5, groove_width_m: 0.001, ..spool(1.0) };
    let less = std::f64::consts::TAU * 0.0096 * 0.005;
    assert!((spool(1.0).area_m2() - grooved.area_m2() - less).abs() < 1e-12);
}

/// One seal of the width b that gives Table 1's T_c.
fn seal(radius_m: f64, width_m: f64) -> SealParams {
    let o_ring_diameter_m = 0.00178;
    let o_ring_width_m = o_ring_diameter_m * (std::f64::consts::PI / 4.0).sqrt();
    SealParams {
        spool_radius_m: radius_m,
        seals: 1,
        o_ring_diameter_m,
        backup_ring_width_m: width_m - o_ring_width_m,
        working_pressure_pa: 20e6,
        friction_coefficient: SealParams::FRICTION_COEFFICIENT_AT_20_MPA,
        static_ratio: SealParams::STATIC_RATIO,
    }
}

#[test]
fn seal_widths_that_give_table_1() {
    for (radius_m, width_m) in [(0.0096, 0.01656), (0.0048, 0.06626)] {
        let seal = seal(radius_m, width_m);
        assert!((seal.seal_width_m() - width_m).abs() < 1e-12);
        assert!((seal.coulomb_torque_nm() - 5.179).abs() < 0.005, "{}", seal.coulomb_torque_nm());
        assert!((seal.static_torque_nm() - 6.2153).abs() < 0.007, "{}", seal.static_torque_nm());
    }
}

#[test]
fn impossible_spools_and_seals_are_refused() {
    assert_eq!(spool(1.0).validate(), Ok(()));
    let key = |result: Result<(), ParamError>| result.unwrap_err().key;
    assert_eq!(key(ClearanceParams { sleeve_radius_m: 0.0096, ..spool(1.0) }.validate()), "sleeve_radius_m");
    assert_eq!(
        key(ClearanceParams { grooves: 50, groove_width_m: 0.001, ..spool(1.0) }.validate()),
        "length_m"
    );
    let good = seal(0.0096, 0.01656);
    assert_eq!(good.validate(), Ok(()));
    assert_eq!(key(SealParams { static_ratio: 0.9, ..good }.validate()), "static_ratio");
    assert_eq!(key(SealParams { working_pressure_pa: f64::NAN, ..good }.validate()), "working_pressure_pa");
    assert_eq!(key(SealParams { seals: 0, ..good }.validate()), "seals");
}

#[test]
fn sections_stand_in_place_of_numbers() {
    let mut model = Model {
        oil: Some(OIL),
        clearance: Some(spool(1.0)),
        seals: Some(seal(0.0096, 0.006)),
        ..common::model(FrictionParams::LuGre(common::soft()))
    };
    assert_eq!(model.validate().unwrap_err().key, "friction", "numbers of another origin");
    model.take_design().unwrap();
    assert_eq!(model.validate(), Ok(()));
    let FrictionParams::LuGre(friction) = model.friction else { panic!("the law is kept") };
    assert_eq!(friction.coulomb_torque_nm, seal(0.0096, 0.006).coulomb_torque_nm());
    assert_eq!(friction.static_torque_nm, 1.2 * friction.coulomb_torque_nm);
    assert_eq!(friction.viscous_nm_s_per_rad, spool(1.0).viscous_nm_s_per_rad(&OIL));

    let without_oil = Model { oil: None, ..model.clone() };
    assert_eq!(without_oil.validate().unwrap_err().key, "oil");

    // The levels hold at the working pressure of 20 MPa, whatever the gain.
    let parts = [("gain", EffectValue::Number(0.05))];
    model.effects = vec![Effect::from_parts("pressure-dependent-friction", &parts).unwrap()];
    let params = MotionParams::new(&model).unwrap();
    let torque = |pressure_drop_pa: f64| {
        let motion =
            |angle_rad| MotionSample { angle_rad, speed_rad_per_s: 1.0, acceleration_rad_per_s2: 0.0 };
        let mut state = params.at_start(&motion(0.0));
        let input =
            MotionInput { start: motion(0.0), end: motion(0.2), pressure_drop_pa, oil_temperature_c: 40.0 };
        motion_step(&params, &mut state, &input, 0.2).friction_torque_nm
    };
    let viscous = friction.viscous_nm_s_per_rad;
    assert!((torque(20e6) - friction.coulomb_torque_nm - viscous).abs() < 1e-4);
    assert!((torque(0.0) - 0.5 * friction.coulomb_torque_nm - viscous).abs() < 1e-4);
}
