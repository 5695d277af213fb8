//! The answer key: whether a recording can show how its truth differs from the belief, and what else would look like it.
//!
//! The recorded command goes through the valve's equations without any noise, once as the truth is and once as the belief
//! is. The difference of angle and torque counts in parts of what each is known to: the encoder's noise and count; a
//! recording's torque has neither, so [`TORQUE`] of the Coulomb torque stands for them. What numbers within twice their tolerance
//! can stand for is taken off. A difference of [`hidden_effect_rig::WEAK`] or more shows, unless another cause that the channels
//! can show leaves of it no more than chance would, or less than [`SAME`].

use crate::changes::coulomb_nm;
use crate::{Encoder, Recording};
use anyhow::{Context, Result};
use config::parse_model;
use hidden_effect_rig::{Columns, HiddenEffect, Imperfect, LogKind, Normal, Truth, WEAK};
use log_data::Run;
use serde_json::{Map, Value, json};
use std::path::Path;
use valve_model::{Effect, EffectId, EffectValue, Model, ValveInput, ValveParams, ValveState, step};

/// What a recording's torque is taken to be known to, as a part of the Coulomb torque.
const TORQUE: f64 = 1e-3;
/// What an angle is known to at best, rad: without an encoder the simulated angle itself is recorded.
const ANGLE_RAD: f64 = 1e-6;
/// The standard deviation of the belief's numbers, and how many of them they move.
const TOLERANCE: f64 = 0.03;
const WITHIN: f64 = 2.0;
/// The part of a difference's RMS that a like cause may leave, and a sum of squares that chance leaves hardly ever.
const ALIKE: f64 = 0.15;
const CHANCE: f64 = 30.0;
/// RMS over the error of what makes no difference to anybody.
const SAME: f64 = 0.3;
/// How much a number changes for its slope.
const SMALL: f64 = 0.03;

/// What is true about a recording.
#[derive(Debug, Clone)]
pub struct Answer {
    /// For the judge. Where the data can't show what is hidden, whatever is like it may be named, or nothing.
    pub truth: Truth,
    /// Whether the data can show it.
    pub shows: bool,
}

/// Angle and torque over a recording's samples.
struct Motion([Vec<f64>; 2]);

impl Motion {
    fn less(mut self, other: &Self) -> Vec<Vec<f64>> {
        for (mine, theirs) in self.0.iter_mut().zip(&other.0) {
            mine.iter_mut().zip(theirs).for_each(|(mine, theirs)| *mine -= theirs);
        }
        self.0.into()
    }
}

/// The key to a recording, from its run.h5.
///
/// # Errors
/// A file that can't be read, or has no command.
pub fn answer(recording: &Recording, run_h5: &Path) -> Result<Answer> {
    let mut log = run_log::read_log(run_h5)?;
    let run = log.runs.first_mut().context("a run")?;
    log_data::cut_to_energised(run);
    let run = &*run;
    let belief = parse_model(&recording.belief_toml, "belief.toml")?;
    let Some(change) = &recording.change else {
        return Ok(Answer { truth: truth(recording, &belief, &[], Vec::new(), 0.0), shows: true });
    };
    let plain = follow(&belief, run)?;
    let difference = follow(&with(&belief, change.clone()), run)?.less(&plain);
    let weights = weights(recording.encoder, &belief, run);
    let mut columns = Columns::default();
    let slopes = |id: EffectId, bound: f64, columns: &mut Columns| -> Result<Vec<usize>> {
        let begin = columns.values.len();
        for effect in small(id, &belief) {
            columns.values.push(follow(&with(&belief, effect), run)?.less(&plain));
            columns.bounds.push(bound);
        }
        Ok((begin..columns.values.len()).collect())
    };
    for id in NUMBERS {
        // A slope is that of SMALL, which is the tolerance.
        slopes(id, WITHIN * TOLERANCE / SMALL, &mut columns)?;
    }
    let nuisances: Vec<usize> = (0..columns.values.len()).collect();
    let mut causes = Vec::new();
    let rivals = LIKE.into_iter().filter(|id| *id != change.id() && is_testable(*id, run));
    for id in rivals {
        causes.push((id, slopes(id, f64::INFINITY, &mut columns)?));
        // A slope is no measure of a large amount where a rotor sticks: the amount that fits best, as it is.
        if let [only] = small(id, &belief).as_slice()
            && let Some(column) = as_large(only, &belief, run, (&plain, &difference, &weights))?
        {
            causes.push((id, vec![columns.values.len()]));
            columns.values.push(column);
            columns.bounds.push(f64::INFINITY);
        }
    }
    let normal = Normal::new(&columns, &difference, &weights);
    let seen = normal.left(&nuisances).seen;
    let (mut alike, mut same) = (Vec::new(), false);
    for (id, which) in causes {
        let which: Vec<usize> = nuisances.iter().chain(&which).copied().collect();
        let left = normal.left(&which);
        if left.seen < SAME.max(ALIKE * seen) || left.square < CHANCE {
            if !alike.contains(&id) {
                alike.push(id);
            }
            same |= left.square < CHANCE || left.seen < SAME;
        }
    }
    let shows = seen >= WEAK && !same;
    let hidden = if shows { vec![change] } else { Vec::new() };
    if !shows {
        alike.push(change.id());
    }
    let mut truth = truth(recording, &belief, &hidden, alike, seen);
    if let Some(imperfect) = &mut truth.imperfect {
        imperfect.world.insert("change".to_owned(), json!(crate::changes::toml(change)));
        imperfect.world.insert("seen".to_owned(), json!(seen));
    }
    Ok(Answer { truth, shows })
}

