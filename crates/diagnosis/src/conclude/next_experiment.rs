//! What to measure next: the motion, pressure and temperature that would separate or show causes best.

use crate::log::facts::Facts;
use crate::outcome::{Ambiguity, Dependence, Judged, Verdict};
use valve_model::EffectId;

/// No rotary drive oscillates a load faster than this.
const MOST_DRIVEN_HZ: f64 = 500.0;

/// Encoder steps in a sine's full swing that resolve its shape.
const STEPS_OF_A_SWING: f64 = 20.0;

/// What is left.
pub(crate) struct Left<'a> {
    /// What it goes by, most first.
    pub by: &'a [Dependence],
    /// Whether laws without a name were fitted.
    pub beside_laws: bool,
}

/// The next experiment, in a sentence or two.
pub(crate) fn next_experiment(
    verdict: Verdict,
    ambiguous: &[Ambiguity],
    left: &Left<'_>,
    untestable: &[Judged],
    facts: &Facts,
) -> String {
    if let Some(group) = ambiguous.first() {
        let names: Vec<&str> = group.ids.iter().map(|id| id.name()).collect();
        return format!("To separate {}: {}.", names.join(" from "), separating(&group.ids, facts));
    }
    match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => {
            let open = match left.by.first() {
                Some(first) if first.on == "run" => "Something is left that differs from run to run: repeat the first runs after the last ones, and record what else may have changed (the oil's temperature, the transducer's zero)."
                    .to_owned(),
                Some(first) => format!(
                    "Something is left that depends on {}: repeat runs that differ in that alone, everything else (pressure, temperature, motion) kept.",
                    first.on
                ),
                None if left.beside_laws => "Beside the laws nothing is left that goes by what was recorded: see whether they hold in other motions and conditions."
                    .to_owned(),
                None => "Something is left: repeat a few runs as they were, to see what of it comes back."
                    .to_owned(),
            };
            match missing(untestable, facts) {
                Some(text) => format!("{open} Causes could not be tested for which {text}."),
                None => open,
            }
        }
        Verdict::Explained | Verdict::NoDiscrepancy | Verdict::Ambiguous => {
            match missing(untestable, facts) {
                Some(text) => {
                    format!("Nothing is open in these data. Not tested were causes for which {text}.")
                }
                None => "Nothing is open in these data.".to_owned(),
            }
        }
    }
}

/// A motion, or a condition, that separates effects. The first in this order of a group's is proposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Separating {
    Calibrate,
    RepeatFirstRuns,
    OtherPressure,
    SmallSinesAtTwoLevels,
    RingingLoad,
    ThreeFrequencies,
    FullTurns,
    SmallSinesAndStep,
    Everything,
}

impl Separating {
    /// The experiment that separates an effect from others.
    fn of(id: EffectId, facts: &Facts) -> Self {
        match id {
            EffectId::TorqueGain => Self::Calibrate,
            EffectId::WearDrift => Self::RepeatFirstRuns,
            EffectId::PressureDependentFriction
            | EffectId::PressureTorque
            | EffectId::HydraulicLock
            | EffectId::FlowTorque
                if !facts.pressure_varies() =>
            {
                Self::OtherPressure
            }
            EffectId::DirectionAsymmetry => Self::SmallSinesAtTwoLevels,
            EffectId::CouplingCompliance => Self::RingingLoad,
            EffectId::LoadInertia | EffectId::SensorDelay | EffectId::FrictionLag => Self::ThreeFrequencies,
            EffectId::EncoderEccentricity => Self::FullTurns,
            EffectId::Backlash | EffectId::HoldingTorqueLevel => Self::SmallSinesAndStep,
            EffectId::CoulombLevel
            | EffectId::StaticLevel
            | EffectId::ViscousLevel
            | EffectId::StribeckVelocity
            | EffectId::BristleStiffness
            | EffectId::BristleDamping
            | EffectId::RotorInertia
            | EffectId::MotorDamping
            | EffectId::PressureDependentFriction
            | EffectId::TemperatureDependentViscosity
            | EffectId::TemperatureDependentFriction
            | EffectId::AngleDependentFriction
            | EffectId::DwellStiction
            | EffectId::HydraulicLock
            | EffectId::PreslidingHysteresis
            | EffectId::FlowTorque
            | EffectId::PressureTorque
            | EffectId::PositionTorque
            | EffectId::DetentTorque
            | EffectId::MicrostepError
            | EffectId::MissedSteps
            | EffectId::TorqueOffset
            | EffectId::Custom(_) => Self::Everything,
        }
    }
}

