//! The numbers of `rt-config/models/rig.toml` in code, for examples and tests to begin with.

use crate::{FrictionParams, LoadParams, LuGreParams, Model, MotorParams};

impl MotorParams {
    /// The bench rig's motor: five phases, 500 full steps, 6 N·m.
    pub const BENCH_RIG: Self = Self {
        phases: 5,
        rotor_teeth: 50,
        full_steps_per_rev: 500,
        microsteps_per_full_step: 225,
        holding_torque_nm: 6.0,
        rotor_inertia_kg_m2: 4e-4,
        damping_nm_s_per_rad: 0.02,
        max_pulse_rate_hz: 600e3,
        supply_voltage_v: None,
        phase_resistance_ohm: None,
        phase_inductance_h: None,
        rated_current_a: None,
        torque_constant_nm_per_a: None,
    };
}

impl LuGreParams {
    /// The bench rig's friction: 1.5 N·m sliding, 3 N·m to break away.
    pub const BENCH_RIG: Self = Self {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 3.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 2e-4,
    };
}

impl Model {
    /// The bench rig: motor, load and LuGre friction, without orifice, oil and effects.
    ///
    /// ```
    /// use valve_model::{Model, ValveInput, ValveParams, ValveState, step};
    ///
    /// let params = ValveParams::new(&Model::bench_rig())?;
    /// let mut valve = ValveState::at_rest(0.0);
    /// // A quarter of a turn in half a second, 1 ms a cycle.
    /// let command_rad = |cycle: u32| (f64::from(cycle) / 500.0).min(1.0) * std::f64::consts::FRAC_PI_2;
    /// for cycle in 0..1000 {
    ///     let input = ValveInput {
    ///         command_start_rad: command_rad(cycle),
    ///         command_end_rad: command_rad(cycle + 1),
    ///         pressure_drop_pa: 0.0,
    ///         oil_temperature_c: 40.0,
    ///         current_ratio: 1.0,
    ///     };
    ///     step(&params, &mut valve, &input, 1e-3);
    /// }
    /// // Friction leaves a lag of asin(T_f/T_hold)/N_r at most: 10.5 mrad at 3 N·m.
    /// let lag_rad = std::f64::consts::FRAC_PI_2 - valve.angle_rad;
    /// assert!((0.0..0.0105).contains(&lag_rad), "{lag_rad}");
    /// # Ok::<(), valve_model::ParamError>(())
    /// ```
    pub fn bench_rig() -> Self {
        Self {
            name: "bench rig".to_owned(),
            motor: Some(MotorParams::BENCH_RIG),
            load: Some(LoadParams { inertia_kg_m2: 1e-4 }),
            friction: FrictionParams::LuGre(LuGreParams::BENCH_RIG),
            orifice: None,
            oil: None,
            clearance: None,
            seals: None,
            effects: Vec::new(),
        }
    }
}
