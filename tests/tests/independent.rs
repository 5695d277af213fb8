//! `stepvalve diagnose` on torque logs of a friction that neither the product nor the rig has made.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/bristles.rs"]
mod bristles;
#[path = "shared/sliding.rs"]
mod sliding;

use bristles::{Contact, RIG, campaign, of_motions};
use log_data::Run;
use serde_json::Value;
use sliding::{diagnose, json, rig, write};
use stepvalve_tests::TestPlace;

fn found(contact: Contact, counts: f64) -> Value {
    found_in(campaign(contact, counts, 11))
}

fn found_in(runs: Vec<Run>) -> Value {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", runs);
    diagnose(&place, &log, &rig(), "out").expect_code(0);
    let found = json(&place, "out");
    println!("{} {} {}", found["verdict"], found["causes"], found["within_tolerance"]);
    found
}

#[test]
fn a_model_that_is_three_per_cent_off_agrees() {
    let off = Contact {
        coulomb_nm: 1.03 * RIG.coulomb_nm,
        static_nm: 0.97 * RIG.static_nm,
        stiffness: 1.02 * RIG.stiffness,
        viscous: 0.98 * RIG.viscous,
        inertia: 1.03 * RIG.inertia,
        ..RIG
    };
    // Of 4,000 counts a slow motion passes one in 31 ms: where it rests within a count, its bristles' torque is known to half of the static level.
    for (contact, counts) in [(RIG, 4000.0), (RIG, 131_072.0), (off, 131_072.0), (off, 1e6)] {
        let found = found(contact, counts);
        assert_eq!(found["verdict"], "no-discrepancy", "{counts}: {found}");
        let corrected = found["within_tolerance"].as_array().unwrap();
        let coulomb = corrected.iter().find(|of| of["id"] == "coulomb-level");
        let coulomb = coulomb.map_or(1.0, |of| of["value"].as_f64().unwrap());
        let expected = contact.coulomb_nm / RIG.coulomb_nm;
        assert!((coulomb - expected).abs() < 0.02, "{counts}: {coulomb}, expected {expected}");
    }
}

#[test]
fn a_cause_that_only_the_fastest_runs_show_is_named() {
    let found = found(Contact { viscous: 2.0 * RIG.viscous, ..RIG }, 131_072.0);
    assert_eq!(found["verdict"], "explained", "{found}");
    let causes = found["causes"].as_array().unwrap();
    assert_eq!((causes.len(), causes[0]["id"].as_str().unwrap()), (1, "viscous-level"), "{found}");
    let bound = |index: usize| causes[0]["parameters"]["factor"]["ci95"][index].as_f64().unwrap();
    assert!(bound(0) < 2.0 && 2.0 < bound(1) && bound(1) - bound(0) < 0.4, "{found}");
}

/// Seven motions, each made once: in one or two of them the static friction shows, and some of these have to judge.
#[test]
fn a_cause_that_few_of_seven_motions_show_is_named() {
    let found = found_in(of_motions(7, Contact { static_nm: 1.35 * RIG.static_nm, ..RIG }, 131_072.0, 12));
    assert_eq!(found["verdict"], "explained", "{found}");
    let causes = found["causes"].as_array().unwrap();
    assert_eq!((causes.len(), causes[0]["id"].as_str().unwrap()), (1, "static-level"), "{found}");
    let bound = |index: usize| causes[0]["parameters"]["factor"]["ci95"][index].as_f64().unwrap();
    assert!(bound(0) < 1.35 && 1.35 < bound(1) && bound(1) - bound(0) < 0.1, "{found}");
}