/// The experiment that separates a group: that of one of its effects, else a general one.
fn separating(ids: &[EffectId], facts: &Facts) -> String {
    let experiments = ids.iter().map(|id| Separating::of(*id, facts));
    let presliding_rad =
        facts.stiffness.map_or(1e-3, |stiffness| facts.static_nm.unwrap_or(facts.coulomb_nm) / stiffness);
    match experiments.min().unwrap_or(Separating::Everything) {
        Separating::Calibrate => {
            "hang a known weight on a lever of known length, and see what the torque channel reads in parts of it; then diagnose with that as --fix torque-gain.factor=1 (or whatever it is)".to_owned()
        }
        Separating::RepeatFirstRuns => {
            "repeat the first runs after the last ones, at the same pressure and temperature".to_owned()
        }
        Separating::OtherPressure => {
            let other = if facts.greatest_pressure_mpa() > 1.0 {
                "the same runs at zero pressure drop"
            } else {
                "the same runs at zero and at 10 MPa of pressure drop"
            };
            let dwell = ids.contains(&EffectId::DwellStiction);
            let rests = if dwell { ", each with rests of 0.1 to 10 s before starts" } else { "" };
            format!("{other}{rests}, at the temperature of these")
        }
        Separating::SmallSinesAtTwoLevels => format!(
            "{} about one angle and slow reversals, at two levels of friction (two pressures or temperatures)",
            small_sines(0.5 * presliding_rad, facts.encoder_step_rad)
        ),
        Separating::RingingLoad => {
            let inertia = facts.load_inertia.unwrap_or(1e-4);
            let hertz = (facts.stiffness.unwrap_or(1e3) / inertia).sqrt() / std::f64::consts::TAU;
            if hertz > MOST_DRIVEN_HZ {
                return format!(
                    "the deflection under a torque at rest, by a second encoder on the load's side: load and stiffness ring at {hertz:.0} Hz, faster than a drive can swing them"
                );
            }
            format!(
                "a sweep of small sines up to about {hertz:.0} Hz, where load and stiffness ring, at one pressure and temperature"
            )
        }
        Separating::ThreeFrequencies => {
            "sines at three frequencies a factor of three apart (say 3, 10 and 30 Hz) about a constant speed, at one pressure and temperature".to_owned()
        }
        Separating::FullTurns => "full turns both ways at one slow speed, at two pressures".to_owned(),
        Separating::SmallSinesAndStep => format!(
            "{}, and a step that lets the motor ring",
            small_sines(presliding_rad, facts.encoder_step_rad)
        ),
        Separating::Everything => {
            "constant speeds both ways over the whole range, sines at three frequencies, and rests of 0.1 to 10 s, at two pressures and two temperatures".to_owned()
        }
    }
}

/// Sines within presliding and, if this log's encoder can't resolve them, the encoder that they need.
fn small_sines(size_rad: f64, step_rad: f64) -> String {
    let needed_rad = 2.0 * size_rad / STEPS_OF_A_SWING;
    let sines = format!("sines of ±{size_rad:.1e} rad (within presliding)");
    if step_rad <= needed_rad {
        return sines;
    }
    let counts = |step: f64| std::f64::consts::TAU / step;
    format!(
        "{sines}, which take an encoder of {:.1e} counts a turn or more (this log's has {:.1e})",
        counts(needed_rad),
        counts(step_rad)
    )
}

fn missing(untestable: &[Judged], facts: &Facts) -> Option<String> {
    let waits = |part: &str| untestable.iter().any(|of| of.reason.contains(part));
    let mut wanted = Vec::new();
    if waits("pressure_drop") {
        wanted.push(if facts.pressure_mpa.is_none() {
            "pressure_drop must be recorded"
        } else {
            "a second pressure is needed"
        });
    }
    if waits("oil_temperature") {
        wanted.push(if facts.temperature_c.is_none() {
            "oil_temperature must be recorded"
        } else {
            "temperatures more than 3 K apart are needed"
        });
    }
    (!wanted.is_empty()).then(|| wanted.join(" and "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_says_what_encoder_it_takes() {
        assert_eq!(small_sines(1e-3, 1e-4), "sines of ±1.0e-3 rad (within presliding)");
        assert_eq!(small_sines(1e-3, 0.0), "sines of ±1.0e-3 rad (within presliding)");
        let coarse = small_sines(1e-3, 1.6e-3);
        assert!(
            coarse.ends_with("an encoder of 6.3e4 counts a turn or more (this log's has 3.9e3)"),
            "{coarse}"
        );
    }
}
