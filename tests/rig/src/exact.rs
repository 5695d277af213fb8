//! The exact family: campaigns whose model is exact but for what is hidden, measured with a fine encoder and white noise.

use crate::campaign::Campaign;
use crate::contact::Contact;
use crate::effect::Effect;
use crate::effects::Instance;
use crate::hidden::{Gap, Hidden, twins};
use crate::log_kind::LogKind;
use crate::measure::{channel, measure};
use crate::nominal::{Nominal, log_uniform};
use crate::ordered::{OrderedRun, plans};
use crate::plan::RunPlan;
use crate::spool::{Outputs, Valve};
use crate::truth::{HiddenEffect, Truth};
use crate::{angle_plan, torque_plan};
use log_data::{Log, Run};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// A run counts where an effect's residual is this part of the largest run's, or more.
const ACTS: f64 = 0.25;
/// Attempts to draw a campaign in which the rotor keeps step.
const ATTEMPTS: u64 = 20;
/// Noise of the encoder, rad, above which a shift of the angle over the turn is hard to tell from a torque's.
const QUIET_RAD: f64 = 1e-5;
/// Rounds in which an effect's amount is brought to its strength.
const ROUNDS: usize = 4;

/// What was drawn before anything is measured.
struct Draft {
    nominal: Nominal,
    runs: Vec<RunPlan>,
    instances: Vec<Instance>,
    kind: LogKind,
}

/// One effect's residual against the nominal valve.
struct Residual {
    rms: f64,
    acts_in: Vec<String>,
}

/// Draws a campaign; `None` where the rotor loses steps whatever is drawn.
pub(crate) fn try_draw(seed: u64, hidden: &Hidden) -> Option<Campaign> {
    (0..ATTEMPTS).find_map(|attempt| try_once(seed, attempt, hidden, &[]))
}

/// The same with the runs of several orders, one after the other, made behind the campaign's own; the log holds the last order's.
pub(crate) fn try_order(seed: u64, hidden: &Hidden, orders: &[Vec<OrderedRun>]) -> Option<Campaign> {
    (0..ATTEMPTS).find_map(|attempt| try_once(seed, attempt, hidden, orders))
}

fn try_once(seed: u64, attempt: u64, hidden: &Hidden, orders: &[Vec<OrderedRun>]) -> Option<Campaign> {
    let mut rng = Pcg64::seed_from_u64(seed ^ (attempt << 48));
    let nominal = Nominal::draw(&mut rng);
    let runs = match hidden.log {
        LogKind::Torque => torque_plan::plan(&nominal, hidden.samples, hidden.without, &mut rng),
        LogKind::Angle => angle_plan::plan(&nominal, hidden.samples, hidden.without, &mut rng),
    };
    let mut instances: Vec<Instance> =
        hidden.effects().into_iter().map(|effect| Instance::draw(effect, &mut rng)).collect();
    for instance in &mut instances {
        if hidden.log == LogKind::Angle && instance.effect == Effect::OutsideHum {
            // Its size is a torque; an angle's is smaller by the motor's stiffness.
            instance.amount = 1.0 / (nominal.holding_nm * crate::nominal::TEETH);
        }
        instance.become_a_twin(hidden.without);
    }
    let mut draft = Draft { nominal, runs, instances, kind: hidden.log };
    let plain = draft.measure(&[])?;
    let (noise, residuals) = draft.set_strength(hidden, &plain, &mut rng)?;
    let all: Vec<usize> = (0..draft.instances.len()).collect();
    let outputs = if all.is_empty() { plain } else { draft.measure(&all)? };
    let step_rad = draft.encoder_step_rad(noise);
    let quiet = hidden.noise_free;
    let mut held = 0;
    for order in orders {
        held = draft.runs.len();
        let further = plans(order, &draft.runs).ok()?;
        draft.runs.extend(further);
    }
    let outputs = if held > 0 { draft.measure(&all)? } else { outputs };
    // What was measured before has its noise already.
    let mut rng = if held > 0 { Pcg64::seed_from_u64(seed ^ held as u64) } else { rng };
    let truth = draft.truth(seed, hidden, noise, if quiet { 0.0 } else { step_rad }, &residuals);
    let mut log =
        draft.log(seed, &outputs, if quiet { 0.0 } else { noise }, truth.encoder_step_rad, &mut rng);
    log.runs.drain(..held);
    let model_toml =
        draft.nominal.toml(&format!("nominal valve of seed {seed}"), hidden.log == LogKind::Angle);
    Some(Campaign { log, model_toml, truth })
}

