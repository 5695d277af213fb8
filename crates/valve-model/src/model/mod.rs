//! A model file's content, validated: what is known of one valve.

mod folding;

use serde::{Deserialize, Serialize};

use crate::effect::MOST_CUSTOM;

use crate::{
    ClearanceParams, Effect, FrictionParams, LoadParams, MotorParams, OilParams, OrificeParams, ParamError,
    SealParams,
};

/// One valve: a section each, absent where the job at hand doesn't need it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// What the user calls it.
    pub name: String,
    /// `[motor]`
    pub motor: Option<MotorParams>,
    /// `[load]`
    pub load: Option<LoadParams>,
    /// `[friction]`
    pub friction: FrictionParams,
    /// `[orifice]`
    pub orifice: Option<OrificeParams>,
    /// `[oil]`
    pub oil: Option<OilParams>,
    /// `[clearance]`: where σ2 comes from, if not from `[friction]`.
    pub clearance: Option<ClearanceParams>,
    /// `[seals]`: where T_c and T_s come from, if not from `[friction]`; they then hold at the seals' working pressure.
    pub seals: Option<SealParams>,
    /// `[[effect]]`, in the file's order.
    pub effects: Vec<Effect>,
}

impl Model {
    /// The oil temperature in °C at which the nominal numbers hold: the file's, 40 where it has no `[oil]`.
    pub fn reference_temperature_c(&self) -> f64 {
        self.oil.map_or(OilParams::DEFAULT_REFERENCE_TEMPERATURE_C, |oil| oil.reference_temperature_c)
    }

    /// The frequency at which the rotor and its load swing about their command, Hz: √(N_r·T_hold/(J_rotor + J_load))/2π.
    /// `None` without a motor.
    pub fn resonance_hz(&self) -> Option<f64> {
        let of = |motor: MotorParams| {
            let load_kg_m2 = self.load.map_or(0.0, |load| load.inertia_kg_m2);
            let stiffness_nm_per_rad = f64::from(motor.rotor_teeth) * motor.holding_torque_nm;
            (stiffness_nm_per_rad / (motor.rotor_inertia_kg_m2 + load_kg_m2)).sqrt() / std::f64::consts::TAU
        };
        self.motor.map(of)
    }

    /// Checks every section.
    ///
    /// # Errors
    /// The first parameter that is refused.
    pub fn validate(&self) -> Result<(), ParamError> {
        if let Some(motor) = &self.motor {
            motor.validate()?;
        }
        if let Some(load) = &self.load {
            load.validate()?;
        }
        self.friction.validate()?;
        if let Some(orifice) = &self.orifice {
            orifice.validate()?;
        }
        if let Some(oil) = &self.oil {
            oil.validate()?;
        }
        self.validate_design()?;
        self.effects.iter().try_for_each(Effect::validate)?;
        for (index, effect) in self.effects.iter().enumerate() {
            if self.effects.iter().skip(index + 1).any(|other| other.id() == effect.id()) {
                let found = format!("{}, given twice", effect.id());
                return Err(ParamError::new("id", found, "each effect once"));
            }
        }
        let custom = self.effects.iter().filter(|effect| effect.id().is_custom()).count();
        if custom > MOST_CUSTOM {
            return Err(ParamError::new("id", format!("{custom} formulas and tables"), "at most 8 of them"));
        }
        self.folded().map(|_| ())
    }

    /// Puts what `[clearance]` and `[seals]` give in the place of the numbers in [`Self::friction`].
    ///
    /// # Errors
    /// A section that is refused; `[clearance]` without `[oil]`.
    pub fn take_design(&mut self) -> Result<(), ParamError> {
        if let Some(seals) = &self.seals {
            seals.validate()?;
            self.friction.set_levels(seals.coulomb_torque_nm(), seals.static_torque_nm());
        }
        if let Some(viscous) = self.design_viscous()? {
            self.friction.set_viscous(viscous);
        }
        Ok(())
    }

    fn design_viscous(&self) -> Result<Option<f64>, ParamError> {
        let Some(clearance) = &self.clearance else { return Ok(None) };
        clearance.validate()?;
        let oil = self
            .oil
            .ok_or_else(|| ParamError::new("oil", "missing", "a section [oil] beside [clearance]"))?;
        Ok(Some(clearance.viscous_nm_s_per_rad(&oil)))
    }

    /// The numbers of friction are those of the design calculation, where there is one.
    fn validate_design(&self) -> Result<(), ParamError> {
        let mut designed = self.clone();
        designed.take_design()?;
        if designed.friction == self.friction {
            return Ok(());
        }
        let expected = "the numbers that [clearance] and [seals] give";
        Err(ParamError::new("friction", "other numbers", expected))
    }
}
