//! Slow turns of a brushless motor without a load. By hand: cogging of 7 per turn with about 6 mN·m, then 28, 14 and 36 per turn
//! with a half to a third of it; the inertia that its owner states is a hundred times too large.

use super::record::{array, files, placed, stem};
use super::{Friction, Place};
use anyhow::Result;
use log_data::Run;
use std::f64::consts::TAU;

const COUNTS: f64 = 8192.0;
/// By its owner: 3 mN·m at 0.4 A.
const NM_PER_A: f64 = 3e-3 / 0.4;
/// As stated, and as the records have it, kg·m².
const STATED: f64 = 2.5e-4;
const TRUE: f64 = 2e-6;

fn runs(place: &Place) -> Result<Vec<Run>> {
    let mut runs = Vec::new();
    for path in files(&place.data.join("motor-cogging"), "mat")? {
        let data = array(&path, "data")?;
        let signal = |row: usize, factor: f64| -> Vec<f64> {
            data.iter().skip(row).step_by(3).map(|value| factor * value).collect()
        };
        let run = Run {
            name: stem(&path),
            kind: "slow-turn".to_owned(),
            time_s: signal(0, 1.0),
            angle_rad: signal(1, TAU / COUNTS),
            torque_nm: Some(signal(2, NM_PER_A)),
            ..Run::default()
        };
        let run = placed(run, &runs);
        runs.push(run);
    }
    Ok(runs)
}

pub fn run(place: &mut Place) -> Result<()> {
    for (inertia_kg_m2, record) in
        [(STATED, "motor cogging, inertia as stated"), (TRUE, "motor cogging, inertia as recorded")]
    {
        let friction = Friction { inertia_kg_m2, coulomb_nm: 1e-3, viscous_nm_s_per_rad: 0.0 };
        let model = place.model("motor.toml", &friction)?;
        let found = place.diagnosed(&format!("cogging-{:.0}", inertia_kg_m2 * 1e6), runs(place)?, &model)?;
        let milli = |order: usize| found.order_nm(order).map_or(0.0, |nm| 1e3 * nm);
        let seven = milli(7);
        let text = format!("{}; order 7: {seven:.2} mN·m", found.words());
        place.check(record, "order 7 with 5.5 to 6.7 mN·m", text, (5.5..=6.7).contains(&seven));
        let others = [28, 14, 36].map(milli);
        let [a, b, c] = others;
        let good = others.iter().filter(|nm| (1.2..4.0).contains(*nm)).count();
        let text = format!("{a:.2}, {b:.2} and {c:.2} mN·m");
        place.check(record, "two of orders 28, 14 and 36, a half to a third of it", text, good >= 2);
        if inertia_kg_m2 == STATED {
            let factor = found.number("load-inertia", "factor");
            let text = factor.map_or("none".to_owned(), |factor| format!("{factor:.4}"));
            let right = factor.is_some_and(|factor| (0.3..3.0).contains(&(factor * STATED / TRUE)));
            place.check(record, "load-inertia × 0.008", text, right);
        }
    }
    Ok(())
}
