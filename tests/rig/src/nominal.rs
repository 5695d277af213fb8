//! The valve as its model file has it, drawn from a seed.

use rand::RngExt;
use rand_pcg::Pcg64;

/// The numbers of the model file; the rig's truth begins as the same.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nominal {
    pub coulomb_nm: f64,
    pub static_nm: f64,
    pub stribeck_rad_per_s: f64,
    pub exponent: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
    pub viscous_nm_s_per_rad: f64,
    pub load_kg_m2: f64,
    pub holding_nm: f64,
    pub rotor_kg_m2: f64,
    pub motor_damping_nm_s_per_rad: f64,
    pub reference_c: f64,
    /// The fastest of the experiments.
    pub fastest_rad_per_s: f64,
}

/// Teeth and full steps of the motor.
pub(crate) const TEETH: f64 = 50.0;
pub(crate) const FULL_STEPS: f64 = 500.0;

/// Three significant digits, as a person would write them into a file: file and rig then agree exactly.
pub(crate) fn written(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap()
}

pub(crate) fn log_uniform(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    rng.random_range(low.ln()..high.ln()).exp()
}

impl Nominal {
    pub fn draw(rng: &mut Pcg64) -> Self {
        let coulomb_nm = written(log_uniform(rng, 0.6, 1.8));
        let static_nm = written(coulomb_nm * rng.random_range(1.25..1.8));
        let stiffness = log_uniform(rng, 500.0, 2500.0);
        let load = log_uniform(rng, 2e-4, 1.5e-3);
        let fastest = log_uniform(rng, 4.0, 10.0);
        let viscous = coulomb_nm * rng.random_range(0.2..0.5) / fastest;
        Self {
            coulomb_nm,
            static_nm,
            stribeck_rad_per_s: written(log_uniform(rng, 0.03, 0.2)),
            exponent: if rng.random_bool(0.5) { 2.0 } else { 1.0 },
            stiffness_nm_per_rad: written(stiffness),
            damping_nm_s_per_rad: written(rng.random_range(0.3..1.0) * (stiffness * load).sqrt()),
            viscous_nm_s_per_rad: written(viscous),
            load_kg_m2: written(load),
            holding_nm: written(rng.random_range(5.0..8.0)),
            rotor_kg_m2: written(log_uniform(rng, 2e-4, 6e-4)),
            motor_damping_nm_s_per_rad: written(log_uniform(rng, 0.02, 0.1)),
            reference_c: 40.0,
            fastest_rad_per_s: fastest,
        }
    }

    /// The numbers as somebody knows them who is off by a part of each, up to so much either way.
    pub fn misjudged(&self, off_by: f64, rng: &mut Pcg64) -> Self {
        let mut known = |value: f64| written(value * (1.0 + off_by * rng.random_range(-1.0..1.0)));
        let coulomb_nm = known(self.coulomb_nm);
        Self {
            coulomb_nm,
            static_nm: known(self.static_nm).max(written(1.05 * coulomb_nm)),
            stribeck_rad_per_s: known(self.stribeck_rad_per_s),
            stiffness_nm_per_rad: known(self.stiffness_nm_per_rad),
            damping_nm_s_per_rad: known(self.damping_nm_s_per_rad),
            viscous_nm_s_per_rad: known(self.viscous_nm_s_per_rad),
            load_kg_m2: known(self.load_kg_m2),
            holding_nm: known(self.holding_nm),
            rotor_kg_m2: known(self.rotor_kg_m2),
            motor_damping_nm_s_per_rad: known(self.motor_damping_nm_s_per_rad),
            ..*self
        }
    }

    /// By how much the falling curve drives the spool's own swinging while it slides, at the worst speed, N·m·s/rad: a
    /// bristle's damping σ1·dz/dt goes with σ1·v·g'(v)/g(v) there, and is negative.
    pub fn drive_of_a_squeal(&self) -> f64 {
        let drive = |speed: f64| {
            let reached = (speed / self.stribeck_rad_per_s).powf(self.exponent);
            let fall = (self.static_nm - self.coulomb_nm) * (-reached).exp();
            self.damping_nm_s_per_rad * self.exponent * reached * fall / (self.coulomb_nm + fall)
        };
        let speeds = (0..40).map(|k| self.stribeck_rad_per_s * 0.05 * 1.15_f64.powi(k));
        speeds.map(drive).fold(0.0, f64::max)
    }

    /// The model file. A torque log needs no motor.
    pub fn toml(&self, name: &str, with_motor: bool) -> String {
        let motor = if with_motor {
            format!(
                "\n[motor]\nphases = 5\nrotor_teeth = 50\nfull_steps_per_rev = 500\nmicrosteps_per_full_step = 225\n\
                 holding_torque_nm = {:?}\nrotor_inertia_kg_m2 = {:?}\ndamping_nm_s_per_rad = {:?}\n\
                 max_pulse_rate_hz = 600e3\n",
                self.holding_nm, self.rotor_kg_m2, self.motor_damping_nm_s_per_rad
            )
        } else {
            String::new()
        };
        format!(
            "format = \"stepvalve-model\"\nformat_version = 1\nname = \"{name}\"\n{motor}\n[load]\ninertia_kg_m2 = {:?}\n\n\
             [friction]\nlaw = \"lugre\"\ncoulomb_torque_nm = {:?}\nstatic_torque_nm = {:?}\n\
             stribeck_velocity_rad_per_s = {:?}\nstribeck_exponent = {:?}\nbristle_stiffness_nm_per_rad = {:?}\n\
             bristle_damping_nm_s_per_rad = {:?}\nviscous_nm_s_per_rad = {:?}\n\n\
             [oil]\ndensity_kg_per_m3 = 853.0\nkinematic_viscosity_m2_per_s = 46e-6\nreference_temperature_c = {:?}\n",
            self.load_kg_m2,
            self.coulomb_nm,
            self.static_nm,
            self.stribeck_rad_per_s,
            self.exponent,
            self.stiffness_nm_per_rad,
            self.damping_nm_s_per_rad,
            self.viscous_nm_s_per_rad,
            self.reference_c
        )
    }
}
