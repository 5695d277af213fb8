//! The real family: measurements with the instruments, models, motions and records that are met in the field.
//!
//! The valve's physics is the exact family's. What is hidden is "strong" or "weak" by what is left of it after the model's
//! numbers have moved within their tolerance and zeros have moved from run to run, sample by sample over what each sample is
//! known to ([`weights`]). Which other causes these data can't tell from it is computed, not looked up ([`alike`]).

mod alike;
mod fit;
mod instruments;
mod motions;
mod record;
mod weights;
mod world;

use crate::campaign::Campaign;
use crate::contact::Contact;
use crate::effect::Effect;
use crate::effects::Instance;
use crate::hidden::Hidden;
use crate::log_kind::LogKind;
use crate::measure::measure;
use crate::nominal::Nominal;
use crate::plan::RunPlan;
use crate::spool::{Outputs, Valve};
use crate::truth::{HiddenEffect, Imperfect, Truth};
use alike::Slopes;
pub use fit::{Columns, Left, Normal};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use world::{Presence, TOLERANCE, World};

/// Attempts to draw a measurement that shows what is hidden, and in which the rotor keeps step.
const ATTEMPTS: u64 = 40;
/// Rounds in which an effect's amount is brought to its strength.
const ROUNDS: usize = 5;
/// An effect larger than so many times its natural size is none that one meets, or smaller than such a part of it.
const MOST_AMOUNT: f64 = 5.0;
const LEAST_AMOUNT: f64 = 0.01;
/// A spool has turned back once it has come back by so much, rad: without that, play is a zero of the angle.
const TURNED_BACK_RAD: f64 = 0.01;
/// A number is hidden as a cause where it is off by so many tolerances, or more.
const BEYOND: f64 = 4.0;
/// Samples that effects are sized and compared on, about: what they change is simulated some fifty times.
const PART: usize = 15_000;
/// What pressure (MPa) and temperature (K) have to span for an effect to be more than a level.
const LEAST_MPA: f64 = 1.0;
const LEAST_K: f64 = 4.0;
/// The least share of a run that shows all its motions.
const LEAST_SHARE: f64 = 0.35;
/// The strength from which on a slow transducer is part of the truth.
const SHOWS: f64 = 0.3;

/// What was drawn before anything is hidden in it.
struct Draft {
    kind: LogKind,
    nominal: Nominal,
    believed: Nominal,
    world: World,
    runs: Vec<RunPlan>,
    /// A part of the runs that has some of everything: what is hidden is sized and compared with its like on it.
    part: Vec<RunPlan>,
    labels: Vec<String>,
}

/// One hidden effect as the measurement shows it.
struct Shown {
    instance: Instance,
    seen: f64,
    acts_in: Vec<usize>,
    change: Vec<Vec<f64>>,
}

/// Draws a measurement; `None` where no attempt shows what is to be hidden.
pub(crate) fn try_draw(seed: u64, hidden: &Hidden) -> Option<Campaign> {
    (0..ATTEMPTS).find_map(|attempt| try_once(seed, attempt, hidden))
}

fn try_once(seed: u64, attempt: u64, hidden: &Hidden) -> Option<Campaign> {
    let mut rng = Pcg64::seed_from_u64(seed ^ (attempt << 48) ^ (1 << 47));
    let mut draft = Draft::draw(hidden, &mut rng);
    let effects = hidden.effects();
    if !effects.iter().all(|effect| draft.varies_with(*effect)) {
        return None;
    }
    let plain = measure(draft.kind, &draft.part, &draft.valve(&[], &draft.part))?;
    if effects.contains(&Effect::Backlash) && !plain.iter().any(turns_back) {
        return None;
    }
    let instances: Vec<Instance> = effects.iter().map(|effect| draft.instance(*effect, &mut rng)).collect();
    let late = draft.lateness(&plain);
    let nuisances = match (instances.is_empty(), &late) {
        (true, None) => Columns::default(),
        _ => draft.slopes(&plain).nuisances(&draft.world)?,
    };
    let shown = draft.set_strength(instances, hidden.strength, &plain, &nuisances)?;
    let all: Vec<&Instance> = shown.iter().map(|one| &one.instance).collect();
    let outputs = measure(draft.kind, &draft.runs, &draft.valve(&all, &draft.runs))?;
    let truth = draft.truth(seed, hidden, &shown, late, (&plain, nuisances))?;
    let log = record::log(&draft, seed, &outputs, hidden.noise_free, &mut rng);
    let model_toml =
        draft.believed.toml(&format!("believed valve of seed {seed}"), draft.kind == LogKind::Angle);
    Some(Campaign { log, model_toml, truth })
}

