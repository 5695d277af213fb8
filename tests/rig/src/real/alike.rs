//! What can stand for what: nuisances within their bounds, and causes that change a measurement as the hidden one does.
//!
//! A cause is alike where, beside the nuisances, it leaves less than [`ALIKE`] of what the hidden effect changes, or less than
//! chance does. Its coefficients are free; its columns are the rig's own changes of the measurement for small amounts.

use super::fit::{Columns, Normal};
use super::world::{Colour, TOLERANCE, World};
use crate::contact::Contact;
use crate::effect::Effect;
use crate::effects::Instance;
use crate::log_kind::LogKind;
use crate::measure::{channel, measure};
use crate::nominal::Nominal;
use crate::plan::RunPlan;
use crate::spool::{Outputs, Valve};

/// The part of an effect's RMS that a like one may leave.
const ALIKE: f64 = 0.15;
/// A sum of squares that chance leaves hardly ever, for no and for each further coefficient.
const CHANCE: (f64, f64) = (25.0, 3.0);
/// Nuisances go so many of their standard deviations far.
const WITHIN: f64 = 2.0;
/// Zeros and their drift so many of theirs.
const ZEROS_WITHIN: f64 = 3.0;
/// Causes that are one number of the model, whose slopes the nuisances have already.
const NUMBERS: [Effect; 5] = [
    Effect::StaticLevel,
    Effect::StribeckVelocity,
    Effect::BristleStiffness,
    Effect::ViscousLevel,
    Effect::LoadInertia,
];
/// Small amounts for slopes.
const SMALL: f64 = 0.3;

/// The nominal valve's measurement, and what is needed to ask how changes of the valve change it.
pub(super) struct Slopes<'a> {
    pub kind: LogKind,
    pub nominal: &'a Nominal,
    pub runs: &'a [RunPlan],
    pub plain: &'a [Outputs],
}

impl Slopes<'_> {
    /// By how much a valve's measurement differs from the nominal one's; `None` where the rotor loses steps.
    pub fn change(&self, valve: &Valve) -> Option<Vec<Vec<f64>>> {
        let changed = measure(self.kind, self.runs, valve)?;
        let run = |(with, plain): (&Outputs, &Outputs)| -> Vec<f64> {
            let pairs = channel(self.kind, with).iter().zip(channel(self.kind, plain));
            pairs.map(|(with, plain)| with - plain).collect()
        };
        Some(changed.iter().zip(self.plain).map(run).collect())
    }

    fn scaled(&self, valve: &Valve, per: f64) -> Option<Vec<Vec<f64>>> {
        let mut change = self.change(valve)?;
        change.iter_mut().flatten().for_each(|value| *value /= per);
        Some(change)
    }

    /// Each number of the model within its tolerance, the channel's scale and zero, zeros by run and their drift.
    /// `None` where the rotor loses steps.
    pub fn nuisances(&self, world: &World) -> Option<Columns> {
        let n = self.nominal;
        let mut columns = Columns::default();
        let mut add = |values: Option<Vec<Vec<f64>>>, bound: f64| {
            if let Some(values) = values {
                columns.values.push(values);
                columns.bounds.push(bound);
            }
        };
        let part = 1.0 + TOLERANCE;
        // Those that are causes too first, in the order of NUMBERS.
        let mut numbers = vec![
            Nominal { static_nm: n.static_nm * part, ..*n },
            Nominal { stribeck_rad_per_s: n.stribeck_rad_per_s * part, ..*n },
            Nominal { stiffness_nm_per_rad: n.stiffness_nm_per_rad * part, ..*n },
            Nominal { viscous_nm_s_per_rad: n.viscous_nm_s_per_rad * part, ..*n },
            Nominal { load_kg_m2: n.load_kg_m2 * part, ..*n },
            Nominal { coulomb_nm: n.coulomb_nm * part, ..*n },
            Nominal { damping_nm_s_per_rad: n.damping_nm_s_per_rad * part, ..*n },
        ];
        if self.kind == LogKind::Angle {
            numbers.extend([
                Nominal { holding_nm: n.holding_nm * part, ..*n },
                Nominal { rotor_kg_m2: n.rotor_kg_m2 * part, ..*n },
                Nominal { motor_damping_nm_s_per_rad: n.motor_damping_nm_s_per_rad * part, ..*n },
            ]);
        }
        for number in numbers {
            let slope = self.scaled(&Valve::new(Contact::new(number)), TOLERANCE)?;
            add(Some(slope), WITHIN * TOLERANCE);
        }
        let along = |value: &dyn Fn(&RunPlan, f64) -> f64| {
            let run = |run: &RunPlan| run.times_s.iter().map(|time| value(run, *time)).collect();
            Some(self.runs.iter().map(run).collect())
        };
        if self.kind == LogKind::Torque {
            add(Some(self.plain.iter().map(|run| run.torque_nm.clone()).collect()), WITHIN * TOLERANCE);
            add(along(&|_, _| 1.0), WITHIN * TOLERANCE * n.coulomb_nm);
        }
        if self.kind == LogKind::Angle {
            // No log says where the encoder's zero is from the command's.
            add(along(&|_, _| 1.0), f64::INFINITY);
        }
        if world.drift_per_s != 0.0 {
            add(along(&|run, time| run.clock_s + time), ZEROS_WITHIN * world.drift_per_s.abs());
        }
        if world.zero > 0.0 {
            for (index, run) in self.runs.iter().enumerate() {
                let mut values = vec![Vec::new(); self.runs.len()];
                values[index] = vec![1.0; run.times_s.len()];
                add(Some(values), ZEROS_WITHIN * world.zero);
            }
        }
        Some(columns)
    }

    /// The columns of every cause that such a log could be blamed on, appended to the nuisances; which are whose.
    pub fn causes(&self, columns: &mut Columns, known: impl Fn(Effect) -> bool) -> Vec<(Effect, Vec<usize>)> {
        let mut all = Vec::new();
        let blamed = |effect: &Effect| effect.is_listed_for(self.kind) && known(*effect);
        for effect in Effect::ALL.iter().copied().filter(blamed) {
            let begin = columns.values.len();
            if let Some(number) = NUMBERS.iter().position(|number| *number == effect) {
                columns.values.push(columns.values[number].clone());
                columns.bounds.push(f64::INFINITY);
                all.push((effect, vec![begin]));
                continue;
            }
            for instance in directions(effect) {
                let mut valve = Valve::new(Contact::new(*self.nominal));
                instance.apply(&mut valve, self.runs);
                if let Some(values) = self.change(&valve) {
                    columns.values.push(values);
                    columns.bounds.push(f64::INFINITY);
                }
            }
            all.push((effect, (begin..columns.values.len()).collect()));
        }
        all
    }
}

