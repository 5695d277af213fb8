//! Campaigns of the real family: the same for a seed, as wide as they say, with an answer key.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use hidden_effect_rig::{Campaign, Family, Hidden, LogKind, STRONG};
use serde_json::Value;

fn real(log: LogKind, effects: &[&str]) -> Hidden {
    Hidden { family: Family::Real, samples: 6_000, ..Hidden::with(log, effects, STRONG) }
}

#[test]
fn a_seed_draws_the_same_campaign_again() {
    for log in [LogKind::Torque, LogKind::Angle] {
        let draw = || Campaign::draw(11, &real(log, &["coulomb-level"]));
        let (one, other) = (draw(), draw());
        assert_eq!(one.truth.json(), other.truth.json());
        assert_eq!(one.model_toml, other.model_toml);
        // Missing samples are NaN, which equals nothing: compare what is printed.
        assert_eq!(format!("{:?}", one.log), format!("{:?}", other.log));
    }
}

#[test]
fn a_number_is_hidden_beyond_its_tolerance_and_as_strong_as_asked() {
    let campaign = Campaign::draw(12, &real(LogKind::Torque, &["viscous-level"]));
    let effect = &campaign.truth.effects[0];
    let factor = effect.parameters["factor"].as_f64().unwrap();
    let off_by = campaign.truth.imperfect.as_ref().unwrap().world["numbers_off_by"].as_f64().unwrap();
    assert!(factor.ln().abs() > 0.12 - off_by, "{factor}, the file is off by {off_by} at most");
    assert!(effect.strength >= 0.8 * STRONG, "{}", effect.strength);
}

/// What a score of clean campaigns must hold somewhere: every kind of motion, noise, encoder and gap.
#[test]
fn a_score_of_campaigns_is_wide() {
    let small = Hidden { samples: 2_000, ..real(LogKind::Torque, &[]) };
    let worlds: Vec<Campaign> = (100..130).filter_map(|seed| Campaign::try_draw(seed, &small)).collect();
    let fact = |campaign: &Campaign, key: &str| {
        campaign.truth.imperfect.as_ref().unwrap().world.get(key).cloned().unwrap_or(Value::Null)
    };
    for (key, all) in [
        ("motions", vec!["TestRig", "Production", "Loop"]),
        ("colour", vec!["White", "Slow", "Mains"]),
        ("pressure", vec!["All", "Some", "None"]),
    ] {
        for one in all {
            let there = worlds.iter().any(|campaign| fact(campaign, key).as_str().unwrap().starts_with(one));
            assert!(there, "no {key} {one} among {}", worlds.len());
        }
    }
    let numbers = |key: &str| -> Vec<f64> {
        let mut all: Vec<f64> = worlds.iter().map(|campaign| fact(campaign, key).as_f64().unwrap()).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let steps = numbers("encoder_step_rad");
    assert!(steps[0] == 0.0 && *steps.last().unwrap() > 3e-4, "{steps:?}");
    let missing = numbers("missing");
    assert!(missing[0] == 0.0 && *missing.last().unwrap() > 0.0);
    let gaps = worlds.iter().flat_map(|campaign| &campaign.log.runs);
    let gaps = gaps.filter(|run| run.torque_nm.as_ref().unwrap().iter().any(|torque| torque.is_nan()));
    assert!(gaps.count() > 0);
}