/// Whether a spool goes both ways.
fn turns_back(outputs: &Outputs) -> bool {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut risen, mut fallen) = (false, false);
    for angle in &outputs.angle_rad {
        (least, most) = (least.min(*angle), most.max(*angle));
        risen |= angle - least > TURNED_BACK_RAD;
        fallen |= most - angle > TURNED_BACK_RAD;
    }
    risen && fallen
}

impl Draft {
    fn draw(hidden: &Hidden, rng: &mut Pcg64) -> Self {
        let nominal = Nominal::draw(rng);
        let mut world = World::draw(hidden.log, &nominal, hidden.samples, rng);
        let (mut runs, labels) = motions::plan(&nominal, &world, hidden.log, rng);
        for effect in hidden.effects() {
            let needs = effect.needs();
            if needs.pressure() {
                world.pressure = Presence::All;
            }
            if needs.temperature() {
                world.temperature = Presence::All;
            }
            if effect == Effect::TorqueOffset {
                // One zero for all runs is what it says.
                (world.zero, world.drift_per_s) = (0.0, 0.0);
            }
        }
        if world.source == world::Source::Loop && hidden.log == LogKind::Angle {
            let microstep_rad = TAU / (crate::nominal::FULL_STEPS * 225.0);
            runs.iter_mut().for_each(|run| run.microstep_rad = microstep_rad);
        }
        let believed = nominal.misjudged(world.off_by, rng);
        let part = part(&runs);
        Self { kind: hidden.log, nominal, believed, world, runs, part, labels }
    }

    /// Whether what an effect depends on changes: with one pressure or one temperature it is a level.
    fn varies_with(&self, effect: Effect) -> bool {
        let spans = |value: &dyn Fn(&RunPlan) -> crate::plan::Slow| {
            let ends =
                |run: &RunPlan| [value(run).mean - value(run).wobble, value(run).mean + value(run).wobble];
            let all: Vec<f64> = self.runs.iter().flat_map(ends).collect();
            all.iter().copied().fold(f64::MIN, f64::max) - all.iter().copied().fold(f64::MAX, f64::min)
        };
        let needs = effect.needs();
        (!needs.pressure() || spans(&|run| run.pressure_mpa) > LEAST_MPA)
            && (!needs.temperature() || spans(&|run| run.celsius) > LEAST_K)
    }

    fn instance(&self, effect: Effect, rng: &mut Pcg64) -> Instance {
        let mut instance = Instance::draw(effect, rng);
        if self.kind == LogKind::Angle && effect == Effect::OutsideHum {
            instance.amount = 1.0 / (self.nominal.holding_nm * crate::nominal::TEETH);
        }
        instance
    }

    fn valve(&self, which: &[&Instance], runs: &[RunPlan]) -> Valve {
        let mut valve = Valve::new(Contact::new(self.nominal));
        for instance in which {
            instance.apply(&mut valve, runs);
        }
        valve
    }

    fn weights(&self, plain: &[Outputs]) -> Vec<Vec<f64>> {
        weights::of(&self.world, self.kind, self.nominal.load_kg_m2, &self.part, plain)
    }

    fn slopes<'a>(&'a self, plain: &'a [Outputs]) -> Slopes<'a> {
        Slopes { kind: self.kind, nominal: &self.nominal, runs: &self.part, plain }
    }

