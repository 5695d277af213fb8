//! What differs between a valve and the belief that it is compensated with: one thing at a time, or several drawn at random.

use anyhow::{Context, Result};
use closed_loop::{Level, Outcome, WiringError, measure_parts, wire_level};
use config::Scenario;
use rand::{Rng, RngExt};
use std::ops::Range;
use valve_model::{Effect, EffectId, EffectValue, FrictionParams, Model, MotorParams};

/// A valve that is not as believed, or an encoder.
#[derive(Debug, Clone)]
pub struct Variation {
    /// What differs.
    pub name: String,
    /// The valve.
    pub truth: Model,
    /// Counts of the encoder in a turn; `None` without one.
    pub counts: Option<u64>,
    /// What the encoder's zero is beyond that of the motor's teeth, rad.
    pub offset_rad: f64,
}

impl Variation {
    /// Runs a scenario on this valve.
    ///
    /// # Errors
    /// A model that the scenario can't be wired with.
    pub fn measure(&self, scenario: &Scenario, belief: &Model, level: Level) -> Result<Outcome, WiringError> {
        let mut parts = wire_level(scenario, &self.truth, belief, level)?;
        parts.plant.start.encoder_zero_rad += self.offset_rad;
        Ok(measure_parts(&parts))
    }

    /// A scenario with this encoder.
    pub fn scenario(&self, shipped: &Scenario) -> Scenario {
        let mut scenario = shipped.clone();
        scenario.encoder.counts_per_turn = self.counts.unwrap_or(scenario.encoder.counts_per_turn);
        scenario
    }
}

/// Counts of the usual encoder.
const COUNTS: u64 = 131_072;

const ENCODERS: [Option<u64>; 5] = [None, Some(4_000), Some(20_000), Some(COUNTS), Some(1_000_000)];
const INERTIAS: [f64; 7] = [0.4, 0.6, 0.7, 1.3, 1.5, 2.0, 2.5];
/// The largest is what the motor can still turn.
const FRICTIONS: [f64; 5] = [0.01, 0.5, 0.7, 1.3, 1.9];
/// The first is within what homing's alignment leaves; the last takes most of the motor's torque.
const OFFSETS_DEG: [f64; 4] = [0.05, 0.35, 0.7, 1.2];

/// An effect that the belief does not have.
struct Kind {
    /// What it is called with a size, in the bench rig's units.
    name: fn(&str) -> String,
    effect: fn(&Scale, f64) -> Result<Effect>,
    /// One at a time.
    sizes: &'static [f64],
    /// Drawn.
    range: Range<f64>,
}

/// Couplings, N·m/rad; backlashes, rad; detents, N·m; micro-step errors of up to 5 % and 20 % of a full step, rad.
const EFFECTS: [Kind; 4] = [
    Kind {
        name: |size| format!("coupling of {size} N·m/rad"),
        effect: |scale, size| {
            let stiffness = size * scale.torque / scale.angle;
            number(EffectId::CouplingCompliance, "stiffness_nm_per_rad", stiffness)
        },
        sizes: &[300.0, 500.0, 1000.0, 2000.0, 5000.0],
        range: 300.0..5000.0,
    },
    Kind {
        name: |size| format!("backlash of ± {size} rad"),
        effect: |scale, size| number(EffectId::Backlash, "half_width_rad", size * scale.angle),
        sizes: &[5e-4, 2e-3],
        range: 0.0..2e-3,
    },
    Kind {
        name: |size| format!("detent of {size} N·m"),
        effect: |scale, size| first_order(EffectId::DetentTorque, size * scale.torque),
        sizes: &[0.1, 0.3],
        range: 0.0..0.3,
    },
    Kind {
        name: |size| format!("micro-step error of {size} rad"),
        effect: |scale, size| first_order(EffectId::MicrostepError, size * scale.angle),
        sizes: &[6e-4, 2.5e-3],
        range: 0.0..2.5e-3,
    },
];

/// By how much a motor's torques and angles are larger than the bench rig's, for which the numbers above are.
struct Scale {
    torque: f64,
    angle: f64,
}

impl Scale {
    fn of(motor: &MotorParams) -> Self {
        let rig = MotorParams::BENCH_RIG;
        Self {
            torque: motor.holding_torque_nm / rig.holding_torque_nm,
            angle: f64::from(rig.rotor_teeth) / f64::from(motor.rotor_teeth),
        }
    }
}

