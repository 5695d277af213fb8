//! A small motor on a lead screw, recorded by its own drive: averaged speed and torque, no angle. By hand: 2.55 mN·m forwards and
//! 3.23 backwards with 0.021 and 0.026 mN·m·s/rad, a ripple of 0.2 to 0.3 once and twice a turn.

use super::record::{columns, files, placed, stem};
use super::{Friction, Place};
use anyhow::Result;
use log_data::{AngleZero, Log, Run};
use std::f64::consts::PI;

/// Of the motor's nominal torque, N·m for each per cent; both signs turned.
const NM_PER_PERCENT: f64 = -9.84e-5;
const RAD_PER_S_PER_RPM: f64 = -PI / 30.0;
/// Beyond this the drive's scope shows an outlier of its record, per cent.
const OUTLIER_PERCENT: f64 = 300.0;

fn runs(place: &Place, folder: &str) -> Result<Vec<Run>> {
    let mut runs = Vec::new();
    for path in files(&place.data.join("screw-drive").join(folder), "csv")? {
        let table = columns(&path, ';')?;
        let [time_ms, rpm, percent] = table.as_slice() else {
            anyhow::bail!("{}: expected three columns", path.display())
        };
        let speed: Vec<f64> = rpm.iter().map(|rpm| rpm * RAD_PER_S_PER_RPM).collect();
        let time_s: Vec<f64> = time_ms.iter().map(|time| 1e-3 * time).collect();
        let torque = |percent: &f64| {
            if percent.abs() > OUTLIER_PERCENT { f64::NAN } else { percent * NM_PER_PERCENT }
        };
        let run = Run {
            name: stem(&path),
            kind: folder.to_owned(),
            angle_rad: integrated(&time_s, &speed),
            time_s,
            torque_nm: Some(percent.iter().map(torque).collect()),
            ..Run::default()
        };
        let run = placed(without_gaps(run), &runs);
        runs.push(run);
    }
    Ok(runs)
}

/// Samples whose torque is missing are left out.
fn without_gaps(mut run: Run) -> Run {
    let torque = run.torque_nm.take().unwrap_or_default();
    let there: Vec<bool> = torque.iter().map(|value| value.is_finite()).collect();
    let kept = |values: &[f64]| {
        values.iter().zip(&there).filter(|(_, there)| **there).map(|(value, _)| *value).collect::<Vec<f64>>()
    };
    run.torque_nm = Some(kept(&torque));
    (run.time_s, run.angle_rad) = (kept(&run.time_s), kept(&run.angle_rad));
    run
}

fn integrated(time_s: &[f64], speed: &[f64]) -> Vec<f64> {
    let mut angle = 0.0;
    let mut last: Option<(f64, f64)> = None;
    let next = |(&time, &speed): (&f64, &f64)| {
        if let Some((before, was)) = last {
            angle += 0.5 * (speed + was) * (time - before);
        }
        last = Some((time, speed));
        angle
    };
    time_s.iter().zip(speed).map(next).collect()
}

pub fn run(place: &mut Place) -> Result<()> {
    let friction = Friction { inertia_kg_m2: 1e-7, coulomb_nm: 2.89e-3, viscous_nm_s_per_rad: 2.35e-5 };
    let model = place.model("screw.toml", &friction)?;
    for (folder, record) in
        [("steady_state", "screw drive, 32 steady runs"), ("start_stop", "screw drive, start and stop")]
    {
        // Each run's angle is integrated from where it begins.
        let log = Log {
            title: folder.to_owned(),
            runs: runs(place, folder)?,
            angle_zero: AngleZero::PerRun,
            ..Log::default()
        };
        let found = place.diagnosed_log(folder, log, &model)?;
        let passed = found.names_or_groups("torque-offset") || found.names_or_groups("direction-asymmetry");
        place.check(record, "torque-offset or direction-asymmetry, or the group", found.words(), passed);
        if folder == "start_stop" {
            continue;
        }
        let removed = found.removed();
        let text = removed.map_or("nothing".to_owned(), |part| format!("{:.0} %", 100.0 * part));
        place.check(record, "most of the error removed", text, removed.is_some_and(|part| part > 0.5));
        let ripple = |order: usize| found.order_nm(order).map(|nm| 1e3 * nm);
        let (one, two) = (ripple(1), ripple(2));
        let good = |nm: Option<f64>| nm.is_some_and(|nm| (0.1..0.45).contains(&nm));
        let reported = found.says(&["once per turn"]) && found.says(&["twice per turn"]);
        let text = match (one, two) {
            (None, None) => format!("no position-torque; once and twice a turn in the texts: {reported}"),
            _ => format!("{:.2} and {:.2} mN·m", one.unwrap_or(0.0), two.unwrap_or(0.0)),
        };
        let passed = (good(one) && good(two)) || reported;
        place.check(record, "ripple of orders 1 and 2, 0.2 to 0.3 mN·m", text, passed);
    }
    Ok(())
}