    /// The loudest noise that such a measurement has.
    fn most_noise(&self) -> f64 {
        if self.kind == LogKind::Torque { 0.05 * self.nominal.coulomb_nm } else { 5e-4 }
    }

    /// Brings each effect to its strength; the noise gives way where an effect can't be smaller. `None` where an effect
    /// would have to be larger than any that one meets.
    fn set_strength(
        &mut self,
        instances: Vec<Instance>,
        strength: f64,
        plain: &[Outputs],
        nuisances: &Columns,
    ) -> Option<Vec<Shown>> {
        let mut all: Vec<Shown> = Vec::new();
        for instance in instances {
            let mut shown = self.brought(instance, strength, plain, nuisances)?;
            let louder = (shown.seen / strength).min(self.most_noise() / self.world.noise);
            if all.is_empty() && louder > 1.1 {
                self.world.noise *= louder;
                shown = self.shown(shown.instance, plain, nuisances)?;
            }
            let weak = strength < 0.5 * (crate::STRONG + crate::WEAK);
            if shown.seen < 0.8 * strength || (weak && shown.seen > 1.5 * strength) {
                return None;
            }
            all.push(shown);
        }
        Some(all)
    }

    fn brought(
        &self,
        mut instance: Instance,
        strength: f64,
        plain: &[Outputs],
        nuisances: &Columns,
    ) -> Option<Shown> {
        let natural = instance.amount;
        let mut shown = self.shown(instance.clone(), plain, nuisances)?;
        for _ in 0..ROUNDS {
            let ratio = strength / shown.seen.max(1e-9);
            if !instance.is_scalable() || (ratio - 1.0).abs() < 0.05 {
                break;
            }
            instance.amount = (instance.amount * ratio.clamp(0.1, 4.0)).min(MOST_AMOUNT * natural);
            shown = self.shown(instance.clone(), plain, nuisances)?;
        }
        if instance.amount < LEAST_AMOUNT * natural {
            return None;
        }
        let least = BEYOND * TOLERANCE;
        for _ in 0..ROUNDS {
            let off = self.off_by(&instance);
            if off >= least {
                break;
            }
            instance.amount *= 1.02 * least / off.max(1e-3);
            if instance.amount > MOST_AMOUNT * natural {
                return None;
            }
            shown = self.shown(instance.clone(), plain, nuisances)?;
        }
        Some(shown)
    }

    /// How far a number that has a tolerance is off, as a part of it; anything else is off far enough.
    fn off_by(&self, instance: &Instance) -> f64 {
        let applied = instance.apply(&mut Valve::new(Contact::new(self.nominal)), &self.runs).parameters;
        let number = |key: &str| applied.get(key).and_then(Value::as_f64);
        let offset = number("offset_nm").map(|offset| offset.abs() / self.nominal.coulomb_nm);
        number("factor").map(|factor| factor.ln().abs()).or(offset).unwrap_or(f64::INFINITY)
    }

    fn shown(&self, instance: Instance, plain: &[Outputs], nuisances: &Columns) -> Option<Shown> {
        let change = self.slopes(plain).change(&self.valve(&[&instance], &self.part))?;
        let weights = self.weights(plain);
        let base: Vec<usize> = (0..nuisances.values.len()).collect();
        let left = Normal::new(nuisances, &change, &weights).left(&base);
        Some(Shown { instance, seen: left.seen, acts_in: left.acts_in, change })
    }

