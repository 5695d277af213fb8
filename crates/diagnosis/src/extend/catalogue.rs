//! The catalogue of candidates: every effect that a log of this kind could show.

use crate::extend::candidate::{Candidate, Map, Parameter, Probe};
use crate::extend::suspected::{candidate_of, why_not_suspected};
use crate::extend::untestable::{SOFTEST, SOME_PRESSURE, Untestable, needs_pressure, rigid_enough, why_not};
use crate::log::facts::Facts;
use crate::suspect::Suspect;
use valve_model::{EffectId, Model};

/// Harmonics of a torque over the angle: the highest order, and the highest that is always tried. Orders between them are tried
/// if they stand out of a residual.
const POSITION_ORDERS: usize = 128;
const LOW_ORDERS: usize = 12;
const FLOW_ORDERS: usize = 6;
const FRICTION_ORDERS: usize = 6;
/// Initial damping of a coupling, in multiples of what prevents squeal; and the least value of that, N·m·s/rad.
const QUIET: f64 = 2.0;
const LEAST_DAMPING: f64 = 1e-3;
/// The candidates, and what is untestable. An effect may be both: at one constant pressure other than zero it is fitted
/// as a rival of its twin, but never accepted.
pub(crate) fn candidates(
    facts: &Facts,
    model: &Model,
    fixed: &[EffectId],
    suspects: &[Suspect],
) -> (Vec<Candidate>, Vec<Untestable>) {
    let (mut able, mut unable) = (Vec::new(), Vec::new());
    for &id in EffectId::ALL {
        if fixed.contains(&id) {
            unable.push(Untestable { id, reason: "it was said to be known exactly".to_owned() });
            continue;
        }
        if id.is_never_a_cause() {
            continue;
        }
        let reason = why_not(id, facts);
        let confounded =
            reason.is_some() && needs_pressure(id) && facts.greatest_pressure_mpa() > SOME_PRESSURE;
        if (reason.is_none() || confounded)
            && let Some(candidate) = candidate(id, facts)
        {
            able.push(candidate);
        }
        if let Some(reason) = reason {
            unable.push(Untestable { id, reason });
        }
    }
    for suspect in suspects {
        match why_not_suspected(suspect, facts) {
            Some(reason) => unable.push(Untestable { id: suspect.effect.id(), reason }),
            None => able.push(candidate_of(suspect, facts)),
        }
    }
    able.iter_mut().for_each(|candidate| begin_at(candidate, model));
    (able, unable)
}

/// Starts an effect that the model already has from its present parameters.
fn begin_at(candidate: &mut Candidate, model: &Model) {
    let Some(present) = model.effects.iter().find(|effect| effect.id() == candidate.id) else { return };
    let mut moved = Vec::new();
    for parameter in &mut candidate.parameters {
        let value = match parameter.slot {
            None => present.number(parameter.key.as_str()),
            Some(slot) => present.list(parameter.key.as_str()).get(slot).copied().unwrap_or(0.0),
        };
        let u = match parameter.map {
            Map::Plain => value,
            Map::Exp => value.max(f64::MIN_POSITIVE).ln(),
            Map::OnePlusExp => (value - 1.0).max(f64::MIN_POSITIVE).ln(),
            Map::Inverse => 1.0 / value,
        };
        moved.push(u - parameter.neutral);
        parameter.neutral = u;
    }
    if candidate.id == EffectId::EncoderEccentricity {
        let (amplitude, phase) = (present.number("amplitude_rad"), present.number("phase_rad"));
        for (parameter, value) in
            candidate.parameters.iter_mut().zip([amplitude * phase.cos(), amplitude * phase.sin()])
        {
            parameter.neutral = value;
        }
    }
    let neutral = candidate.neutral();
    for probe in candidate.probes.iter_mut().filter(|probe| !probe.jump) {
        probe.shape.clone_from(&neutral);
    }
}

