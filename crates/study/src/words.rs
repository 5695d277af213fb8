//! What was found, in the words of somebody who knows valves and no statistics.

use diagnosis::{Cause, Corrected, Diagnosis, Evidence, Found, ParameterFound, Parameters};
use log_data::Channel;
use valve_model::{EffectId, growth_reached};

/// What the models are called in legends and tables.
pub const GIVEN: &str = "model as given";

/// The model with what was found is called by what that is: causes, or corrections alone.
pub fn changed(found: &Found) -> &'static str {
    let has_more = !found.diagnosis.causes.is_empty() || !found.diagnosis.unnamed.is_empty();
    if has_more { "model extended" } else { "model corrected" }
}

/// Whether the model with what was found is another than the given one.
pub fn is_changed(found: &Found) -> bool {
    let Diagnosis { causes, unnamed, within_tolerance, .. } = &found.diagnosis;
    !causes.is_empty() || !unnamed.is_empty() || !within_tolerance.is_empty()
}

/// So many numbers at the bound of their tolerance say that it is too narrow.
const TOO_NARROW: usize = 3;

/// What to do where the tolerance holds back several numbers of the model.
pub fn first_guesses(diagnosis: &Diagnosis) -> Option<String> {
    let at_bound = diagnosis.within_tolerance.iter().filter(|of| of.at_bound).count();
    (at_bound >= TOO_NARROW).then(|| {
        format!(
            "{at_bound} numbers of the model are as far off as its tolerance lets them be. If they are first guesses, let them be off by \
             more: --tolerance 0.25 --fix torque-gain.factor=1 (the transducer taken as it reads)."
        )
    })
}

/// A number that is corrected within its tolerance.
pub fn corrected(number: &Corrected) -> String {
    let of = &number.found;
    let percent = |value: f64| format!("{:+.1}", 100.0 * (value - 1.0));
    let bound =
        ", as far as the tolerance goes: these data want more of it, or can't tell it from something else";
    if number.key == "offset_nm" {
        let bound = if number.at_bound { bound } else { "" };
        return format!("{} {} N·m{bound}", number.id.name(), short(of.value));
    }
    if number.at_bound {
        return format!("{} {} %{bound}", number.id.name(), percent(of.value));
    }
    let [from, to] = of.ci95;
    format!("{} {} % ({} to {} %)", number.id.name(), percent(of.value), percent(from), percent(to))
}

/// The unit of what is predicted, as it is written for people.
pub fn unit(channel: Channel) -> &'static str {
    if channel == Channel::Torque { "N·m" } else { "rad" }
}