impl Draft {
    fn valve(&self, which: &[usize]) -> Valve {
        let mut valve = Valve::new(Contact::new(self.nominal));
        for &index in which {
            self.instances[index].apply(&mut valve, &self.runs);
        }
        valve
    }

    /// All runs with some of the effects, without noise; `None` where the rotor falls out of step.
    fn measure(&self, which: &[usize]) -> Option<Vec<Outputs>> {
        measure(self.kind, &self.runs, &self.valve(which))
    }

    fn channel<'a>(&self, outputs: &'a Outputs) -> &'a [f64] {
        channel(self.kind, outputs)
    }

    fn residual(&self, plain: &[Outputs], with: &[Outputs]) -> Residual {
        let squares: Vec<(f64, usize)> = plain
            .iter()
            .zip(with)
            .map(|(a, b)| {
                let pairs = self.channel(a).iter().zip(self.channel(b));
                (pairs.map(|(a, b)| (a - b).powi(2)).sum(), self.channel(a).len())
            })
            .collect();
        let mean = |(sum, count): &(f64, usize)| sum / *count as f64;
        let largest = squares.iter().map(mean).fold(0.0, f64::max);
        let acts = |one: &(f64, usize)| mean(one) >= ACTS * ACTS * largest;
        let (sum, count) =
            squares.iter().filter(|one| acts(one)).fold((0.0, 0), |(s, c), (a, b)| (s + a, c + b));
        let acting = self.runs.iter().zip(&squares).filter(|(_, one)| acts(one));
        Residual {
            rms: (sum / count as f64).sqrt(),
            acts_in: acting.map(|(run, _)| run.name.clone()).collect(),
        }
    }

    /// The noise, and what each effect makes of it. A single effect of a natural size sets the noise; where that would
    /// be out of the ordinary, and for each further effect, its amount is scaled.
    fn set_strength(
        &mut self,
        hidden: &Hidden,
        plain: &[Outputs],
        rng: &mut Pcg64,
    ) -> Option<(f64, Vec<Residual>)> {
        let (low, high) = match self.kind {
            LogKind::Torque => (0.005 * self.nominal.coulomb_nm, 0.03 * self.nominal.coulomb_nm),
            LogKind::Angle => (1e-5, 2e-4),
        };
        let mut noise = log_uniform(rng, 1.5 * low, 0.7 * high);
        // What can't be scaled sets the noise for the others.
        let mut order: Vec<usize> = (0..self.instances.len()).collect();
        order.sort_by_key(|index| self.instances[*index].is_scalable());
        let mut residuals: Vec<Option<Residual>> = order.iter().map(|_| None).collect();
        for (turn, &index) in order.iter().enumerate() {
            let mut residual = self.residual(plain, &self.measure(&[index])?);
            if turn == 0 {
                noise = (residual.rms / hidden.strength).clamp(low, high);
            }
            for _ in 0..ROUNDS {
                let ratio = hidden.strength * noise / residual.rms;
                if (ratio - 1.0).abs() < 0.03 || !self.instances[index].is_scalable() {
                    break;
                }
                self.instances[index].amount *= ratio.clamp(0.1, 10.0);
                residual = self.residual(plain, &self.measure(&[index])?);
            }
            if turn == 0 && !self.instances[index].is_scalable() {
                noise = (residual.rms / hidden.strength).min(high);
            }
            residuals[index] = Some(residual);
        }
        Some((noise, residuals.into_iter().flatten().collect()))
    }

    /// So fine that it hardly adds to the noise: through bristles and inertia in a torque log.
    fn encoder_step_rad(&self, noise: f64) -> f64 {
        let most_rad = match self.kind {
            LogKind::Torque => 0.06 * noise / self.nominal.stiffness_nm_per_rad,
            LogKind::Angle => noise,
        };
        (12..30).map(|bits| TAU / f64::from(1u32 << bits)).find(|step| *step <= most_rad).unwrap_or(1e-9)
    }

    fn truth(&self, seed: u64, hidden: &Hidden, noise: f64, step_rad: f64, residuals: &[Residual]) -> Truth {
        let effects: Vec<HiddenEffect> = self
            .instances
            .iter()
            .zip(residuals)
            .map(|(instance, residual)| {
                let mut valve = Valve::new(Contact::new(self.nominal));
                let applied = instance.apply(&mut valve, &self.runs);
                HiddenEffect {
                    id: instance.effect.name().to_owned(),
                    parameters: applied.parameters,
                    same_form: applied.same_form,
                    strength: residual.rms / noise,
                    acts_in: residual.acts_in.clone(),
                }
            })
            .collect();
        let twins_without = |missing: Option<Gap>| -> Vec<String> {
            twins(hidden.log)
                .into_iter()
                .filter(|(id, _, gap)| missing == Some(*gap) && hidden.effects.iter().any(|e| e == id))
                .flat_map(|(_, others, _)| others.iter().map(|other| (*other).to_owned()))
                .collect()
        };
        let twins = twins_without(hidden.without);
        let loud = hidden.log == LogKind::Angle && noise > QUIET_RAD && twins.is_empty();
        let near_twins = if loud { twins_without(Some(Gap::OneWay)) } else { Vec::new() };
        let verdict = match (hidden.effects.len(), hidden.is_outside(), twins.is_empty()) {
            (0, _, _) => "no-discrepancy",
            (1, true, _) => "unexplained",
            (_, true, _) => "partly-explained",
            (_, _, false) => "ambiguous",
            _ => "explained",
        };
        Truth {
            seed,
            log: hidden.log,
            effects,
            noise,
            encoder_step_rad: step_rad,
            twins,
            near_twins,
            verdict,
            imperfect: None,
        }
    }

    fn log(&self, seed: u64, outputs: &[Outputs], noise: f64, step_rad: f64, rng: &mut Pcg64) -> Log {
        let runs =
            self.runs.iter().zip(outputs).map(|(run, outputs)| self.run(run, outputs, noise, step_rad, rng));
        Log {
            title: format!("Rig campaign {seed}"),
            provenance: Some("hidden-effect-rig".to_owned()),
            runs: runs.collect(),
            ..Log::default()
        }
    }

    fn run(&self, plan: &RunPlan, outputs: &Outputs, noise: f64, step_rad: f64, rng: &mut Pcg64) -> Run {
        let mut normal = |deviation: f64| {
            deviation * {
                let n: f64 = StandardNormal.sample(rng);
                n
            }
        };
        let angle_noise_rad = match self.kind {
            LogKind::Torque => 0.3 * step_rad,
            LogKind::Angle => (noise * noise - step_rad * step_rad / 12.0).max(0.0).sqrt(),
        };
        let read = |angle: f64| if step_rad > 0.0 { (angle / step_rad).round() * step_rad } else { angle };
        let angle_rad = outputs.angle_rad.iter().map(|angle| read(angle + normal(angle_noise_rad))).collect();
        let torque = (self.kind == LogKind::Torque)
            .then(|| outputs.torque_nm.iter().map(|torque| torque + normal(noise)).collect());
        let command = (self.kind == LogKind::Angle)
            .then(|| (0..plan.times_s.len()).map(|index| plan.command_rad(index)).collect());
        let along = |value: &dyn Fn(f64) -> f64| plan.times_s.iter().map(|time| value(*time)).collect();
        Run {
            name: plan.name.clone(),
            kind: plan.kind.to_owned(),
            time_s: plan.times_s.iter().map(|time| plan.clock_s + time).collect(),
            angle_rad,
            angle_command_rad: command,
            torque_nm: torque,
            pressure_drop_pa: Some(along(&|time| 1e6 * plan.pressure_mpa.at(time))),
            oil_temperature_c: Some(along(&|time| plan.celsius.at(time))),
            ..Run::default()
        }
    }
}