fn parameter(key: &'static str, map: Map, neutral: f64, bounds: (f64, f64), step: f64) -> Parameter {
    Parameter { key: key.into(), slot: None, map, neutral, lower: bounds.0, upper: bounds.1, step }
}

fn simple(id: EffectId, amplitude: Parameter) -> Candidate {
    let probe = Probe { shape: vec![amplitude.neutral], columns: vec![(0, amplitude.step)], jump: false };
    Candidate {
        id,
        parameters: vec![amplitude],
        probes: vec![probe],
        free: vec![0],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

fn factor(id: EffectId, bounds: (f64, f64), step: f64) -> Candidate {
    simple(id, parameter("factor", Map::Plain, 1.0, bounds, step))
}

pub(crate) fn candidate(id: EffectId, facts: &Facts) -> Option<Candidate> {
    let wide = (0.02, 50.0);
    let travel = facts.travel_rad.max(1.0);
    let pressure = facts.greatest_pressure_mpa().max(SOME_PRESSURE);
    let made = match id {
        EffectId::CoulombLevel | EffectId::StribeckVelocity | EffectId::BristleStiffness => {
            factor(id, wide, 0.02)
        }
        EffectId::HoldingTorqueLevel => factor(id, (0.2, 5.0), 0.01),
        EffectId::StaticLevel => {
            let least = facts.static_nm.map_or(1.0, |most| facts.coulomb_nm / most);
            factor(id, (least, 50.0), 0.02)
        }
        EffectId::ViscousLevel => {
            let most = (facts.viscous * facts.fastest_rad_per_s).max(1e-12);
            factor(id, (0.0, 1e5), (0.01 * facts.coulomb_nm / most).clamp(0.02, 50.0))
        }
        EffectId::LoadInertia => factor(id, (1e-3, 500.0), 0.1),
        EffectId::TorqueGain => factor(id, wide, 0.02),
        EffectId::TorqueOffset => {
            simple(id, parameter("offset_nm", Map::Plain, 0.0, (-1e6, 1e6), 0.01 * facts.coulomb_nm))
        }
        EffectId::PressureTorque => {
            simple(id, parameter("gain", Map::Plain, 0.0, (-1e9, 1e9), 0.01 * facts.coulomb_nm / pressure))
        }
        EffectId::SensorDelay => late(facts),
        EffectId::FrictionLag => lag(facts),
        EffectId::TemperatureDependentViscosity => {
            simple(id, parameter("beta_per_k", Map::Plain, 0.0, (0.0, 0.3), 2e-3))
        }
        EffectId::TemperatureDependentFriction => {
            simple(id, parameter("beta_per_k", Map::Plain, 0.0, (-0.3, 0.3), 1e-3))
        }
        EffectId::PressureDependentFriction => {
            let mut made = simple(id, parameter("gain", Map::Plain, 0.0, (0.0, 1e6), 0.02 / pressure));
            made.parameters.push(parameter("exponent", Map::Plain, 1.0, (0.5, 1.5), 0.05));
            made.probes.iter_mut().for_each(|probe| probe.shape.push(1.0));
            made.optional.push(1);
            made
        }
        EffectId::DirectionAsymmetry => asymmetry(),
        EffectId::DwellStiction => growth(id, 0.05, facts),
        EffectId::HydraulicLock => growth(id, 0.05 / pressure, facts),
        EffectId::WearDrift => wear(travel),
        EffectId::PreslidingHysteresis => hysteresis(),
        EffectId::CouplingCompliance => compliance(facts),
        EffectId::Backlash => backlash(),
        EffectId::EncoderEccentricity => eccentricity(),
        EffectId::PositionTorque => {
            let mut made = series(id, POSITION_ORDERS, (0.01 * facts.coulomb_nm, UNBOUNDED));
            made.probes.truncate(LOW_ORDERS);
            made
        }
        EffectId::FlowTorque => series(id, FLOW_ORDERS, (0.01 * facts.coulomb_nm / pressure, UNBOUNDED)),
        // Friction varies about its mean, and must stay positive.
        EffectId::AngleDependentFriction => series(id, FRICTION_ORDERS, (0.02, 0.95)),
        EffectId::DetentTorque => series(id, 2, (0.01 * facts.motor.map_or(1.0, |motor| motor.0), UNBOUNDED)),
        EffectId::MicrostepError => series(id, 10, (2e-5, 0.1)),
        // Uncertain, and no cause: see extend::tolerance.
        EffectId::BristleDamping | EffectId::RotorInertia | EffectId::MotorDamping => return None,
        // Found by its jumps, not fitted: see log::lost_steps.
        EffectId::MissedSteps => return None,
        // A law of the user's own, which is not in the list.
        EffectId::Custom(_) => return None,
    };
    Some(made)
}

/// Coefficients without a bound.
const UNBOUNDED: f64 = 1e9;

/// A series over the angle, each coefficient with its step and its bound.
fn series(id: EffectId, orders: usize, (step, most): (f64, f64)) -> Candidate {
    let of = |slot: usize, key: &'static str| Parameter {
        key: key.into(),
        slot: Some(slot),
        map: Map::Plain,
        neutral: 0.0,
        lower: -most,
        upper: most,
        step,
    };
    let parameters: Vec<Parameter> =
        (0..orders).flat_map(|slot| [of(slot, "cos"), of(slot, "sin")]).collect();
    let probe = |order: usize| Probe {
        shape: vec![0.0; 2 * orders],
        columns: vec![(2 * order, step), (2 * order + 1, step)],
        jump: false,
    };
    let probes = (0..orders).map(probe).collect();
    Candidate { id, parameters, probes, free: Vec::new(), optional: Vec::new(), series: true, own: None }
}

/// Whether a candidate takes the high orders that stand out.
pub(crate) fn takes_orders(candidate: &Candidate) -> bool {
    candidate.id == EffectId::PositionTorque
}

/// Tries these orders of a torque over the angle beside the low ones; other candidates stay as they are.
pub(crate) fn look_for_orders(candidate: &mut Candidate, orders: &[usize]) {
    let step = candidate.parameters.first().map_or(0.0, |first| first.step);
    if !takes_orders(candidate) {
        return;
    }
    candidate.probes.truncate(LOW_ORDERS);
    let shape = candidate.neutral();
    for slot in orders.iter().filter(|order| **order > LOW_ORDERS).map(|order| order - 1) {
        let columns = vec![(2 * slot, step), (2 * slot + 1, step)];
        candidate.probes.push(Probe { shape: shape.clone(), columns, jump: false });
    }
}

/// The orders above the low ones that are tried in a torque over the angle: the first, and the end (exclusive). In an angle log
/// the range ends below the motor's number of teeth, where it has orders of its own.
pub(crate) fn high_orders(facts: &Facts) -> (usize, usize) {
    let teeth = facts.rotor().map(|(_, teeth)| teeth as usize);
    (LOW_ORDERS + 1, teeth.unwrap_or(POSITION_ORDERS + 1))
}

/// A late sensor: a pure delay, or the delay of a low-pass filter. The low-pass share is freed only if that cuts the held-out error.
fn late(facts: &Facts) -> Candidate {
    let delay = parameter("delay_s", Map::Plain, 0.0, (-0.2, 0.2), 0.5 * facts.step_s);
    let share = parameter("low_pass_share", Map::Plain, 0.0, (0.0, 1.0), 0.1);
    let probe =
        |share: f64| Probe { shape: vec![0.0, share], columns: vec![(0, 0.5 * facts.step_s)], jump: false };
    Candidate {
        id: EffectId::SensorDelay,
        parameters: vec![delay, share],
        probes: [0.0, 1.0].map(probe).to_vec(),
        free: vec![0],
        optional: vec![1],
        series: false,
        own: None,
    }
}

fn lag(facts: &Facts) -> Candidate {
    let lag = parameter("time_constant_s", Map::Plain, 0.0, (0.0, 2.0), 0.5 * facts.step_s);
    let share = parameter("second_stage_share", Map::Plain, 0.0, (0.0, 0.5), 0.05);
    let probe = |step: f64| Probe { shape: vec![0.0; 2], columns: vec![(0, step)], jump: false };
    let probes = [1e-3, 5e-3, 0.025, 0.1].map(probe).to_vec();
    Candidate {
        id: EffectId::FrictionLag,
        parameters: vec![lag, share],
        probes,
        free: vec![0],
        optional: vec![1],
        series: false,
        own: None,
    }
}

fn asymmetry() -> Candidate {
    let level = parameter("level", Map::Plain, 0.0, (-0.95, 0.95), 0.01);
    let viscous = parameter("viscous", Map::Plain, 0.0, (-0.95, 0.95), 0.02);
    let probe = |columns: Vec<(usize, f64)>| Probe { shape: vec![0.0; 2], columns, jump: false };
    let probes = vec![probe(vec![(0, 0.01)]), probe(vec![(1, 0.02)]), probe(vec![(0, 0.01), (1, 0.02)])];
    Candidate {
        id: EffectId::DirectionAsymmetry,
        parameters: vec![level, viscous],
        probes,
        free: vec![0, 1],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

fn growth(id: EffectId, step: f64, facts: &Facts) -> Candidate {
    let gain = parameter("gain", Map::Plain, 0.0, (0.0, 1e6), step);
    let longest = facts.longest_rest_s.max(0.1);
    let time = parameter(
        "time_constant_s",
        Map::Exp,
        longest.ln() - 1.0,
        ((1e-3f64).ln(), (30.0 * longest).ln()),
        0.05,
    );
    let exponent = parameter("exponent", Map::Plain, 1.0, (0.3, 2.0), 0.05);
    let probe = |part: f64| Probe {
        shape: vec![0.0, (part * longest).max(2e-3).ln(), 1.0],
        columns: vec![(0, step)],
        jump: false,
    };
    Candidate {
        id,
        parameters: vec![gain, time, exponent],
        probes: [1.0, 0.2, 0.04, 0.008].map(probe).to_vec(),
        free: vec![0, 1],
        optional: vec![2],
        series: false,
        own: None,
    }
}

fn wear(travel_rad: f64) -> Candidate {
    let gain = parameter("gain", Map::Plain, 0.0, (-0.95, 1e3), 0.02);
    let distance = parameter(
        "distance_rad",
        Map::Exp,
        travel_rad.ln(),
        ((0.01 * travel_rad).ln(), (10.0 * travel_rad).ln()),
        0.05,
    );
    let probe = |part: f64| Probe {
        shape: vec![0.0, (part * travel_rad).ln()],
        columns: vec![(0, 0.02)],
        jump: false,
    };
    Candidate {
        id: EffectId::WearDrift,
        parameters: vec![gain, distance],
        probes: [3.0, 0.5, 0.1].map(probe).to_vec(),
        free: vec![0, 1],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

fn hysteresis() -> Candidate {
    // Just below the model's upper bound, which exp(ln x) may exceed by rounding.
    let straight = 98f64.ln();
    let ratio = parameter("saturation_ratio", Map::OnePlusExp, straight, ((2e-3f64).ln(), straight), 0.1);
    let transition = parameter("transition_exponent", Map::Exp, 2f64.ln(), (0.0, 99f64.ln()), 0.1);
    let spacing = parameter("spacing_exponent", Map::Exp, 0.0, (0.1f64.ln(), 8f64.ln()), 0.1);
    let tail = parameter("tail_exponent", Map::Plain, 0.0, (0.0, 8.0), 0.1);
    let share = parameter("curve_share", Map::Plain, 1.0, (0.0, 1.0), 0.1);
    // From nearly a single spring to a sharp corner. The last number is 1 where the slip torques follow the Stribeck curve.
    let shapes = [
        (5.0, 1.3, 2.0, 0.0, 1.0),
        (2.0, 1.7, 2.5, 0.0, 1.0),
        (1.5, 2.0, 4.0, 0.0, 1.0),
        (1.3, 2.2, 2.5, 0.0, 1.0),
        (1.1, 5.0, 2.5, 0.0, 1.0),
        (2.0, 4.0, 1.0, 0.0, 1.0),
        (1.2, 10.0, 1.0, 0.0, 0.0),
        (1.3, 2.2, 2.5, 0.0, 0.0),
        (1.6, 2.5, 0.3, 1.0, 1.0),
        (1.3, 4.0, 1.0, 0.5, 1.0),
    ];
    let probe = |(ratio, exponent, spacing, tail, share): (f64, f64, f64, f64, f64)| Probe {
        shape: vec![(ratio - 1.0).ln(), exponent.ln(), spacing.ln(), tail, share],
        columns: vec![(0, 1.0)],
        jump: true,
    };
    Candidate {
        id: EffectId::PreslidingHysteresis,
        parameters: vec![ratio, transition, spacing, tail, share],
        probes: shapes.map(probe).to_vec(),
        free: vec![0, 1, 2, 3],
        optional: vec![4],
        series: false,
        own: None,
    }
}

/// A compliant coupling. Its damping is held at twice what keeps the spool from squealing.
fn compliance(facts: &Facts) -> Candidate {
    let usual = rigid_enough(facts);
    let compliance = parameter("stiffness_nm_per_rad", Map::Inverse, 0.0, (1e-12, 1.0), 0.02 * usual);
    let quiet = QUIET * facts.squeal.max(LEAST_DAMPING);
    let most = 1e3 * quiet;
    let damping =
        parameter("damping_nm_s_per_rad", Map::Exp, quiet.ln(), ((0.25 * quiet).ln(), most.ln()), 0.1);
    let probe =
        |part: f64| Probe { shape: vec![0.0, quiet.ln()], columns: vec![(0, part * usual)], jump: false };
    Candidate {
        id: EffectId::CouplingCompliance,
        parameters: vec![compliance, damping],
        probes: [0.05, SOFTEST].map(probe).to_vec(),
        free: vec![0],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

fn backlash() -> Candidate {
    let half_width = parameter("half_width_rad", Map::Plain, 0.0, (0.0, 0.5), 2e-5);
    let probe = |step: f64| Probe { shape: vec![0.0], columns: vec![(0, step)], jump: false };
    Candidate {
        id: EffectId::Backlash,
        parameters: vec![half_width],
        probes: [1e-4, 1e-3].map(probe).to_vec(),
        free: vec![0],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

/// Fitted as sine and cosine parts; amplitude and phase follow from them.
fn eccentricity() -> Candidate {
    let part = |key| parameter(key, Map::Plain, 0.0, (-0.5, 0.5), 2e-5);
    let probe = Probe { shape: vec![0.0; 2], columns: vec![(0, 2e-5), (1, 2e-5)], jump: false };
    Candidate {
        id: EffectId::EncoderEccentricity,
        parameters: vec![part("amplitude_rad"), part("phase_rad")],
        probes: vec![probe],
        free: vec![0, 1],
        optional: Vec::new(),
        series: false,
        own: None,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::log::kind::LogKind;
    use log_data::Channel;

    /// A fit may end at a bound, so the model must accept what it finds there.
    #[test]
    fn the_model_takes_every_number_up_to_its_bounds() {
        let model = fixtures::model(Vec::new());
        for channel in [Channel::Torque, Channel::Angle] {
            let facts = Facts::of_model(&model, LogKind::predicting(channel));
            for candidate in EffectId::ALL.iter().filter_map(|id| candidate(*id, &facts)) {
                for (number, parameter) in candidate.parameters.iter().enumerate() {
                    for bound in [parameter.lower, parameter.upper] {
                        let mut numbers = candidate.neutral();
                        *numbers.get_mut(number).unwrap() = bound;
                        let effect = candidate.effect(&model, &numbers);
                        assert!(effect.is_ok(), "{} {}: {effect:?}", candidate.id, parameter.key);
                    }
                }
            }
        }
    }
}
