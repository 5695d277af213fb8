//! `stepvalve paper`: the page, the JSON file, and what they say.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use serde_json::Value;
use stepvalve_tests::TestPlace;

#[test]
fn the_papers_claims_beside_what_the_model_gives() {
    let place = TestPlace::new();
    let out = place.path("paper");
    let finished = place.stepvalve(&["paper", "--out", out.to_str().unwrap()]).expect_code(0);
    let html = std::fs::read_to_string(out.join("paper.html")).unwrap();
    // What became of the statements comes first, here and on the terminal.
    let verdict = html.find("What became of its statements").expect("verdicts");
    assert!(verdict < html.find("Figures 7 and 12").unwrap());
    assert!(finished.stdout.starts_with("7 statements of the paper"), "{}", finished.stdout);
    assert!(finished.stdout.find("refuted    the motor turns") < finished.stdout.find("sigma2_radii = "));
    for heading in
        ["Table 1", "Figures 7 and 12", "Figure 10", "Figure 11", "peak at the start against the ramp"]
    {
        assert!(html.contains(heading), "{heading} is not on the page");
    }
    let json: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("paper.json")).unwrap()).unwrap();
    let value = |id: &str| -> f64 {
        let facts = json["facts"].as_array().unwrap();
        let fact = facts.iter().find(|fact| fact["id"] == id).unwrap_or_else(|| panic!("no {id}"));
        assert!(finished.stdout.contains(&format!("{id} = ")), "{id} is not printed");
        fact["value"].as_f64().unwrap_or_else(|| panic!("{id} is no number"))
    };
    // By hand, from the paper's equations: see docs/paper.md.
    let close = |id: &str, expected: f64, within: f64| {
        assert!((value(id) - expected).abs() < within, "{id} is {}, expected {expected}", value(id));
    };
    close("sigma2_radii", 1.03e-4, 1e-6);
    close("sigma2_diameters", 2.41e-5, 1e-7);
    close("viscous_torque_200khz", 4.468, 1e-3);
    close("viscous_torque_600khz", 13.404, 1e-3);
    close("seal_width_radii", 16.56, 0.01);
    close("static_ratio_table_1", 1.2001, 1e-4);
    close("stribeck_microsteps_per_s", 17.905, 1e-3);
    for rate in [200, 600] {
        for set in ["initial", "revised"] {
            close(&format!("rotation_{rate}khz_{set}_follows"), 0.0, 0.1);
        }
        close(&format!("rotation_{rate}khz_rig_mean"), 1.5, 0.02);
    }
    close("ramp_bound_rig", 0.4167, 1e-3);
    // A slow start reaches T_s, a fast one does not.
    assert!(value("peak_slowest_rig") > 2.9 && value("peak_at_100_rig") < 1.6);
    let facts = json["facts"].as_array().unwrap();
    assert!(facts.iter().all(|fact| fact["value"].is_number()), "a fact without a number");
    // A second time into the same folder: refused, and nothing changed.
    let again = place.stepvalve(&["paper", "--out", out.to_str().unwrap()]).expect_code(2);
    assert!(again.stderr.contains("paper.html exists"), "{}", again.stderr);
}
