//! The scenarios: the seven that are shipped, and ten that are generated.

use crate::Encoder;
use anyhow::{Context, Result};
use config::parse_model;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, value};
use valve_model::Model;

/// The shipped ones in which the valve follows; the paper's parameter sets can't turn.
const MOVING: [&str; 5] = ["step-sequence", "sine-1hz", "flow-steps", "rotation-200khz", "rotation-600khz"];
const STUCK: [&str; 2] = ["paper-initial", "paper-revised"];
const GENERATED: usize = 10;
/// The encoder's noise, rad.
const NOISE_RAD: f64 = 1e-5;

/// A scenario with the model that is believed.
pub(crate) struct Scenario {
    pub name: String,
    pub belief: Model,
    pub belief_toml: String,
    text: String,
}

fn rt_config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rt-config")
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| path.display().to_string())
}

/// Draws one; with `moving` none of those whose valve can't turn.
pub(crate) fn draw(moving: bool, rng: &mut Pcg64) -> Result<Scenario> {
    let shipped: Vec<&str> =
        if moving { MOVING.to_vec() } else { MOVING.iter().chain(&STUCK).copied().collect() };
    let index = rng.random_range(0..shipped.len() + GENERATED);
    let (name, text) = match shipped.get(index) {
        Some(name) => ((*name).to_owned(), read(&rt_config().join(format!("scenarios/{name}.toml")))?),
        None => {
            let number = index - shipped.len();
            (format!("generated-{number}"), generated(number)?)
        }
    };
    let document: DocumentMut = text.parse().with_context(|| name.clone())?;
    let model = document["truth"].as_str().context("a model")?.trim_start_matches("../").to_owned();
    let belief_toml = read(&rt_config().join(model))?;
    let belief = parse_model(&belief_toml, "belief.toml")?;
    Ok(Scenario { name, belief, belief_toml, text })
}

impl Scenario {
    /// Its text with the recording's own models, seed and encoder.
    pub fn text(&self, seed: u64, counts: Option<f64>) -> Result<(String, Encoder)> {
        let mut document: DocumentMut = self.text.parse()?;
        document["truth"] = value("truth.toml");
        document["belief"] = value("belief.toml");
        document["seed"] = value(i64::try_from(seed % 1_000_000_007)?);
        document["encoder"]["fitted"] = value(counts.is_some());
        let mut encoder = Encoder::default();
        if let Some(counts) = counts {
            document["encoder"]["counts_per_turn"] = value(counts as i64);
            document["encoder"]["noise"] = value(format!("{NOISE_RAD:e}rad"));
            encoder = Encoder { step_rad: TAU / counts, noise_rad: NOISE_RAD };
        }
        Ok((document.to_string(), encoder))
    }
}

/// Steps, sines, rotations and openings by number, under a pressure that changes where the number is odd.
fn generated(number: usize) -> Result<String> {
    let mut rng = Pcg64::seed_from_u64(0x6f77_6e00 + number as u64);
    let shipped = read(&rt_config().join("scenarios/sine-1hz.toml"))?;
    let mut document: DocumentMut = shipped.parse()?;
    document["name"] = value(format!("generated {number}"));
    document.remove("set_point");
    let duration_s = rng.random_range(4.0..7.0_f64);
    document["duration"] = value(format!("{duration_s:.1}s"));
    document["pressure_drop"] = value(format!("{:.1}MPa", rng.random_range(0.5..6.0_f64)));
    document["oil_temperature"] = value(format!("{:.0}degC", rng.random_range(30.0..50.0_f64)));
    if number % 2 == 1 {
        let mut points = toml_edit::Array::new();
        for k in 0..4 {
            let mut point = toml_edit::InlineTable::new();
            point.insert("time", format!("{:.1}s", 0.3 * duration_s * f64::from(k)).into());
            point.insert("value", format!("{:.1}MPa", rng.random_range(0.5..8.0_f64)).into());
            points.push(point);
        }
        document["pressure_drop"] = value(points);
    }
    let mut text = document.to_string();
    let mut at_s = 0.2;
    while at_s < duration_s - 0.5 {
        let _ = write!(text, "\n[[set_point]]\ntime = \"{at_s:.2}s\"\n");
        let line = match (number / 2) % 3 {
            0 => format!("angle = \"{:.2}deg\"", rng.random_range(0.0..45.0_f64)),
            1 => format!("opening = {:.3}", rng.random_range(0.05..1.0_f64)),
            _ => {
                let (amplitude, frequency) =
                    (rng.random_range(0.05..0.3_f64), rng.random_range(0.4..2.0_f64));
                at_s += 1.0;
                format!("sine = {{ amplitude = \"{amplitude:.3}rad\", frequency = \"{frequency:.2}Hz\" }}")
            }
        };
        let _ = writeln!(text, "{line}");
        at_s += rng.random_range(0.5..1.2_f64);
    }
    Ok(text)
}