/// All of them, as large for this motor as they are for the bench rig's: torques in parts of its holding torque, angles in
/// parts of its tooth pitch. The names say the bench rig's.
///
/// # Errors
/// An effect that the model refuses.
pub fn variations(belief: &Model) -> Result<Vec<Variation>> {
    let scale = Scale::of(belief.motor.as_ref().context("a motor")?);
    let mut all = Vec::new();
    for counts in ENCODERS {
        let name = counts.map_or("no encoder".to_owned(), |counts| format!("encoder of {counts} counts"));
        all.push(Variation { name, truth: belief.clone(), counts, offset_rad: 0.0 });
    }
    for factor in INERTIAS {
        let mut truth = belief.clone();
        truth.motor.as_mut().context("a motor")?.rotor_inertia_kg_m2 *= factor;
        truth.load.as_mut().context("a load")?.inertia_kg_m2 *= factor;
        all.push(with_encoder(format!("inertia × {factor}"), truth));
    }
    for factor in FRICTIONS {
        all.push(with_encoder(format!("friction × {factor}"), with_friction(belief, factor)));
    }
    for degrees in OFFSETS_DEG {
        let offset_rad = scale.angle * f64::to_radians(degrees);
        let name = format!("encoder {degrees}° off the teeth");
        all.push(Variation { offset_rad, ..with_encoder(name, belief.clone()) });
    }
    for kind in &EFFECTS {
        for size in kind.sizes {
            all.push(with_effect(belief, (kind.name)(&size.to_string()), (kind.effect)(&scale, *size)?));
        }
    }
    Ok(all)
}

/// A valve that differs in several of these things at once, each as likely as not and of a size from its range, named in full; and in how
/// many.
///
/// # Errors
/// As [`variations`].
pub fn mixed(belief: &Model, random: &mut impl Rng) -> Result<(Variation, usize)> {
    let scale = Scale::of(belief.motor.as_ref().context("a motor")?);
    let mut truth = belief.clone();
    let mut differs: Vec<String> = Vec::new();
    if random.random_bool(0.5) {
        let factor = random.random_range(0.0..2.0_f64).max(0.01);
        truth = with_friction(belief, factor);
        differs.push(format!("friction × {factor:.2}"));
    }
    if random.random_bool(0.5) {
        let factor = random.random_range(0.4..2.5);
        truth.motor.as_mut().context("a motor")?.rotor_inertia_kg_m2 *= factor;
        truth.load.as_mut().context("a load")?.inertia_kg_m2 *= factor;
        differs.push(format!("inertia × {factor:.2}"));
    }
    for kind in &EFFECTS {
        if random.random_bool(0.5) {
            let size = random.random_range(kind.range.clone());
            truth.effects.push((kind.effect)(&scale, size)?);
            differs.push((kind.name)(&format!("{size:.2e}")));
        }
    }
    let mut offset_rad = 0.0;
    if random.random_bool(0.5) {
        let degrees: f64 = random.random_range(-1.2..1.2);
        offset_rad = scale.angle * degrees.to_radians();
        differs.push(format!("encoder {degrees:.2}° off the teeth"));
    }
    let mut counts = Some(COUNTS);
    if random.random_bool(0.5) {
        counts = *ENCODERS.get(random.random_range(0..ENCODERS.len())).context("an encoder")?;
        differs.push(counts.map_or("no encoder".to_owned(), |counts| format!("encoder of {counts} counts")));
    }
    let count = differs.len();
    Ok((Variation { name: differs.join(", "), truth, counts, offset_rad }, count))
}

fn number(id: EffectId, key: &str, value: f64) -> Result<Effect> {
    effect(id, &[(key, EffectValue::Number(value))])
}

fn first_order(id: EffectId, value: f64) -> Result<Effect> {
    effect(id, &[("cos", EffectValue::List(vec![value]))])
}

fn effect(id: EffectId, parameters: &[(&str, EffectValue)]) -> Result<Effect> {
    Effect::new(id, parameters).map_err(|error| anyhow::anyhow!("{id}: {error}"))
}

fn with_encoder(name: String, truth: Model) -> Variation {
    Variation { name, truth, counts: Some(COUNTS), offset_rad: 0.0 }
}

fn with_friction(belief: &Model, factor: f64) -> Model {
    let mut truth = belief.clone();
    let (coulomb_nm, static_nm) = match belief.friction {
        FrictionParams::Stribeck(law) => (law.coulomb_torque_nm, law.static_torque_nm),
        FrictionParams::Dahl(law) => (law.coulomb_torque_nm, law.coulomb_torque_nm),
        FrictionParams::LuGre(law) => (law.coulomb_torque_nm, law.static_torque_nm),
        FrictionParams::Leuven(law) => (law.coulomb_torque_nm, law.static_torque_nm),
    };
    truth.friction.set_levels(factor * coulomb_nm, factor * static_nm);
    truth
}

fn with_effect(belief: &Model, name: String, effect: Effect) -> Variation {
    let mut truth = belief.clone();
    truth.effects.push(effect);
    with_encoder(name, truth)
}
