//! Stick-slip: chaotic for any solver once it has begun, so angle and torque are compared up to the first slip, and
//! after it the slips' mean length and period.

use super::laws::{Contact, soft, table_1};
use super::motions::PERIOD_S;
use super::peer::Peer;
use super::trace::{Error, Trace, timed};
use crate::output::Sheet;
use anyhow::{Context, Result};
use serde_json::{Value, json};
use valve_model::FrictionParams;

/// Speeds of the command, rad/s, at which the contact sticks and slips, and for how long, s.
const DRIVES: [(f64, f64); 2] = [(0.02, 20.0), (0.03, 15.0)];

/// A slip is a cycle in which the spool moves by more than this many times what the command does.
const SLIP_FACTOR: f64 = 5.0;

/// The spool rings after a slip: another one begins only after so many cycles without.
const QUIET_CYCLES: usize = 50;

/// What the slips of a trace are like.
#[derive(Debug, Clone, Copy)]
struct Slips {
    first: usize,
    count: usize,
    length_rad: f64,
    period_s: f64,
}

/// Drives both contacts slowly.
///
/// # Errors
/// Where CVODE fails, or nothing slips.
pub fn run(peer: &Peer) -> Result<(Sheet, Value)> {
    let header = [
        "parameters",
        "command, rad/s",
        "angle to 1st slip, rad rms",
        "torque to 1st slip, %",
        "slips, CVODE",
        "length, rad",
        "ours, %",
        "period, s",
        "ours, %",
    ];
    let title = "Stick-slip of LuGre: up to the first slip point by point, after it the slips' mean length and period";
    let mut sheet = Sheet::new("integrator-slips", title, &header);
    let mut data = Vec::new();
    for (name, params) in [("soft", soft()), ("Table 1", table_1())] {
        let contact = Contact { name, friction: FrictionParams::LuGre(params) };
        for (speed, duration_s) in DRIVES {
            let cycles = (duration_s / PERIOD_S) as u32;
            let commands: Vec<f64> = (0..=cycles).map(|k| speed * f64::from(k) * PERIOD_S).collect();
            let reference = peer.run("1e-11", &contact, &commands)?;
            let ours = timed(&contact, &commands)?;
            let (theirs, own) = (slips(&reference, speed), slips(&ours, speed));
            let (theirs, own) = (theirs.context("CVODE: no slip")?, own.context("valve-model: no slip")?);
            let before = theirs.first.min(own.first);
            let error = Error::of(&up_to(&ours, before), &up_to(&reference, before));
            let percent = |a: f64, b: f64| 100.0 * (a / b - 1.0);
            let (length, period) =
                (percent(own.length_rad, theirs.length_rad), percent(own.period_s, theirs.period_s));
            sheet.row([
                name.to_owned(),
                speed.to_string(),
                format!("{:.1e}", error.angle_rms_rad),
                format!("{:.4}", error.torque_percent),
                theirs.count.to_string(),
                format!("{:.5}", theirs.length_rad),
                format!("{length:+.3}"),
                format!("{:.4}", theirs.period_s),
                format!("{period:+.3}"),
            ]);
            data.push(json!({
                "parameters": name, "speed_rad_per_s": speed, "slips": theirs.count,
                "angle_rms_rad": error.angle_rms_rad, "torque_percent": error.torque_percent,
                "length_percent": length, "period_percent": period,
            }));
        }
    }
    Ok((sheet, Value::Array(data)))
}

fn up_to(trace: &Trace, end: usize) -> Trace {
    let head = |values: &[f64]| values.iter().take(end).copied().collect();
    Trace { angles_rad: head(&trace.angles_rad), torques_nm: head(&trace.torques_nm), us_per_cycle: 0.0 }
}

/// The slips of a trace; `None` for fewer than three.
fn slips(trace: &Trace, speed: f64) -> Option<Slips> {
    let threshold_rad = SLIP_FACTOR * speed * PERIOD_S;
    let (mut begins, mut lengths) = (Vec::new(), Vec::new());
    let mut quiet = QUIET_CYCLES;
    for (cycle, pair) in trace.angles_rad.windows(2).enumerate() {
        let way = pair.last()? - pair.first()?;
        if way.abs() <= threshold_rad {
            quiet += 1;
            continue;
        }
        if quiet >= QUIET_CYCLES {
            begins.push(cycle);
            lengths.push(0.0);
        }
        quiet = 0;
        *lengths.last_mut()? += way;
    }
    let (first, last) = (*begins.first()?, *begins.last()?);
    let count = begins.len();
    // The last one may be cut by the end.
    let whole = lengths.get(..count.checked_sub(1)?)?;
    (count >= 3).then(|| Slips {
        first,
        count,
        length_rad: whole.iter().sum::<f64>() / whole.len() as f64,
        period_s: (last - first) as f64 * PERIOD_S / (count - 1) as f64,
    })
}
