//! Angle and friction torque at the cycles, how far two of them are apart, and our own integrator's.

use super::laws::Contact;
use super::motions::PERIOD_S;
use anyhow::Result;
use std::time::Instant;
use valve_model::{ValveInput, ValveParams, ValveState, step};

const REPEATS: usize = 60;

/// What an integrator gave, and what a cycle cost.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Angle at each cycle's end, rad.
    pub angles_rad: Vec<f64>,
    /// Friction torque there, N·m.
    pub torques_nm: Vec<f64>,
    /// Cost of a cycle, µs.
    pub us_per_cycle: f64,
}

/// How far a trace is from the reference.
#[derive(Debug, Clone, Copy)]
pub struct Error {
    /// Root of the mean square of the angle's error, rad.
    pub angle_rms_rad: f64,
    /// Errors of the torque in percent of the reference's largest: root of the mean square, what all but one in a
    /// thousand cycles stay below, and the largest.
    pub torque_rms_percent: f64,
    /// See above.
    pub torque_most_percent: f64,
    /// See above.
    pub torque_percent: f64,
}

impl Error {
    /// Of a trace against the reference.
    pub fn of(trace: &Trace, reference: &Trace) -> Self {
        let squares = trace.angles_rad.iter().zip(&reference.angles_rad).map(|(a, b)| (a - b) * (a - b));
        let peak_nm = reference.torques_nm.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
        let percent = |(a, b): (&f64, &f64)| 100.0 * (a - b).abs() / peak_nm;
        let mut gaps: Vec<f64> = trace.torques_nm.iter().zip(&reference.torques_nm).map(percent).collect();
        gaps.sort_by(f64::total_cmp);
        let count = reference.angles_rad.len() as f64;
        let most = gaps.get(gaps.len().saturating_sub(1) * 999 / 1000).copied();
        Self {
            angle_rms_rad: (squares.sum::<f64>() / count).sqrt(),
            torque_rms_percent: (gaps.iter().map(|gap| gap * gap).sum::<f64>() / count).sqrt(),
            torque_most_percent: most.unwrap_or(0.0),
            torque_percent: gaps.last().copied().unwrap_or(0.0),
        }
    }
}

/// The valve's own step, the best of several runs: what the code costs, not what the machine was doing.
///
/// # Errors
/// Where the contact is refused.
pub fn timed(contact: &Contact, commands: &[f64]) -> Result<Trace> {
    let valve = contact.valve()?;
    let first = run(&valve, commands);
    let more = (1..REPEATS).map(|_| run(&valve, commands));
    Ok(more.fold(first, |best, trace| if trace.us_per_cycle < best.us_per_cycle { trace } else { best }))
}

fn run(valve: &ValveParams, commands: &[f64]) -> Trace {
    let mut state = ValveState::at_rest(commands.first().copied().unwrap_or(0.0));
    let mut trace = Trace::default();
    trace.angles_rad.reserve(commands.len());
    trace.torques_nm.reserve(commands.len());
    let begin = Instant::now();
    for pair in commands.windows(2) {
        let [command_start_rad, command_end_rad] = *pair else { continue };
        let input = ValveInput {
            command_start_rad,
            command_end_rad,
            pressure_drop_pa: 0.0,
            oil_temperature_c: 40.0,
            current_ratio: 1.0,
        };
        let output = step(valve, &mut state, &input, PERIOD_S);
        trace.angles_rad.push(state.angle_rad);
        trace.torques_nm.push(output.friction_torque_nm);
    }
    trace.us_per_cycle = begin.elapsed().as_secs_f64() * 1e6 / commands.len().saturating_sub(1).max(1) as f64;
    trace
}
