//! What an ordinary regression makes of the same data: the residual on a library of terms, chosen stepwise.
//!
//! Forward by what a cause's terms explain on the runs that were not fitted on, at least 1 % of the noise and the
//! Bayesian criterion on an effective sample size; earlier ones are dropped when they no longer pay.

use super::frols;
use super::library::{self, CAUSES, Terms};
use super::normal::{ALIKE, Normal, columns};
use anyhow::{Context, Result};
use config::parse_model;
use hidden_effect_rig::Finding;
use log_data::Log;
use log_data::median;
use nalgebra::DVector;
use std::collections::{BTreeMap, BTreeSet};
use valve_model::{EffectId, FrictionParams, Model};

/// The least cut of the held-out RMS, in parts of the noise.
const FLOOR: f64 = 0.01;
/// Fewer runs than this are cut into pieces.
const FEW: usize = 4;
/// Most causes chosen.
const MOST: usize = 6;

/// Half of the runs to fit on, the others to choose on; and the other way round.
struct Halves([Normal; 2]);

/// What two kinds of regression find in a torque log: stepwise, and by orthogonal least squares. Numbers of the model come with
/// the factor that they are off by, so that tolerances count for them as for a diagnosis.
///
/// # Errors
/// A model that can't be read.
pub fn found(log: &Log, model_toml: &str) -> Result<[Finding; 2]> {
    let model = parse_model(model_toml, "model.toml")?;
    let runs = library::terms(log, &model).context("the regression needs torque and a LuGre model")?;
    let runs = if runs.len() < FEW { runs.into_iter().flat_map(pieces).collect() } else { runs };
    let all = Normal::of(&runs, |_| true);
    Ok([stepwise(&runs), frols::named(&all)].map(|named| Finding {
        verdict: if named.is_empty() { "no-discrepancy" } else { "explained" }.to_owned(),
        factors: factors(&all, &named, &model),
        named,
        ..Finding::default()
    }))
}

/// The factors of the model's numbers among some causes, to first order.
fn factors(all: &Normal, named: &BTreeSet<String>, model: &Model) -> BTreeMap<String, f64> {
    let causes: Vec<usize> = CAUSES
        .iter()
        .enumerate()
        .filter(|(_, (id, _))| named.contains(id.name()))
        .map(|(index, _)| index)
        .collect();
    if causes.is_empty() {
        return BTreeMap::new();
    }
    let columns = columns(&causes);
    let weights = all.solved(&columns).unwrap_or_else(|| DVector::zeros(columns.len()));
    let FrictionParams::LuGre(lugre) = model.friction else { return BTreeMap::new() };
    let excess = lugre.static_torque_nm / (lugre.static_torque_nm - lugre.coulomb_torque_nm).max(1e-9);
    let part = |id: EffectId| match id {
        EffectId::CoulombLevel
        | EffectId::TorqueGain
        | EffectId::StaticLevel
        | EffectId::BristleStiffness => Some(1.0),
        EffectId::ViscousLevel => Some(1.0 / lugre.viscous_nm_s_per_rad),
        EffectId::LoadInertia => model.load.map(|load| 1.0 / load.inertia_kg_m2),
        EffectId::StribeckVelocity => Some(excess / lugre.stribeck_exponent),
        EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::HoldingTorqueLevel
        | EffectId::TorqueOffset
        | EffectId::PressureDependentFriction
        | EffectId::TemperatureDependentViscosity
        | EffectId::TemperatureDependentFriction
        | EffectId::AngleDependentFriction
        | EffectId::DirectionAsymmetry
        | EffectId::DwellStiction
        | EffectId::HydraulicLock
        | EffectId::FrictionLag
        | EffectId::PreslidingHysteresis
        | EffectId::WearDrift
        | EffectId::FlowTorque
        | EffectId::PressureTorque
        | EffectId::PositionTorque
        | EffectId::CouplingCompliance
        | EffectId::DetentTorque
        | EffectId::MicrostepError
        | EffectId::Backlash
        | EffectId::MissedSteps
        | EffectId::SensorDelay
        | EffectId::EncoderEccentricity
        | EffectId::Custom(_) => None,
    };
    let mut place = 0;
    let mut factors = BTreeMap::new();
    for (id, terms) in causes.iter().filter_map(|cause| CAUSES.get(*cause)) {
        if let (Some(part), Some(weight)) = (part(*id), weights.get(place)) {
            factors.insert(id.name().to_owned(), 1.0 + part * weight);
        }
        place += terms;
    }
    factors
}

