//! Friction torque along a given motion, for `tools/reference_friction.py` to check: per case a line
//! `# law parameters...` and rows `time_s speed_rad_per_s torque_nm`.

use valve_model::{DahlParams, FrictionLaw, FrictionParams, FrictionState, LeuvenParams, LuGreParams};

const PERIOD_S: f64 = 1e-3;
const SAMPLES: u32 = 300;

/// Two sines: reversals at many speeds, presliding and sliding.
fn speed_rad_per_s(sample: u32) -> f64 {
    let time_s = f64::from(sample) * PERIOD_S;
    0.3 * (25.0 * time_s).sin() + 0.1 * (70.0 * time_s).sin()
}

fn main() {
    let soft = LuGreParams::BENCH_RIG;
    let table1 = LuGreParams {
        stribeck_velocity_rad_per_s: 0.001,
        bristle_stiffness_nm_per_rad: 1e5,
        bristle_damping_nm_s_per_rad: 316.277,
        ..soft
    };
    for lugre in [soft, table1, LuGreParams { stribeck_exponent: 1.0, ..soft }] {
        trace("lugre", &curve(&lugre), &FrictionParams::LuGre(lugre));
    }
    for exponent in [0.7, 1.0, 2.0] {
        let dahl = DahlParams {
            coulomb_torque_nm: 1.5,
            bristle_stiffness_nm_per_rad: 1000.0,
            viscous_nm_s_per_rad: 2e-4,
            dahl_exponent: exponent,
        };
        trace("dahl", &[1.5, 1000.0, 2e-4, exponent], &FrictionParams::Dahl(dahl));
    }
    // The elements are one spring while none slips: the ratio is so high that none does.
    let leuven = LeuvenParams {
        coulomb_torque_nm: soft.coulomb_torque_nm,
        static_torque_nm: soft.static_torque_nm,
        stribeck_velocity_rad_per_s: soft.stribeck_velocity_rad_per_s,
        stribeck_exponent: soft.stribeck_exponent,
        bristle_stiffness_nm_per_rad: soft.bristle_stiffness_nm_per_rad,
        bristle_damping_nm_s_per_rad: soft.bristle_damping_nm_s_per_rad,
        viscous_nm_s_per_rad: soft.viscous_nm_s_per_rad,
        transition_exponent: 6.0,
        maxwell_elements: 8,
        maxwell_saturation_ratio: 100.0,
        maxwell_spacing_exponent: 0.1,
        maxwell_tail_exponent: 0.0,
        maxwell_curve_share: 0.0,
        maxwell_damping_share: 0.0,
    };
    let mut numbers = curve(&soft).to_vec();
    numbers.push(leuven.transition_exponent);
    trace("leuven", &numbers, &FrictionParams::Leuven(leuven));
}

fn curve(params: &LuGreParams) -> [f64; 7] {
    [
        params.coulomb_torque_nm,
        params.static_torque_nm,
        params.stribeck_velocity_rad_per_s,
        params.stribeck_exponent,
        params.bristle_stiffness_nm_per_rad,
        params.bristle_damping_nm_s_per_rad,
        params.viscous_nm_s_per_rad,
    ]
}

fn trace(law: &str, numbers: &[f64], params: &FrictionParams) {
    let text: Vec<String> = numbers.iter().map(f64::to_string).collect();
    println!("# {law} {}", text.join(" "));
    let prepared = FrictionLaw::new(params);
    let mut state = FrictionState::default();
    for sample in 0..SAMPLES {
        let (start, end) = (speed_rad_per_s(sample), speed_rad_per_s(sample + 1));
        let torque_nm = state.step(&prepared, start, end, PERIOD_S);
        println!("{:e} {end:e} {torque_nm:e}", f64::from(sample + 1) * PERIOD_S);
    }
}