    fn truth(
        &self,
        seed: u64,
        hidden: &Hidden,
        shown: &[Shown],
        late: Option<(Vec<Vec<f64>>, f64)>,
        (plain, mut columns): (&[Outputs], Columns),
    ) -> Option<Truth> {
        let mut also_true = Vec::new();
        if self.kind == LogKind::Angle && self.world.zero > 0.0 {
            also_true.push(Effect::TorqueOffset.name().to_owned());
        }
        let mut near_twins: BTreeSet<String> = BTreeSet::new();
        if !shown.is_empty() || late.is_some() {
            let slopes = self.slopes(plain);
            let nuisances: Vec<usize> = (0..columns.values.len()).collect();
            let causes = slopes.causes(&mut columns, |effect| self.has_channels_of(effect));
            let weights = self.weights(plain);
            for (index, one) in shown.iter().enumerate() {
                let normal = Normal::new(&columns, &one.change, &weights);
                let beside = |(effect, _): &&(Effect, Vec<usize>)| {
                    shown
                        .iter()
                        .enumerate()
                        .any(|(other, of)| other != index && of.instance.effect == *effect)
                };
                let others = causes.iter().filter(beside).flat_map(|(_, columns)| columns);
                let base: Vec<usize> = nuisances.iter().chain(others).copied().collect();
                let hidden = (one.instance.effect, one.seen);
                let like = alike::alike(&normal, &base, &causes, hidden, &self.world);
                if shown.iter().any(|other| like.contains(&other.instance.effect)) {
                    return None;
                }
                near_twins.extend(names(&like));
            }
            if let Some((change, seen)) = late {
                let normal = Normal::new(&columns, &change, &weights);
                also_true.push(Effect::SensorDelay.name().to_owned());
                let late = (Effect::SensorDelay, seen);
                also_true.extend(names(&alike::alike(&normal, &nuisances, &causes, late, &self.world)));
            }
        }
        let verdict = match (hidden.effects.len(), hidden.is_outside()) {
            (0, _) => "no-discrepancy",
            (1, true) => "unexplained",
            (_, true) => "partly-explained",
            _ => "explained",
        };
        Some(Truth {
            seed,
            log: hidden.log,
            effects: shown.iter().map(|one| self.effect(one)).collect(),
            noise: self.world.noise,
            encoder_step_rad: self.world.encoder.step_rad,
            twins: Vec::new(),
            near_twins: near_twins.into_iter().collect(),
            verdict,
            imperfect: Some(Imperfect {
                tolerance: TOLERANCE,
                also_true,
                torque_lag_s: (self.kind == LogKind::Torque)
                    .then(|| instruments::lag_s(self.world.bandwidth_hz)),
                world: self.facts(),
            }),
        })
    }

    /// What the transducer's low-pass changes, where it shows.
    fn lateness(&self, plain: &[Outputs]) -> Option<(Vec<Vec<f64>>, f64)> {
        if self.kind == LogKind::Angle {
            return None;
        }
        let run = |(run, outputs): (&RunPlan, &Outputs)| -> Vec<f64> {
            let late = instruments::transduced(&run.times_s, &outputs.torque_nm, self.world.bandwidth_hz);
            late.iter().zip(&outputs.torque_nm).map(|(late, torque)| late - torque).collect()
        };
        let change: Vec<Vec<f64>> = self.part.iter().zip(plain).map(run).collect();
        let weights = self.weights(plain);
        let seen = Normal::new(&Columns::default(), &change, &weights).left(&[]).seen;
        (seen > SHOWS).then_some((change, seen))
    }

    fn has_channels_of(&self, effect: Effect) -> bool {
        let needs = effect.needs();
        (!needs.pressure() || self.world.pressure != Presence::None)
            && (!needs.temperature() || self.world.temperature != Presence::None)
    }

    fn effect(&self, one: &Shown) -> HiddenEffect {
        let applied = one.instance.apply(&mut Valve::new(Contact::new(self.nominal)), &self.runs);
        let mut parameters = applied.parameters;
        if let Some(factor) = parameters.get("factor").and_then(Value::as_f64) {
            // What the file's number is to be multiplied by.
            parameters.insert("factor".to_owned(), json!(factor * self.misjudged(one.instance.effect)));
        }
        let delay_s = parameters.get("delay_s").and_then(Value::as_f64);
        if let Some(delay_s) = delay_s.filter(|_| self.kind == LogKind::Torque) {
            // The transducer's own lag comes on top of it.
            let lag_s = instruments::lag_s(self.world.bandwidth_hz);
            parameters.insert("delay_s".to_owned(), json!(delay_s + lag_s));
        }
        HiddenEffect {
            id: one.instance.effect.name().to_owned(),
            parameters,
            same_form: applied.same_form,
            strength: one.seen,
            acts_in: one.acts_in.iter().map(|run| self.part[*run].name.clone()).collect(),
        }
    }

