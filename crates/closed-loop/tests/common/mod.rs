//! Scenarios and models made of a few numbers.

use config::{Scenario, parse_model, parse_scenario};
use valve_model::Model;

/// A valve like the rig's.
#[derive(Debug, Clone, Copy)]
pub struct Valve {
    pub holding_torque_nm: f64,
    pub rotor_inertia_kg_m2: f64,
    pub coulomb_torque_nm: f64,
    pub static_torque_nm: f64,
    pub stribeck_velocity_rad_per_s: f64,
    pub bristle_stiffness_nm_per_rad: f64,
    pub bristle_damping_nm_s_per_rad: f64,
    pub viscous_nm_s_per_rad: f64,
    /// When the rotor is pushed a tooth ahead, s.
    pub missed_step_at_s: Option<f64>,
}

impl Default for Valve {
    fn default() -> Self {
        Self {
            holding_torque_nm: 6.0,
            rotor_inertia_kg_m2: 4e-4,
            coulomb_torque_nm: 1.5,
            static_torque_nm: 3.0,
            stribeck_velocity_rad_per_s: 0.05,
            bristle_stiffness_nm_per_rad: 1000.0,
            bristle_damping_nm_s_per_rad: 1.0,
            viscous_nm_s_per_rad: 2e-4,
            missed_step_at_s: None,
        }
    }
}

impl Valve {
    /// It as a model file says it.
    pub fn model(&self) -> Model {
        let missed = self.missed_step_at_s.map_or(String::new(), |time_s| {
            format!("[[effect]]\nid = \"missed-steps\"\ntime_s = [{time_s:?}]\nteeth = [1.0]\n")
        });
        let text = format!(
            "format = \"stepvalve-model\"\nformat_version = 1\nname = \"x\"\n[motor]\nphases = 5\nrotor_teeth = 50\n\
             full_steps_per_rev = 500\nmicrosteps_per_full_step = 225\nholding_torque_nm = {:?}\n\
             rotor_inertia_kg_m2 = {:?}\ndamping_nm_s_per_rad = 0.02\nmax_pulse_rate_hz = 600e3\n[load]\n\
             inertia_kg_m2 = 1.0e-4\n[friction]\nlaw = \"lugre\"\ncoulomb_torque_nm = {:?}\nstatic_torque_nm = {:?}\n\
             stribeck_velocity_rad_per_s = {:?}\nstribeck_exponent = 2.0\nbristle_stiffness_nm_per_rad = {:?}\n\
             bristle_damping_nm_s_per_rad = {:?}\nviscous_nm_s_per_rad = {:?}\n{missed}",
            self.holding_torque_nm,
            self.rotor_inertia_kg_m2,
            self.coulomb_torque_nm,
            self.static_torque_nm,
            self.stribeck_velocity_rad_per_s,
            self.bristle_stiffness_nm_per_rad,
            self.bristle_damping_nm_s_per_rad,
            self.viscous_nm_s_per_rad,
        );
        parse_model(&text, "model").unwrap()
    }
}

/// A scenario of this length with an encoder; `more` is put at its end.
pub fn scenario(duration_s: f64, more: &str) -> Scenario {
    let text = format!(
        "format = \"stepvalve-scenario\"\nformat_version = 1\nname = \"x\"\nduration = {duration_s:?}\ntruth = \"t\"\n\
         belief = \"b\"\n[limits]\nmax_speed = \"720deg/s\"\nmax_acceleration = \"1000rad/s2\"\nmax_jerk = 1.2e5\n\
         [driver]\nmax_pulse_rate = \"600kHz\"\nmax_pulse_acceleration = \"400MHz/s\"\n\
         quick_stop_deceleration = \"10MHz/s\"\nafter_stop = \"hold\"\n[encoder]\nfitted = true\nnoise = \"0.01mrad\"\n\
         [safety]\nsilence_cycles = 3\nmax_following_error = \"3deg\"\n{more}"
    );
    parse_scenario(&text, "scenario").unwrap()
}