/// The belief's numbers.
const NUMBERS: [EffectId; 7] = [
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::ViscousLevel,
    EffectId::StribeckVelocity,
    EffectId::BristleStiffness,
    EffectId::LoadInertia,
    EffectId::HoldingTorqueLevel,
];

/// Causes that a difference is compared with.
const LIKE: [EffectId; 23] = [
    EffectId::CoulombLevel,
    EffectId::StaticLevel,
    EffectId::ViscousLevel,
    EffectId::StribeckVelocity,
    EffectId::BristleStiffness,
    EffectId::LoadInertia,
    EffectId::HoldingTorqueLevel,
    EffectId::PressureDependentFriction,
    EffectId::TemperatureDependentViscosity,
    EffectId::TemperatureDependentFriction,
    EffectId::DirectionAsymmetry,
    EffectId::AngleDependentFriction,
    EffectId::FlowTorque,
    EffectId::PressureTorque,
    EffectId::PositionTorque,
    EffectId::DetentTorque,
    EffectId::MicrostepError,
    EffectId::Backlash,
    EffectId::CouplingCompliance,
    EffectId::SensorDelay,
    EffectId::TorqueOffset,
    EffectId::TorqueGain,
    EffectId::EncoderEccentricity,
];

type Difference<'a> = (&'a Motion, &'a [Vec<f64>], &'a [Vec<f64>]);

/// What a cause changes in the amount that fits a difference best by itself; `None` where no such amount is allowed.
fn as_large(
    effect: &Effect,
    belief: &Model,
    run: &Run,
    (plain, difference, weights): Difference<'_>,
) -> Result<Option<Vec<Vec<f64>>>> {
    const ROUNDS: usize = 8;
    let mut amount = 1.0;
    let mut best = None;
    for _ in 0..ROUNDS {
        let Some(effect) = scaled(effect, amount) else { break };
        let values = follow(&with(belief, effect), run)?.less(plain);
        let columns = Columns { values: vec![values.clone()], bounds: vec![f64::INFINITY] };
        amount *= Normal::new(&columns, difference, weights).left(&[0]).coefficients[0];
        best = Some(values);
    }
    Ok(best)
}

/// So many times as much of an effect.
fn scaled(effect: &Effect, amount: f64) -> Option<Effect> {
    let part = |(key, value): (&str, &EffectValue)| match (key, value) {
        ("factor", EffectValue::Number(factor)) => EffectValue::Number(1.0 + amount * (factor - 1.0)),
        (_, EffectValue::Number(number)) => EffectValue::Number(amount * number),
        (_, EffectValue::List(numbers)) => {
            EffectValue::List(numbers.iter().map(|number| amount * number).collect())
        }
    };
    let parts: Vec<(&str, EffectValue)> = effect.parts().map(|one| (one.0, part(one))).collect();
    // A spring is the softer the more there is of it.
    (effect.id() != EffectId::CouplingCompliance).then(|| Effect::new(effect.id(), &parts).ok())?
}

