//! `bench margins`: how far the loop of encoder, observer and motor is from instability, and its frequency response.

use crate::output::{Results, Sheet};
use anyhow::{Context, Result, anyhow};
use closed_loop::{Level, wire_level};
use config::{Scenario, parse_model, parse_scenario};
use serde_json::json;
use step_control::{Margins, Params, ShaftFactors};
use valve_model::Model;

/// Cycles, ms.
const PERIODS_MS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 10.0];

/// Inertia over the believed one.
const INERTIAS: [f64; 8] = [0.3, 0.4, 0.5, 0.7, 1.4, 2.0, 2.5, 3.0];

/// Load angles at which the motor's spring is weaker, degrees.
const LOAD_ANGLES_DEG: [f64; 3] = [30.0, 60.0, 70.0];

/// Frequencies of the response, Hz.
const FREQUENCIES_HZ: [f64; 16] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 115.0, 123.0, 131.0, 150.0, 200.0, 300.0, 450.0];

/// Computes the tables.
///
/// # Errors
/// Scenario or model that can't be read or wired.
pub fn run(quick: bool) -> Result<Results> {
    let read = |path: &str| std::fs::read_to_string(path).with_context(|| path.to_owned());
    let (scenario_path, model_path) = ("rt-config/scenarios/sine-1hz.toml", "rt-config/models/rig.toml");
    let scenario =
        parse_scenario(&read(scenario_path)?, scenario_path).map_err(|errors| anyhow!("{errors}"))?;
    let belief = parse_model(&read(model_path)?, model_path).map_err(|errors| anyhow!("{errors}"))?;
    Ok(Results {
        command: "margins",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets: vec![margins(&scenario, &belief)?, responses(&scenario, &belief)?],
        data: json!({}),
    })
}

fn params(shipped: &Scenario, belief: &Model, period_ms: f64, delay: u64) -> Result<Params> {
    let mut scenario = Scenario { period_ns: (period_ms * 1e6) as u64, ..shipped.clone() };
    scenario.loop_delay_cycles = delay;
    Ok(wire_level(&scenario, belief, belief, Level::OBSERVED)?.controller.params)
}

fn margins(scenario: &Scenario, belief: &Model) -> Result<Sheet> {
    let mut sheet = Sheet::new(
        "margins",
        "Margins of the loop by cycle and dead time, and the shafts with which it is stable",
        &[
            "cycle",
            "dead time",
            "gain margin",
            "phase margin",
            "delay margin",
            "crossover",
            "stable with inertia ×",
            "stable at a load angle of",
        ],
    );
    for period_ms in PERIODS_MS {
        for delay in [1, 2] {
            let params = params(scenario, belief, period_ms, delay)?;
            let found = params.margins(ShaftFactors::BELIEVED).context("margins")?;
            sheet.row(row(&params, &found));
        }
    }
    Ok(sheet)
}

fn row(params: &Params, found: &Margins) -> Vec<String> {
    let stable = |factors| params.loop_is_stable(factors).unwrap_or(false);
    let inertias = INERTIAS
        .iter()
        .filter(|inertia| stable(ShaftFactors { inertia: **inertia, ..ShaftFactors::BELIEVED }))
        .map(f64::to_string)
        .collect::<Vec<_>>();
    let angles = LOAD_ANGLES_DEG
        .iter()
        .filter(|angle| {
            stable(ShaftFactors { stiffness: angle.to_radians().cos(), ..ShaftFactors::BELIEVED })
        })
        .map(|angle| format!("{angle}°"))
        .collect::<Vec<_>>();
    vec![
        format!("{} ms", params.period_s * 1e3),
        format!("{} cycles", params.loop_delay_cycles),
        format!("{:.1} dB", 20.0 * found.gain.log10()),
        format!("{:.0}°", found.phase_rad.to_degrees()),
        format!("{:.2} ms", found.delay_s * 1e3),
        format!("{:.1} Hz", found.crossover_hz),
        inertias.join(", "),
        angles.join(", "),
    ]
}

fn responses(scenario: &Scenario, belief: &Model) -> Result<Sheet> {
    let mut sheet = Sheet::new(
        "loop-response",
        "Gain and phase of the loop transfer, belief right",
        &["Hz", "0.25 ms", "1 ms", "1 ms, 2 cycles", "4 ms"],
    );
    let loops = [(0.25, 1), (1.0, 1), (1.0, 2), (4.0, 1)]
        .into_iter()
        .map(|(period_ms, delay)| params(scenario, belief, period_ms, delay))
        .collect::<Result<Vec<_>>>()?;
    for frequency_hz in FREQUENCIES_HZ {
        let cells = loops.iter().map(|params| {
            if frequency_hz > 0.5 / params.period_s {
                return "-".to_owned();
            }
            params
                .loop_response(ShaftFactors::BELIEVED, frequency_hz)
                .map_or("-".to_owned(), |(gain, phase)| {
                    format!("{:.1} dB, {:.0}°", 20.0 * gain.log10(), phase.to_degrees())
                })
        });
        sheet.row([frequency_hz.to_string()].into_iter().chain(cells));
    }
    Ok(sheet)
}