    /// True over believed, of the number that a level stands for.
    fn misjudged(&self, effect: Effect) -> f64 {
        let number: fn(&Nominal) -> f64 = match effect {
            Effect::CoulombLevel => |n| n.coulomb_nm,
            Effect::StaticLevel => |n| n.static_nm,
            Effect::ViscousLevel => |n| n.viscous_nm_s_per_rad,
            Effect::StribeckVelocity => |n| n.stribeck_rad_per_s,
            Effect::BristleStiffness => |n| n.stiffness_nm_per_rad,
            Effect::LoadInertia => |n| n.load_kg_m2,
            Effect::HoldingTorqueLevel => |n| n.holding_nm,
            Effect::PressureDependentFriction
            | Effect::TemperatureDependentViscosity
            | Effect::TemperatureDependentFriction
            | Effect::AngleDependentFriction
            | Effect::DirectionAsymmetry
            | Effect::DwellStiction
            | Effect::HydraulicLock
            | Effect::FrictionLag
            | Effect::PreslidingHysteresis
            | Effect::WearDrift
            | Effect::FlowTorque
            | Effect::PressureTorque
            | Effect::PositionTorque
            | Effect::CouplingCompliance
            | Effect::SensorDelay
            | Effect::TorqueOffset
            | Effect::TorqueGain
            | Effect::DetentTorque
            | Effect::MicrostepError
            | Effect::Backlash
            | Effect::MissedSteps
            | Effect::EncoderEccentricity
            | Effect::OutsideSquareDrag
            | Effect::OutsideHum
            | Effect::OutsideGear
            | Effect::OutsideWander
            | Effect::OutsidePlay
            | Effect::OutsideLaw
            | Effect::OutsidePressureLaw
            | Effect::OutsideWarmthLaw
            | Effect::OutsideWarmPressureLaw => return 1.0,
        };
        number(&self.nominal) / number(&self.believed)
    }

    fn facts(&self) -> serde_json::Map<String, Value> {
        let w = &self.world;
        let facts = json!({
            "motions": format!("{:?}", w.source), "rate_hz": w.rate_hz, "runs": w.runs, "run_s": w.run_s,
            "encoder_step_rad": w.encoder.step_rad, "encoder_noise_rad": w.encoder.noise_rad,
            "colour": format!("{:?}", w.colour), "noise": w.noise, "bandwidth_hz": w.bandwidth_hz,
            "numbers_off_by": w.off_by, "zero_by_run": w.zero, "drift_per_s": w.drift_per_s,
            "pressure": format!("{:?}", w.pressure), "temperature": format!("{:?}", w.temperature),
            "missing": w.missing, "stroke_rad": w.stroke_rad,
        });
        if let Value::Object(map) = facts { map } else { serde_json::Map::new() }
    }
}

fn names(effects: &[Effect]) -> impl Iterator<Item = String> {
    effects.iter().map(|effect| effect.name().to_owned())
}

/// Every nth run of many, the beginnings of few.
fn part(runs: &[RunPlan]) -> Vec<RunPlan> {
    let total: usize = runs.iter().map(|run| run.times_s.len()).sum();
    let every = (total / PART).clamp(1, (runs.len() / 4).max(1));
    let mut part: Vec<RunPlan> = runs.iter().step_by(every).cloned().collect();
    if total / every > PART + PART / 2 {
        let share = (PART as f64 * every as f64 / total as f64).max(LEAST_SHARE);
        for run in &mut part {
            run.times_s.truncate((share * run.times_s.len() as f64) as usize);
        }
    }
    part
}
