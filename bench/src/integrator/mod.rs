//! `bench integrator`: the valve's step beside SUNDIALS CVODE, law × parameters × motion × error × cost, in one run.

mod laws;
mod motions;
mod peer;
mod slips;
mod trace;

use crate::output::{Results, Sheet};
use crate::progress::Progress;
use anyhow::Result;
use laws::Contact;
use motions::Motion;
use peer::Peer;
use serde_json::{Value, json};
use trace::Error;

/// CVODE's tolerances in the table.
const TOLERANCES: [&str; 7] = ["1e-10", "1e-9", "1e-8", "1e-7", "1e-6", "1e-5", "1e-4"];
/// The reference's.
const REFERENCE: &str = "1e-11";

const HEADER: [&str; 9] = [
    "law",
    "parameters",
    "motion",
    "solver",
    "angle, rad rms",
    "torque, % of peak, rms",
    "99.9 % below",
    "largest",
    "µs per cycle of 1 ms",
];

/// Measures all laws over all motions.
///
/// # Errors
/// Where CVODE is there and fails, or a scenario is refused.
pub fn run(quick: bool) -> Result<Results> {
    let motions = motions::all(quick)?;
    let contacts = laws::all();
    let progress = Progress::new(motions.len() * contacts.len() + 1);
    let Some(peer) = Peer::build()? else {
        return Ok(results(quick, vec![not_installed()], Value::Null));
    };
    let mut all = Sheet::new("integrator", title(), &HEADER);
    let header = [
        "law",
        "parameters",
        "motion",
        "angle, rad rms",
        "torque, % of peak, rms",
        "99.9 % below",
        "largest",
        "µs",
        "CVODE µs at this error",
        "times cheaper",
    ];
    let mut summary = Sheet::new(
        "integrator-summary",
        "valve-model's step, and what CVODE takes for the same error",
        &header,
    );
    let mut data = Vec::new();
    for motion in &motions {
        for contact in contacts.iter().filter(|contact| contact.can(motion)) {
            progress.next(format!("{} ({}), {}", contact.law(), contact.name, motion.name));
            let compared = compare(&peer, contact, motion)?;
            compared.rows(&mut all, &mut summary);
            data.push(compared.json());
        }
    }
    progress.next("stick-slip");
    let (slips, slip_data) = slips::run(&peer)?;
    Ok(results(quick, vec![summary, slips, all], json!({"runs": data, "stick_slip": slip_data})))
}

fn title() -> String {
    format!("Error at the cycles against CVODE at rtol {REFERENCE}, and cost")
}

fn not_installed() -> Sheet {
    let mut sheet = Sheet::new("integrator", title(), &["peer", "state"]);
    sheet.row(["SUNDIALS CVODE".to_owned(), "not installed (apt-get install libsundials-dev)".to_owned()]);
    sheet
}

fn results(quick: bool, sheets: Vec<Sheet>, data: Value) -> Results {
    Results {
        command: "integrator",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "one thread under the normal scheduler; of our step the best of sixty runs; of CVODE the better of two, in time of the processor".into(),
        sheets,
        data,
    }
}

/// One law with one motion: ours and CVODE at several tolerances, against CVODE at the tightest.
struct Compared<'a> {
    contact: &'a Contact,
    motion: &'a Motion,
    ours: (Error, f64),
    cvode: Vec<(&'static str, Error, f64)>,
}

fn compare<'a>(peer: &Peer, contact: &'a Contact, motion: &'a Motion) -> Result<Compared<'a>> {
    let reference = peer.run(REFERENCE, contact, &motion.commands)?;
    let ours = trace::timed(contact, &motion.commands)?;
    let cvode = TOLERANCES.iter().map(|&rtol| -> Result<_> {
        let (one, other) =
            (peer.run(rtol, contact, &motion.commands)?, peer.run(rtol, contact, &motion.commands)?);
        Ok((rtol, Error::of(&one, &reference), one.us_per_cycle.min(other.us_per_cycle)))
    });
    let cvode = cvode.collect::<Result<_>>()?;
    Ok(Compared { contact, motion, ours: (Error::of(&ours, &reference), ours.us_per_cycle), cvode })
}

impl Compared<'_> {
    /// What CVODE would take for our error, µs: between its tolerances in proportion in logarithms; of angle and torque
    /// the one where it is cheaper.
    fn cvode_us(&self) -> f64 {
        let at = |pick: fn(&Error) -> f64| {
            let points: Vec<_> = self.cvode.iter().map(|(_, error, us)| (pick(error), *us)).collect();
            cost_at(&points, pick(&self.ours.0))
        };
        at(|error| error.angle_rms_rad).min(at(|error| error.torque_percent))
    }

    fn rows(&self, all: &mut Sheet, summary: &mut Sheet) {
        let name = [self.contact.law(), self.contact.name, &self.motion.name].map(str::to_owned);
        let (error, us) = &self.ours;
        let cells = |solver: String, error: &Error, us: f64| {
            [
                solver,
                format!("{:.1e}", error.angle_rms_rad),
                format!("{:.5}", error.torque_rms_percent),
                format!("{:.4}", error.torque_most_percent),
                format!("{:.4}", error.torque_percent),
                format!("{us:.2}"),
            ]
        };
        all.row(name.iter().cloned().chain(cells("valve-model".into(), error, *us)));
        for (rtol, error, us) in &self.cvode {
            all.row(name.iter().cloned().chain(cells(format!("CVODE {rtol}"), error, *us)));
        }
        let [_, angle, rms, most, torque, own] = cells(String::new(), error, *us);
        let other = self.cvode_us();
        summary.row(name.into_iter().chain([
            angle,
            rms,
            most,
            torque,
            own,
            format!("{other:.1}"),
            format!("{:.1}", other / us),
        ]));
    }

    fn json(&self) -> Value {
        let of = |error: &Error, us: f64| json!({"angle_rms_rad": error.angle_rms_rad, "torque_rms_percent": error.torque_rms_percent, "torque_most_percent": error.torque_most_percent, "torque_percent": error.torque_percent, "us_per_cycle": us});
        let cvode: serde_json::Map<_, _> =
            self.cvode.iter().map(|(rtol, error, us)| ((*rtol).to_owned(), of(error, *us))).collect();
        json!({
            "law": self.contact.law(), "parameters": self.contact.name, "motion": self.motion.name,
            "valve_model": of(&self.ours.0, self.ours.1), "cvode": cvode, "cvode_us_at_this_error": self.cvode_us(),
        })
    }
}

/// The cost at an error, from (error, cost) in order of falling cost; at the ends the last one's.
fn cost_at(points: &[(f64, f64)], error: f64) -> f64 {
    let logarithm = |value: f64| value.max(f64::MIN_POSITIVE).ln();
    for pair in points.windows(2) {
        let [(low, dear), (high, cheap)] = pair else { continue };
        if *low <= error && error <= *high && high > low {
            let part = (logarithm(error) - logarithm(*low)) / (logarithm(*high) - logarithm(*low));
            return (logarithm(*dear) + part * (logarithm(*cheap) - logarithm(*dear))).exp();
        }
    }
    let beyond = |point: Option<&(f64, f64)>| point.map_or(f64::NAN, |(_, us)| *us);
    match points.first() {
        Some((tightest, us)) if error < *tightest => *us,
        _ => beyond(points.last()),
    }
}