/// A run cut into pieces, where there are too few to hold some out.
fn pieces(mut run: Terms) -> Vec<Terms> {
    let length = run.rows.len().div_ceil(2 * FEW).max(1);
    let mut pieces = Vec::new();
    while !run.rows.is_empty() {
        let rest = run.rows.len().saturating_sub(length);
        pieces.push(Terms { residual: run.residual.split_off(rest), rows: run.rows.split_off(rest) });
    }
    pieces
}

fn stepwise(runs: &[Terms]) -> BTreeSet<String> {
    let halves = Halves([0, 1].map(|half| Normal::of(runs, |index| index % 2 == half)));
    let noise = noise(runs);
    let mut chosen: Vec<usize> = Vec::new();
    let mut score = halves.score(&chosen);
    while chosen.len() < MOST {
        let trials = (0..CAUSES.len()).filter(|cause| !chosen.contains(cause)).map(|cause| {
            let with: Vec<usize> = chosen.iter().copied().chain([cause]).collect();
            (cause, halves.score(&with))
        });
        let Some((best, found)) = trials.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if !pays(score, found, best, noise, &halves) {
            break;
        }
        chosen.push(best);
        score = found;
        while let Some(position) = idle(&chosen, score, noise, &halves) {
            chosen.remove(position);
            score = halves.score(&chosen);
        }
    }
    chosen.iter().filter_map(|cause| CAUSES.get(*cause)).map(|(id, _)| id.name().to_owned()).collect()
}

/// Whether a cause's terms are worth their number: held-out mean squares before and after.
fn pays(before: f64, after: f64, cause: usize, noise: f64, halves: &Halves) -> bool {
    let terms = CAUSES.get(cause).map_or(1, |(_, terms)| *terms) as f64;
    let samples = halves.0.iter().map(|half| half.count).sum::<f64>() / ALIKE;
    let criterion = samples * (before / after).ln() > terms * samples.ln();
    before.sqrt() - after.sqrt() >= FLOOR * noise && criterion
}

/// The place of a chosen cause, not the last, that no longer pays.
fn idle(chosen: &[usize], score: f64, noise: f64, halves: &Halves) -> Option<usize> {
    (0..chosen.len().saturating_sub(1)).find(|position| {
        let without: Vec<usize> = chosen
            .iter()
            .enumerate()
            .filter(|(other, _)| other != position)
            .map(|(_, cause)| *cause)
            .collect();
        let cause = chosen.get(*position).copied().unwrap_or(0);
        !pays(halves.score(&without), score, cause, noise, halves)
    })
}

/// The noise, from differences of neighbours.
fn noise(runs: &[Terms]) -> f64 {
    let pairs = runs.iter().flat_map(|run| run.residual.windows(2));
    let mut squares: Vec<f64> = pairs.map(|pair| pair.iter().fold(0.0, |a, b| b - a).powi(2)).collect();
    let Some(median) = median(&mut squares) else { return 0.0 };
    // The median of a squared normal number is 0.455 of its mean; a difference has twice the variance.
    (median / 0.455 / 2.0).sqrt()
}

impl Halves {
    /// Mean square on each half with what was fitted on the other.
    fn score(&self, causes: &[usize]) -> f64 {
        let [one, other] = &self.0;
        let columns = columns(causes);
        let square = one.held_out(other, &columns) + other.held_out(one, &columns);
        square / (one.count + other.count)
    }
}