/// Whether what a cause depends on changes during the run: one pressure or one temperature tells nothing of it.
fn is_testable(id: EffectId, run: &Run) -> bool {
    let span = |values: &Option<Vec<f64>>| {
        let known = values.iter().flatten().copied().filter(|value| value.is_finite());
        known.fold(None, |span: Option<(f64, f64)>, value| {
            Some(span.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        })
    };
    match id {
        EffectId::PressureDependentFriction | EffectId::FlowTorque | EffectId::PressureTorque => {
            span(&run.pressure_drop_pa).is_some_and(|(low, high)| high > 1.2 * low)
        }
        EffectId::TemperatureDependentViscosity | EffectId::TemperatureDependentFriction => {
            span(&run.oil_temperature_c).is_some_and(|(low, high)| high > low + 2.0)
        }
        EffectId::CoulombLevel
        | EffectId::StaticLevel
        | EffectId::ViscousLevel
        | EffectId::StribeckVelocity
        | EffectId::BristleStiffness
        | EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::LoadInertia
        | EffectId::HoldingTorqueLevel
        | EffectId::TorqueGain
        | EffectId::TorqueOffset
        | EffectId::AngleDependentFriction
        | EffectId::DirectionAsymmetry
        | EffectId::DwellStiction
        | EffectId::HydraulicLock
        | EffectId::FrictionLag
        | EffectId::PreslidingHysteresis
        | EffectId::WearDrift
        | EffectId::PositionTorque
        | EffectId::CouplingCompliance
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::Backlash
        | EffectId::MissedSteps
        | EffectId::SensorDelay
        | EffectId::EncoderEccentricity
        | EffectId::Custom(_) => true,
    }
}

/// An effect in small amounts of each of its shapes.
fn small(id: EffectId, belief: &Model) -> Vec<Effect> {
    let one = |parts: &[(&str, EffectValue)]| Effect::new(id, parts).unwrap();
    let number = |key: &str, value: f64| one(&[(key, EffectValue::Number(value))]);
    let waves = |size: f64| -> Vec<Effect> {
        let orders = (0..2).flat_map(|order| ["cos", "sin"].map(|key| (order, key)));
        let wave = |(order, key): (usize, &str)| {
            let mut list = vec![0.0; order + 1];
            list[order] = size;
            one(&[(key, EffectValue::List(list))])
        };
        orders.map(wave).collect()
    };
    let coulomb_nm = coulomb_nm(belief);
    match id {
        EffectId::PressureDependentFriction => vec![number("gain", 0.01)],
        EffectId::TemperatureDependentViscosity | EffectId::TemperatureDependentFriction => {
            vec![number("beta_per_k", 0.005)]
        }
        EffectId::DirectionAsymmetry => vec![number("level", 0.03), number("viscous", 0.1)],
        EffectId::AngleDependentFriction => waves(0.03),
        EffectId::FlowTorque => waves(0.01 * coulomb_nm),
        EffectId::PositionTorque => waves(0.03 * coulomb_nm),
        EffectId::PressureTorque => vec![number("gain", 0.01 * coulomb_nm)],
        EffectId::DetentTorque => waves(0.03),
        EffectId::MicrostepError => waves(5e-5),
        EffectId::Backlash => vec![number("half_width_rad", 3e-4)],
        EffectId::CouplingCompliance => vec![one(&[
            ("stiffness_nm_per_rad", EffectValue::Number(5000.0)),
            ("damping_nm_s_per_rad", EffectValue::Number(1.0)),
        ])],
        EffectId::SensorDelay => vec![number("delay_s", 3e-4)],
        EffectId::TorqueOffset => vec![number("offset_nm", 0.03 * coulomb_nm)],
        EffectId::EncoderEccentricity => [0.0, 1.571]
            .map(|phase| {
                one(&[
                    ("amplitude_rad", EffectValue::Number(1e-4)),
                    ("phase_rad", EffectValue::Number(phase)),
                ])
            })
            .to_vec(),
        EffectId::CoulombLevel
        | EffectId::StaticLevel
        | EffectId::ViscousLevel
        | EffectId::StribeckVelocity
        | EffectId::BristleStiffness
        | EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::LoadInertia
        | EffectId::HoldingTorqueLevel
        | EffectId::TorqueGain => vec![number("factor", 1.0 + SMALL)],
        // Their changes are no small ones of one number, or of no motion alone.
        EffectId::DwellStiction
        | EffectId::HydraulicLock
        | EffectId::FrictionLag
        | EffectId::PreslidingHysteresis
        | EffectId::WearDrift
        | EffectId::MissedSteps
        | EffectId::Custom(_) => Vec::new(),
    }
}

fn with(belief: &Model, effect: Effect) -> Model {
    let mut model = belief.clone();
    model.effects.push(effect);
    model
}

/// Angle and torque as the valve answers the recorded command; a delay of the encoder by its slope.
fn follow(model: &Model, run: &Run) -> Result<Motion> {
    let params = ValveParams::new(model)?;
    let command = run.angle_command_rad.as_ref().context("a command")?;
    let known: Vec<usize> = (0..run.len()).filter(|row| command[*row].is_finite()).collect();
    let at = |values: &Option<Vec<f64>>, row: usize, otherwise: f64| {
        values.as_ref().map(|values| values[row]).filter(|value| value.is_finite()).unwrap_or(otherwise)
    };
    let mut state = ValveState::at_rest(command[known[0]]);
    let mut motion = Motion([vec![command[known[0]]], vec![0.0]]);
    for pair in known.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let input = ValveInput {
            command_start_rad: command[from],
            command_end_rad: command[to],
            pressure_drop_pa: at(&run.pressure_drop_pa, from, 0.0),
            oil_temperature_c: at(&run.oil_temperature_c, from, model.reference_temperature_c()),
            current_ratio: 1.0,
        };
        let output = step(&params, &mut state, &input, run.time_s[to] - run.time_s[from]);
        motion.0[0].push(output.encoder_angle_rad);
        motion.0[1].push(output.measured_torque_nm);
    }
    let delay = model.effects.iter().find(|effect| effect.id() == EffectId::SensorDelay);
    if let Some((_, EffectValue::Number(delay_s))) = delay.and_then(|effect| effect.parts().next()) {
        let angle = motion.0[0].clone();
        for k in 1..angle.len() {
            let step_s = run.time_s[known[k]] - run.time_s[known[k - 1]];
            motion.0[0][k] -= delay_s * (angle[k] - angle[k - 1]) / step_s;
        }
    }
    Ok(motion)
}

