//! An O-ring pulled back and forth under four pressures, three times: the piston's area in the torque, friction that rises with
//! pressure and comes back to its first value, so that it is no wear.

use super::record::{columns, files, placed, stem};
use super::{Friction, Place};
use anyhow::{Context, Result};
use log_data::Run;

const RADIUS_M: f64 = 0.0125;
/// The one level that the model has for all pressures.
const COULOMB_NM: f64 = 0.06;

fn runs(place: &Place, repetition: &str) -> Result<Vec<Run>> {
    let mut runs = Vec::new();
    for path in files(&place.data.join("seal-friction"), "csv")? {
        if !stem(&path).starts_with(repetition) {
            continue;
        }
        let table = columns(&path, '\t')?;
        let column = |index: usize, factor: f64| -> Result<Vec<f64>> {
            let values = table.get(index).with_context(|| path.display().to_string())?;
            Ok(values.iter().map(|value| factor * value).collect())
        };
        let run = Run {
            name: stem(&path),
            kind: "constant-velocity".to_owned(),
            time_s: column(0, 1e-3)?,
            angle_rad: column(4, 1e-3 / RADIUS_M)?,
            pressure_drop_pa: Some(column(5, 1e5)?),
            torque_nm: Some(column(6, RADIUS_M)?),
            ..Run::default()
        };
        let run = placed(run, &runs);
        runs.push(run);
    }
    Ok(runs)
}

pub fn run(place: &mut Place) -> Result<()> {
    let friction = Friction { inertia_kg_m2: 0.0, coulomb_nm: COULOMB_NM, viscous_nm_s_per_rad: 0.0 };
    let model = place.model("seal.toml", &friction)?;
    let found = place.diagnosed("seal-all", runs(place, "")?, &model)?;
    let named = found.named();
    let both = ["pressure-torque", "pressure-dependent-friction"].iter().all(|id| named.contains(id));
    let record = "O-rings, repetitions 1 to 3";
    place.check(record, "pressure-torque and pressure-dependent-friction", found.words(), both);
    let wear = found.names_or_groups("wear-drift");
    place.check(record, "no wear", if wear { "wear" } else { "none" }, !wear);
    // N·m/MPa as N/bar.
    let area = found.number("pressure-torque", "gain").map(|gain| gain / RADIUS_M / 10.0);
    let text = area.map_or("none".to_owned(), |area| format!("{area:.2} N/bar"));
    place.check(
        record,
        "pressure on an area: 52 ± 1 N/bar",
        text,
        area.is_some_and(|area| (51.0..=53.0).contains(&area)),
    );
    for repetition in ["1", "2", "3"] {
        let found = place.diagnosed(&format!("seal-{repetition}"), runs(place, repetition)?, &model)?;
        let passed = found.names_or_groups("pressure-dependent-friction");
        let record = format!("O-ring, repetition {repetition} alone");
        place.check(&record, "pressure-dependent-friction, or a group that holds it", found.words(), passed);
    }
    Ok(())
}
