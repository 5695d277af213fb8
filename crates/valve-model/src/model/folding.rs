//! Effects that are parameters off, and the one that changes the law: folded into the model they belong to.

use crate::{Effect, EffectId, FrictionParams, LeuvenParams, LuGreParams, Model, ParamError};

/// The elements of `presliding-hysteresis`.
const ELEMENTS: u32 = 10;

impl Model {
    /// The model with its `factor` effects folded into the sections' numbers, and those effects gone: the same model in
    /// other words.
    ///
    /// # Errors
    /// An effect on something that the model doesn't have.
    pub fn with_factors_in_its_numbers(&self) -> Result<Self, ParamError> {
        let mut model = self.clone();
        for effect in self.effects.iter().filter(|effect| effect.spec().folded_into.is_some()) {
            fold(effect, &mut model)?;
        }
        model.effects.retain(|effect| effect.spec().folded_into.is_none());
        Ok(model)
    }

    /// The model with its `factor` effects and `presliding-hysteresis` folded into the sections' numbers; the other
    /// effects stay as they are.
    ///
    /// # Errors
    /// An effect on something that the model doesn't have.
    pub(crate) fn folded(&self) -> Result<Self, ParamError> {
        let mut model = self.clone();
        for effect in &self.effects {
            fold(effect, &mut model)?;
        }
        Ok(model)
    }

    /// The number that an effect's `factor` is on, that of the static friction in parts of the Coulomb torque; `None` of other effects, and where
    /// the model has no such number.
    pub fn number_of(&self, id: EffectId) -> Option<f64> {
        let mut model = self.clone();
        match id {
            EffectId::CoulombLevel => Some(*model.friction.coulomb_mut()),
            EffectId::StaticLevel => {
                let coulomb_nm = *model.friction.coulomb_mut();
                model.friction.static_mut().map(|static_nm| *static_nm / coulomb_nm)
            }
            other => number_mut(other, &mut model).map(|number| *number),
        }
    }
}

/// The number that an effect is a factor on alone.
fn number_mut(id: EffectId, model: &mut Model) -> Option<&mut f64> {
    let (friction, motor) = (&mut model.friction, model.motor.as_mut());
    match id {
        EffectId::ViscousLevel => Some(friction.viscous_mut()),
        EffectId::StribeckVelocity => friction.stribeck_velocity_mut(),
        EffectId::BristleStiffness => friction.stiffness_mut(),
        EffectId::BristleDamping => friction.damping_mut(),
        EffectId::LoadInertia => model.load.as_mut().map(|load| &mut load.inertia_kg_m2),
        EffectId::HoldingTorqueLevel => motor.map(|motor| &mut motor.holding_torque_nm),
        EffectId::RotorInertia => motor.map(|motor| &mut motor.rotor_inertia_kg_m2),
        EffectId::MotorDamping => motor.map(|motor| &mut motor.damping_nm_s_per_rad),
        _ => None,
    }
}

fn fold(effect: &Effect, model: &mut Model) -> Result<(), ParamError> {
    let factor = effect.number("factor");
    let friction = &mut model.friction;
    let changed = match effect.id() {
        EffectId::CoulombLevel => {
            *friction.coulomb_mut() *= factor;
            scale(friction.static_mut(), factor);
            true
        }
        EffectId::StaticLevel => {
            let coulomb_nm = *friction.coulomb_mut();
            friction.static_mut().is_some_and(|static_nm| {
                *static_nm = (*static_nm * factor).max(coulomb_nm);
                true
            })
        }
        number @ (EffectId::ViscousLevel
        | EffectId::StribeckVelocity
        | EffectId::BristleStiffness
        | EffectId::BristleDamping
        | EffectId::LoadInertia
        | EffectId::HoldingTorqueLevel
        | EffectId::RotorInertia
        | EffectId::MotorDamping) => scale(number_mut(number, model), factor),
        EffectId::PreslidingHysteresis => single_spring(friction).is_some_and(|params| {
            *friction = FrictionParams::Leuven(with_hysteresis(&params, effect));
            true
        }),
        // These are no numbers of the model.
        EffectId::PressureDependentFriction
        | EffectId::TemperatureDependentViscosity
        | EffectId::TemperatureDependentFriction
        | EffectId::AngleDependentFriction
        | EffectId::DirectionAsymmetry
        | EffectId::DwellStiction
        | EffectId::HydraulicLock
        | EffectId::FrictionLag
        | EffectId::WearDrift
        | EffectId::FlowTorque
        | EffectId::PressureTorque
        | EffectId::PositionTorque
        | EffectId::CouplingCompliance
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::Backlash
        | EffectId::MissedSteps
        | EffectId::TorqueOffset
        | EffectId::TorqueGain
        | EffectId::SensorDelay
        | EffectId::EncoderEccentricity
        | EffectId::Custom(_) => true,
    };
    if changed {
        Ok(())
    } else {
        Err(ParamError::new("id", effect.id(), "an effect on something that the model has"))
    }
}

fn scale(value: Option<&mut f64>, factor: f64) -> bool {
    value.is_some_and(|value| {
        *value *= factor;
        true
    })
}

/// The law as LuGre, whose σ0·z is to be replaced: Dahl's has neither a Stribeck effect nor damping. The static law has no
/// spring, and Leuven has its Maxwell elements already.
fn single_spring(friction: &FrictionParams) -> Option<LuGreParams> {
    match friction {
        FrictionParams::LuGre(params) => Some(*params),
        FrictionParams::Dahl(params) => Some(LuGreParams {
            coulomb_torque_nm: params.coulomb_torque_nm,
            static_torque_nm: params.coulomb_torque_nm,
            // The curve is flat whatever its width.
            stribeck_velocity_rad_per_s: 1.0,
            stribeck_exponent: 2.0,
            bristle_stiffness_nm_per_rad: params.bristle_stiffness_nm_per_rad,
            bristle_damping_nm_s_per_rad: 0.0,
            viscous_nm_s_per_rad: params.viscous_nm_s_per_rad,
        }),
        FrictionParams::Stribeck(_) | FrictionParams::Leuven(_) => None,
    }
}

/// LuGre's numbers under the Leuven law: same initial stiffness, same steady curve.
fn with_hysteresis(params: &LuGreParams, effect: &Effect) -> LeuvenParams {
    LeuvenParams {
        coulomb_torque_nm: params.coulomb_torque_nm,
        static_torque_nm: params.static_torque_nm,
        stribeck_velocity_rad_per_s: params.stribeck_velocity_rad_per_s,
        stribeck_exponent: params.stribeck_exponent,
        bristle_stiffness_nm_per_rad: params.bristle_stiffness_nm_per_rad,
        bristle_damping_nm_s_per_rad: params.bristle_damping_nm_s_per_rad,
        viscous_nm_s_per_rad: params.viscous_nm_s_per_rad,
        transition_exponent: effect.number("transition_exponent"),
        maxwell_elements: ELEMENTS,
        maxwell_saturation_ratio: effect.number("saturation_ratio"),
        maxwell_spacing_exponent: effect.number("spacing_exponent"),
        maxwell_tail_exponent: effect.number("tail_exponent"),
        maxwell_curve_share: effect.number("curve_share"),
        // F_h stands for σ0·z where it damps, too.
        maxwell_damping_share: 1.0,
    }
}
