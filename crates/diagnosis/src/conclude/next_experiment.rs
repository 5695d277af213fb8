//! What to measure next: the motion, pressure and temperature that would separate or show causes best.

use crate::log::facts::Facts;
use crate::outcome::{Ambiguity, Dependence, Judged, Verdict};

/// A sentence or two.
pub(crate) fn next_experiment(
    verdict: Verdict,
    ambiguous: &[Ambiguity],
    left: &[Dependence],
    untestable: &[Judged],
    facts: &Facts,
) -> String {
    if let Some(group) = ambiguous.first() {
        return format!("To separate {}: {}.", group.ids.join(" from "), separating(&group.ids, facts));
    }
    match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => match left.first() {
            Some(first) => format!(
                "Something is left that depends on {}: repeat runs that differ in that alone, everything else (pressure, temperature, motion) kept.",
                first.on
            ),
            None => {
                "Something is left: repeat a few runs as they were, to see what of it comes back.".to_owned()
            }
        },
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

/// What tells a group apart: the pair's own experiment, else a general one.
fn separating(ids: &[String], facts: &Facts) -> String {
    let has = |id: &str| ids.iter().any(|other| other == id);
    let presliding_rad =
        facts.stiffness.map_or(1e-3, |stiffness| facts.static_nm.unwrap_or(facts.coulomb_nm) / stiffness);
    let pressure = facts.greatest_pressure_mpa();
    let other_pressure = if pressure > 1.0 {
        "the same runs at zero pressure drop".to_owned()
    } else {
        "the same runs at zero and at 10 MPa of pressure drop".to_owned()
    };
    let on_pressure = ["pressure-dependent-friction", "pressure-torque", "hydraulic-lock", "flow-torque"]
        .into_iter()
        .any(has);
    if has("wear-drift") {
        return "repeat the first runs after the last ones, at the same pressure and temperature".to_owned();
    }
    if on_pressure && !facts.pressure_varies() {
        let rests = if has("dwell-stiction") { ", each with rests of 0.1 to 10 s before starts" } else { "" };
        return format!("{other_pressure}{rests}, at the temperature of these");
    }
    if has("direction-asymmetry") {
        return format!(
            "sines of ±{:.1e} rad about one angle (within presliding) and slow reversals, at two levels of friction (two pressures or temperatures)",
            0.5 * presliding_rad
        );
    }
    if has("coupling-compliance") {
        let inertia = facts.load_inertia.unwrap_or(1e-4);
        let hertz = (facts.stiffness.unwrap_or(1e3) / inertia).sqrt() / std::f64::consts::TAU;
        return format!(
            "a sweep of small sines up to about {hertz:.0} Hz, where load and stiffness ring, at one pressure and temperature"
        );
    }
    if has("load-inertia") || has("sensor-delay") || has("friction-lag") {
        return "sines at three frequencies a factor of three apart (say 3, 10 and 30 Hz) about a constant speed, at one pressure and temperature".to_owned();
    }
    if has("encoder-eccentricity") {
        return "full turns both ways at one slow speed, at two pressures".to_owned();
    }
    if has("backlash") || has("holding-torque-level") {
        return format!(
            "sines of ±{presliding_rad:.1e} rad (within presliding), and a step that lets the motor ring"
        );
    }
    "constant speeds both ways over the whole range, sines at three frequencies, and rests of 0.1 to 10 s, at two pressures and two temperatures".to_owned()
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