/// The causes that change the measurement as a hidden one does, beside the columns of `base`.
pub(super) fn alike(
    normal: &Normal<'_>,
    base: &[usize],
    causes: &[(Effect, Vec<usize>)],
    (hidden, seen): (Effect, f64),
    world: &World,
) -> Vec<Effect> {
    let fits = |(effect, columns): &&(Effect, Vec<usize>)| {
        let which: Vec<usize> = base.iter().chain(columns).copied().collect();
        let left = normal.left(&which);
        let chance = CHANCE.0 + CHANCE.1 * columns.len() as f64;
        *effect != hidden
            && !columns.is_empty()
            && (left.seen < ALIKE * seen || left.square / alike_samples(world) < chance)
    };
    causes.iter().filter(fits).map(|(effect, _)| *effect).collect()
}

/// Samples of coloured noise that tell as much as one of white noise.
fn alike_samples(world: &World) -> f64 {
    match world.colour {
        Colour::Slow { memory_s } => 1.0 + 2.0 * memory_s * world.rate_hz,
        _ => 1.0,
    }
}

/// An effect's directions: small amounts of each of its shapes. Lost steps have none.
fn directions(effect: Effect) -> Vec<Instance> {
    let one = |draws: [f64; 6]| Instance::given(effect, SMALL, draws);
    match effect {
        Effect::AngleDependentFriction | Effect::FlowTorque | Effect::PositionTorque => {
            // Once, twice and three times a turn, and three times with four beside it.
            let waves = [(0.0, 0.0), (0.4, 0.0), (0.7, 0.0), (0.7, 1.0)];
            let wave = |(order, next): (f64, f64), phase: f64| one([1.0, order, phase, next, phase, 0.0]);
            waves.into_iter().flat_map(|of| [wave(of, 0.0), wave(of, 0.25)]).collect()
        }
        Effect::MicrostepError => {
            let orders = [0.1, 0.6];
            let wave = |order: f64, phase: f64| one([1.0, phase, phase, order, 0.0, 0.0]);
            orders.into_iter().flat_map(|order| [wave(order, 0.0), wave(order, 0.25)]).collect()
        }
        Effect::DetentTorque | Effect::EncoderEccentricity => {
            vec![one([1.0; 6]), one([1.0, 0.25, 0.0, 0.0, 0.0, 0.0])]
        }
        // Level and viscous part; two time constants, or distances.
        Effect::DirectionAsymmetry | Effect::DwellStiction | Effect::HydraulicLock | Effect::WearDrift => {
            vec![one([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), one([1.0; 6])]
        }
        Effect::MissedSteps => Vec::new(),
        Effect::CoulombLevel
        | Effect::StaticLevel
        | Effect::ViscousLevel
        | Effect::StribeckVelocity
        | Effect::BristleStiffness
        | Effect::LoadInertia
        | Effect::PressureDependentFriction
        | Effect::TemperatureDependentViscosity
        | Effect::TemperatureDependentFriction
        | Effect::FrictionLag
        | Effect::PreslidingHysteresis
        | Effect::PressureTorque
        | Effect::CouplingCompliance
        | Effect::SensorDelay
        | Effect::TorqueOffset
        | Effect::TorqueGain
        | Effect::HoldingTorqueLevel
        | Effect::Backlash
        | Effect::OutsideSquareDrag
        | Effect::OutsideHum
        | Effect::OutsideGear
        | Effect::OutsideWander
        | Effect::OutsidePlay
        | Effect::OutsideLaw
        | Effect::OutsidePressureLaw
        | Effect::OutsideWarmthLaw
        | Effect::OutsideWarmPressureLaw => vec![one([0.5; 6])],
    }
}