/// 1/σ² of the samples that `follow` goes through.
fn weights(encoder: Encoder, belief: &Model, run: &Run) -> Vec<Vec<f64>> {
    let angle = (encoder.noise_rad.powi(2) + encoder.step_rad.powi(2) / 12.0).sqrt().max(ANGLE_RAD);
    let torque = TORQUE * coulomb_nm(belief);
    let known = run.angle_command_rad.iter().flatten().filter(|command| command.is_finite()).count();
    [angle, torque].map(|deviation| vec![deviation.powi(-2); known]).into()
}

fn truth(
    recording: &Recording,
    belief: &Model,
    hidden: &[&Effect],
    alike: Vec<EffectId>,
    seen: f64,
) -> Truth {
    let alike: Vec<String> = alike.into_iter().map(|id| id.name().to_owned()).collect();
    let effect = |effect: &&Effect| {
        let value = |value: &EffectValue| match value {
            EffectValue::Number(number) => json!(number),
            EffectValue::List(numbers) => json!(numbers),
        };
        let parameters: Map<String, Value> =
            effect.parts().map(|(key, of)| (key.to_owned(), value(of))).collect();
        HiddenEffect {
            id: effect.id().name().to_owned(),
            parameters,
            same_form: true,
            strength: seen,
            acts_in: Vec::new(),
        }
    };
    let mut world = Map::new();
    world.insert("recording".to_owned(), json!(recording.what));
    let imperfect = Imperfect {
        tolerance: TOLERANCE,
        also_true: if hidden.is_empty() { alike.clone() } else { Vec::new() },
        world,
        ..Imperfect::default()
    };
    Truth {
        seed: recording.seed,
        log: LogKind::Angle,
        effects: hidden.iter().map(effect).collect(),
        noise: TORQUE * coulomb_nm(belief),
        encoder_step_rad: recording.encoder.step_rad,
        twins: Vec::new(),
        near_twins: if hidden.is_empty() { Vec::new() } else { alike },
        verdict: if hidden.is_empty() { "no-discrepancy" } else { "explained" },
        // A truth that is the belief leaves nothing imperfect.
        imperfect: recording.change.is_some().then_some(imperfect),
    }
}