/// Two or three digits that count.
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let magnitude = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    if (-3.0..4.0).contains(&magnitude) {
        let decimals = (2.0 - magnitude).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

/// Decimals of a number whose interval is narrow, at most.
const MOST_DECIMALS: f64 = 9.0;

/// A value and the ends of its interval, all with as many decimals as tell them apart.
pub fn with_interval(of: &ParameterFound) -> [String; 3] {
    let [from, to] = of.ci95;
    let numbers = [of.value, from, to];
    let usual = numbers.map(short);
    let told_apart = usual[0] != usual[1] && usual[0] != usual[2];
    let half = 0.5 * (to - from);
    if told_apart || !half.is_finite() || half <= 0.0 || usual.iter().any(|text| text.contains('e')) {
        return usual;
    }
    let decimals = (1.0 - half.log10().floor()).clamp(0.0, MOST_DECIMALS) as usize;
    numbers.map(|number| format!("{number:.decimals$}"))
}

/// "key = value unit (from to to), ..."
pub fn numbers(parameters: &Parameters) -> String {
    let number = |(key, of): (&String, &ParameterFound)| {
        let [value, from, to] = with_interval(of);
        format!("{key} = {value}{} ({from} to {to})", behind(of))
    };
    parameters.iter().map(number).collect::<Vec<_>>().join(", ")
}

/// Each parameter and how well it is known, a line each.
pub fn known(parameters: &Parameters) -> Vec<String> {
    let line = |(key, of): (&String, &ParameterFound)| {
        let [value, from, to] = with_interval(of);
        let error = short(of.std_error);
        format!("{key}: {value} ± {error}{}, 95 % between {from} and {to}", behind(of))
    };
    parameters.iter().map(line).collect()
}

/// A parameter's unit as it stands behind a number.
pub fn behind(of: &ParameterFound) -> String {
    if of.unit == "1" { String::new() } else { format!(" {}", of.unit) }
}

/// The names of effects as [`listed`].
pub fn names(ids: &[EffectId]) -> String {
    listed(&ids.iter().map(EffectId::name).collect::<Vec<_>>())
}

/// "a, b and c"
pub fn listed(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The words with their first letter as a capital one.
pub fn with_capital(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}

/// A cause in words, where it is told with all others: a factor on the static friction acts on top of that on both frictions.
pub(crate) fn sentence_beside(cause: &Cause, found: &Found) -> String {
    let factor = |of: &Cause| of.parameters.get("factor").map_or(1.0, |of| of.value);
    let both = found.diagnosis.causes.iter().find(|of| of.id == EffectId::CoulombLevel);
    let Some(both) = both.filter(|_| cause.id == EffectId::StaticLevel) else {
        return sentence(cause, found.channel);
    };
    let mut whole = cause.clone();
    if let Some(of) = whole.parameters.get_mut("factor") {
        of.value *= factor(both);
    }
    sentence(&whole, found.channel)
}

/// How far friction grows in the longest rest of the log, and when. The gain itself is what an endless rest would do, which a log of short rests does
/// not show.
fn growth_at_rest(cause: &Cause) -> (f64, String) {
    let value = |key: &str| cause.parameters.get(key).map(|of| of.value);
    let gain = value("gain").unwrap_or(f64::NAN);
    let rest = match cause.evidence.get("longest_rest_s") {
        Some(Evidence::Number(rest_s)) => Some(*rest_s),
        _ => None,
    };
    match value("time_constant_s").zip(rest) {
        Some((constant_s, rest_s)) => {
            let reached = growth_reached(rest_s / constant_s, value("exponent").unwrap_or(1.0));
            (gain * reached, format!("in the longest rest, of {} s", short(rest_s)))
        }
        None => (gain, "while it rests".to_owned()),
    }
}

/// By what part friction changes over the distance that the log travels, and over which in words: what it tends to is often far beyond.
fn change_by_distance(cause: &Cause) -> (f64, String) {
    let value = |key: &str| cause.parameters.get(key).map(|of| of.value);
    let gain = value("gain").unwrap_or(f64::NAN);
    match value("distance_rad").zip(cause.evidence.get("travelled_rad")) {
        Some((constant_rad, Evidence::Number(travelled_rad))) => (
            gain * growth_reached(travelled_rad / constant_rad, 1.0),
            format!("over the {} rad of this log", short(*travelled_rad)),
        ),
        _ => (gain, "in the end".to_owned()),
    }
}

/// A cause in words, in a log of which this channel is predicted.
pub fn sentence(cause: &Cause, predicted: Channel) -> String {
    let value = |key: &str| cause.parameters.get(key).map_or(f64::NAN, |of| of.value);
    let times = |than: &str| cause.parameters.get("factor").map_or(String::new(), |of| off(of, than));
    let size = largest(cause);
    match cause.id {
        EffectId::CoulombLevel
        | EffectId::StaticLevel
        | EffectId::ViscousLevel
        | EffectId::StribeckVelocity
        | EffectId::BristleStiffness
        | EffectId::BristleDamping
        | EffectId::RotorInertia
        | EffectId::MotorDamping
        | EffectId::LoadInertia
        | EffectId::HoldingTorqueLevel => {
            let number = cause.id.spec().folded_into.map_or(cause.id.name(), |number| number.label);
            format!("{} is {}", with_capital(number), times("the model's"))
        }
        EffectId::TorqueGain => format!("The torque channel reads {}", times("the true torque")),
        EffectId::PressureDependentFriction => {
            let gain = short(100.0 * value("gain"));
            match cause.parameters.get("exponent").filter(|of| of.value != 1.0) {
                None => format!("The rig's friction rises {gain} % per MPa of pressure drop"),
                Some(of) => format!(
                    "The rig's friction rises {gain} % at a pressure drop of 1 MPa, and with its power {}",
                    short(of.value)
                ),
            }
        }
        EffectId::TemperatureDependentViscosity => {
            format!("The rig's viscous friction falls {} % per kelvin", short(100.0 * value("beta_per_k")))
        }
        EffectId::TemperatureDependentFriction => {
            format!("The rig's friction changes by {} % per kelvin", short(100.0 * value("beta_per_k")))
        }
        EffectId::AngleDependentFriction => {
            format!("The rig's friction varies with the angle by up to {} %", short(100.0 * size))
        }
        EffectId::DirectionAsymmetry => direction(cause),
        EffectId::DwellStiction => {
            let (growth, rest) = growth_at_rest(cause);
            format!("The rig's static friction grows by {} % {rest}", short(100.0 * growth))
        }
        EffectId::HydraulicLock => {
            let (growth, rest) = growth_at_rest(cause);
            format!("The rig's friction grows under pressure by {} % per MPa {rest}", short(100.0 * growth))
        }
        EffectId::FrictionLag => {
            format!("The rig's friction follows the speed {} ms late", short(1e3 * value("time_constant_s")))
        }
        EffectId::PreslidingHysteresis => "Before it slides the rig has hysteresis with a memory".to_owned(),
        EffectId::WearDrift => {
            let (change, over) = change_by_distance(cause);
            format!(
                "The rig's friction changes with the distance travelled, by {} % {over}",
                short(100.0 * change)
            )
        }
        EffectId::FlowTorque => {
            format!("The flow turns the rig's spool with up to {} N·m per MPa", short(size))
        }
        EffectId::PressureTorque => {
            format!("Pressure loads the rig's spool with {} N·m per MPa", short(value("gain")))
        }
        EffectId::PositionTorque => {
            format!("A torque that depends on the angle loads the rig's spool, up to {} N·m", short(size))
        }
        EffectId::CouplingCompliance => {
            format!("The rig's coupling gives, {} N·m per rad", short(value("stiffness_nm_per_rad")))
        }
        EffectId::DetentTorque => format!("The motor has a detent torque of {} N·m", short(size)),
        EffectId::MicrostepError => format!("The motor's micro-steps are off by up to {} rad", short(size)),
        EffectId::Backlash => {
            format!("There is a play of ± {} rad between rotor and encoder", short(value("half_width_rad")))
        }
        EffectId::MissedSteps => "The rotor lost steps".to_owned(),
        EffectId::TorqueOffset => {
            let offset_nm = value("offset_nm");
            let way = if offset_nm < 0.0 { "little" } else { "much" };
            format!("The torque channel reads {} N·m too {way} throughout", short(offset_nm.abs()))
        }
        EffectId::SensorDelay => {
            let delay_s = value("delay_s");
            let way = if delay_s < 0.0 { "early" } else { "late" };
            let (what, beside) = match predicted {
                Channel::Torque => ("torque", "the angle"),
                _ => ("angle", "the command"),
            };
            format!("The {what} channel is {} ms {way} beside {beside}", short(1e3 * delay_s.abs()))
        }
        EffectId::EncoderEccentricity => {
            format!("The encoder is eccentric by {} rad", short(value("amplitude_rad")))
        }
        EffectId::Custom(name) => format!("The rig follows {name}, with {}", numbers(&cause.parameters)),
    }
}

/// By how much a factor is off 1. Where a search took it to its bound, how far it goes is not known.
fn off(factor: &ParameterFound, than: &str) -> String {
    let (value, [from, to]) = (factor.value, factor.ci95);
    let side = if value < 1.0 { "below" } else { "above" };
    if from < to && (value <= from || value >= to) {
        return format!(
            "far {side} {than}; how far, these data can't say ({} to {} times it)",
            short(from),
            short(to)
        );
    }
    format!("{} % {side} {than}", short(100.0 * (value - 1.0).abs()))
}

fn direction(cause: &Cause) -> String {
    // Of a part that may as well be none there is nothing to say, if there is another.
    let clear = |of: &ParameterFound| of.ci95[0] > 0.0 || of.ci95[1] < 0.0;
    let any_clear = cause.parameters.values().any(clear);
    let told = |of: &&ParameterFound| clear(of) || !any_clear;
    let of = |key: &str| cause.parameters.get(key).filter(told).map(|of| sided(of.value));
    match (of("level"), of("viscous")) {
        (Some(level), Some(viscous)) => {
            format!("The rig's friction is {level}; its viscous part is {viscous}")
        }
        (Some(level), None) => format!("The rig's friction is {level}"),
        (None, Some(viscous)) => format!("The rig's viscous friction is {viscous}"),
        (None, None) => "The rig's friction differs by direction".to_owned(),
    }
}

/// A part that is added in one direction and taken off in the other.
fn sided(part: f64) -> String {
    let (first, second) = if part < 0.0 { ("lower", "higher") } else { ("higher", "lower") };
    let percent = short(100.0 * part.abs());
    format!("{percent} % {first} in the positive direction and as much {second} in the negative")
}

/// Places that a turn of a series is looked at in, for each period of its highest order.
const A_PERIOD: f64 = 64.0;

/// The largest value of a series over a turn, without regard to its sign.
fn largest(cause: &Cause) -> f64 {
    let part = |(key, of): (&String, &ParameterFound)| {
        let (function, order) = key.strip_suffix(']')?.split_once('[')?;
        let order: f64 = order.parse().ok()?;
        match function {
            "cos" => Some((order, of.value, 0.0)),
            "sin" => Some((order, 0.0, of.value)),
            _ => None,
        }
    };
    let parts: Vec<(f64, f64, f64)> = cause.parameters.iter().filter_map(part).collect();
    let places = A_PERIOD * parts.iter().map(|of| of.0).fold(1.0, f64::max);
    let at = |place: usize| -> f64 {
        let angle = std::f64::consts::TAU * place as f64 / places;
        parts.iter().map(|(order, cos, sin)| cos * (order * angle).cos() + sin * (order * angle).sin()).sum()
    };
    (0..places as usize).map(|place| at(place).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(value: f64, from: f64, to: f64) -> ParameterFound {
        ParameterFound { value, std_error: 0.0, ci95: [from, to], unit: "1".to_owned() }
    }

    #[test]
    fn a_growth_is_told_by_what_the_longest_rest_showed() {
        let number = |key: &str, value| (key.to_owned(), of(value, value, value));
        let mut cause = Cause {
            id: EffectId::DwellStiction,
            parameters: [number("gain", 13.3), number("time_constant_s", 236.0), number("exponent", 0.65)]
                .into(),
            evidence: [("longest_rest_s".to_owned(), Evidence::Number(7.87))].into(),
            rms_gain: 0.2,
        };
        let said = |cause: &Cause| sentence(cause, Channel::Torque);
        assert_eq!(said(&cause), "The rig's static friction grows by 138 % in the longest rest, of 7.87 s");
        cause.id = EffectId::HydraulicLock;
        let lock = "The rig's friction grows under pressure by 138 % per MPa in the longest rest, of 7.87 s";
        assert_eq!(said(&cause), lock);
        cause.evidence.clear();
        assert_eq!(said(&cause), "The rig's friction grows under pressure by 1330 % per MPa while it rests");
    }

    #[test]
    fn a_change_by_distance_is_told_by_what_the_log_travelled() {
        let number = |key: &str, value| (key.to_owned(), of(value, value, value));
        let cause = Cause {
            id: EffectId::WearDrift,
            parameters: [number("gain", 0.956), number("distance_rad", 1000.0)].into(),
            evidence: [("travelled_rad".to_owned(), Evidence::Number(100.0))].into(),
            rms_gain: 0.2,
        };
        let said = sentence(&cause, Channel::Torque);
        assert_eq!(
            said,
            "The rig's friction changes with the distance travelled, by 9.10 % over the 100 rad of this log"
        );
    }

    #[test]
    fn a_series_is_as_large_as_its_largest_value() {
        let cause = |parts: &[(&str, f64)]| Cause {
            id: EffectId::PositionTorque,
            parameters: parts
                .iter()
                .map(|(key, value)| ((*key).to_owned(), of(*value, *value, *value)))
                .collect(),
            evidence: [].into(),
            rms_gain: 0.2,
        };
        for (parts, expected) in [
            (&[("cos[3]", 0.3), ("sin[3]", 0.4)][..], 0.5),
            // In phase at rest: the root of the sum of squares would say 0.0141.
            (&[("cos[11]", 0.01), ("cos[22]", -0.01)], 0.02),
            (&[("cos[1]", 0.01), ("cos[2]", 0.01)], 0.02),
            (&[], 0.0),
        ] {
            assert!(
                (largest(&cause(parts)) - expected).abs() < 0.01 * expected.max(1e-9),
                "{parts:?}: {}",
                largest(&cause(parts))
            );
        }
    }

    #[test]
    fn a_factor_at_its_bound_is_no_finding_of_a_size() {
        for ((value, from, to), wanted) in [
            ((1.2, 1.1, 1.3), "20.0 % above the model's"),
            ((0.5, 0.4, 0.6), "50.0 % below the model's"),
            (
                (50.0, 0.0, 50.0),
                "far above the model's; how far, these data can't say (0.00 to 50.0 times it)",
            ),
            (
                (0.02, 0.02, 0.4),
                "far below the model's; how far, these data can't say (0.0200 to 0.400 times it)",
            ),
            // Known exactly, as a noise-free log lets it.
            ((1.2, 1.2, 1.2), "20.0 % above the model's"),
        ] {
            assert_eq!(off(&of(value, from, to), "the model's"), wanted);
        }
    }

    #[test]
    fn a_narrow_interval_is_told_from_its_value() {
        let said = |value, from, to| with_interval(&of(value, from, to)).join(" ");
        for ((value, from, to), wanted) in [
            ((1.317, 1.2, 1.43), "1.32 1.20 1.43"),
            ((1.317, 1.315, 1.319), "1.3170 1.3150 1.3190"),
            ((15.02, 15.0, 15.03), "15.020 15.000 15.030"),
            ((2.0, 2.0, 2.0), "2.00 2.00 2.00"),
            ((1.2e-5, 1.1e-5, 1.3e-5), "1.20e-5 1.10e-5 1.30e-5"),
            ((1.0, f64::NAN, f64::NAN), "1.00 unknown unknown"),
        ] {
            assert_eq!(said(value, from, to), wanted);
        }
    }
}
