//! `stepvalve tune`: the belief's friction from a short motion.

mod fit;
mod motion;
mod torque;

use crate::files;
use crate::pulse::Pulse;
use crate::say::say;
use anyhow::{Context, anyhow};
use config::{ModelComments, parse_model, parse_scenario, write_model};
use fit::{COUNT, Fit, KEYS, fit};
use motion::{identification, record};
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};
use valve_model::{FrictionParams, LuGreParams, Model};

/// What to tune and where to write it.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scenario: its truth stands for the valve, its belief is where the search begins
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// The model file to write
    #[arg(long, value_name = "BELIEF.toml")]
    out: PathBuf,
}

/// A parameter counts as known if its standard error is below this part of it.
const KNOWN: f64 = 0.2;

/// Moves the valve, fits, prints and writes.
///
/// # Errors
/// [`Failure::Input`] for a scenario without an encoder or a belief that is not LuGre; [`Failure::Failed`] where the file
/// can't be written.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let (scenario, truth, belief) = load(&arguments.scenario)?;
    let FrictionParams::LuGre(start) = belief.friction else {
        let law = belief.friction.law();
        return Err(Failure::Input(anyhow!(
            "the belief's law is \"{law}\", expected \"lugre\", which is what tune fits"
        )));
    };
    if !scenario.encoder.fitted {
        return Err(Failure::Input(anyhow!(
            "no encoder is fitted, and the command alone says nothing of friction"
        )));
    }
    let motion = identification(&scenario);
    let pulse = Pulse::new(|| "fitting the belief".to_owned());
    let seen = record(&motion, &truth, &belief).context("the identification run").map_err(Failure::Input)?;
    let found = fit(&belief, &start, &seen, motion.period_s()).context("the fit")?;
    drop(pulse);
    report(&found, &start, motion.duration_s);
    let tuned = Model { friction: FrictionParams::LuGre(found.friction), ..belief };
    whole_file::write(&arguments.out, write_model(&tuned, &comments(&found)))
        .with_context(|| files::name(&arguments.out))?;
    Ok(Outcome::Done)
}

fn load(path: &Path) -> Result<(config::Scenario, Model, Model), Failure> {
    let file = files::name(path);
    let scenario = parse_scenario(&files::read(path)?, &file).map_err(Failure::input)?;
    let beside = |name: &str| path.parent().unwrap_or(Path::new("")).join(name);
    let model = |name: &str| {
        let path = beside(name);
        parse_model(&files::read(&path)?, &files::name(&path)).map_err(Failure::input)
    };
    let (truth, belief) = (model(&scenario.truth)?, model(&scenario.belief)?);
    Ok((scenario, truth, belief))
}

fn values(params: &LuGreParams) -> [f64; COUNT] {
    [
        params.coulomb_torque_nm,
        params.static_torque_nm,
        params.stribeck_velocity_rad_per_s,
        params.bristle_stiffness_nm_per_rad,
        params.bristle_damping_nm_s_per_rad,
        params.viscous_nm_s_per_rad,
    ]
}

fn report(found: &Fit, start: &LuGreParams, duration_s: f64) {
    say(format_args!("identification run of {duration_s:.1} s, {} steps of the search", found.steps));
    say(format_args!("{:32} {:>12} {:>12} {:>12}", "", "before", "found", "std error"));
    let (before, after) = (values(start), values(&found.friction));
    for (((key, before), after), error) in KEYS.iter().zip(before).zip(after).zip(found.std_errors) {
        let doubt = if error < KNOWN * after { "" } else { "   not shown by this motion" };
        say(format_args!("{key:32} {before:>12.5} {after:>12.5} {error:>12.2e}{doubt}"));
    }
    let (before, after) = (found.rms_before_rad * 1e3, found.rms_after_rad * 1e3);
    say(format_args!("encoder minus model: {before:.4} mrad RMS before, {after:.4} after"));
}

fn comments(found: &Fit) -> ModelComments {
    let header = "Friction as `stepvalve tune` found it; behind each number its standard error.";
    KEYS.iter()
        .zip(found.std_errors)
        .fold(ModelComments::new().with_header(header), |comments, (key, error)| {
            comments.with_key("friction", key, format!("± {error:.1e}"))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENARIO: &str = include_str!("../../../../rt-config/scenarios/sine-1hz.toml");
    const RIG: &str = include_str!("../../../../rt-config/models/rig.toml");

    #[test]
    fn a_wrong_belief_is_put_right() {
        let scenario = parse_scenario(SCENARIO, "sine-1hz.toml").unwrap();
        let truth = parse_model(RIG, "rig.toml").unwrap();
        let FrictionParams::LuGre(right) = truth.friction else { panic!("{:?}", truth.friction) };
        for factors in [[1.3, 0.9, 1.5, 1.5, 1.0, 5.0], [0.6, 1.2, 0.6, 0.6, 1.5, 0.3]] {
            let [coulomb, static_level, velocity, stiffness, damping, viscous] = factors;
            let start = LuGreParams {
                coulomb_torque_nm: right.coulomb_torque_nm * coulomb,
                static_torque_nm: right.static_torque_nm * static_level,
                stribeck_velocity_rad_per_s: right.stribeck_velocity_rad_per_s * velocity,
                bristle_stiffness_nm_per_rad: right.bristle_stiffness_nm_per_rad * stiffness,
                bristle_damping_nm_s_per_rad: right.bristle_damping_nm_s_per_rad * damping,
                viscous_nm_s_per_rad: right.viscous_nm_s_per_rad * viscous,
                ..right
            };
            let belief = Model { friction: FrictionParams::LuGre(start), ..truth.clone() };
            let motion = identification(&scenario);
            assert!(motion.duration_s <= 60.0);
            let seen = record(&motion, &truth, &belief).unwrap();
            let found = fit(&belief, &start, &seen, motion.period_s()).unwrap();
            // What is left is the encoder's own: counts of 0.048 mrad and noise of 0.01.
            assert!(found.rms_after_rad < 2.5e-5, "{} rad", found.rms_after_rad);
            let pairs =
                values(&found.friction).into_iter().zip(values(&right)).zip(found.std_errors).zip(KEYS);
            for (((found, right), error), key) in pairs {
                let off = (found - right).abs();
                assert!(
                    off < 6.0 * error || off < 2e-3 * right,
                    "{key}: {found} ± {error}, {right} is right"
                );
            }
        }
    }
}
