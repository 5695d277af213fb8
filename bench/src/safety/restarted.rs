//! A valve whose trajectory and controller die at a random moment: what the next generation knows of its position.

use super::ground::Ground;
use super::operated::{self, Watched};
use super::tally::{Outcome, Tally};
use anyhow::Result;
use config::AfterStop;
use injection::SplitSeed;
use signals::{OperatorKind, OperatorResult, SetPointKind, SetPointRefusal};

/// How the valve may keep what it knows: does the drive hold when disarmed, is the encoder absolute, does the drive hold after a stop.
const KEEPERS: [(&str, bool, bool, AfterStop); 4] = [
    ("current kept", true, false, AfterStop::Hold),
    ("absolute encoder", false, true, AfterStop::DeEnergise),
    ("nothing kept", false, false, AfterStop::DeEnergise),
    ("current kept until the end", false, false, AfterStop::Hold),
];

/// Runs many trials.
///
/// # Errors
/// Where the shipped scenarios can't be used.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    operated::campaign("starts anew", (seed, trials), tally, trial)
}

fn trial(ground: &Ground, seed: u64) -> Result<Outcome> {
    let mut details = SplitSeed::new(seed);
    let first = ("current kept", true, false, AfterStop::Hold);
    let (kept, holds, absolute, after_stop) = details.one(&KEEPERS, first);
    let mut scenario = ground.scenario.clone();
    scenario.seed = details.whole(0, 1 << 60);
    scenario.initial_angle_rad = details.real(-1.0, 1.0);
    scenario.driver.holds_when_disarmed = holds;
    scenario.driver.after_stop = after_stop;
    scenario.encoder.absolute = absolute;
    let mut valve = Watched::new(&scenario, &ground.models)?;
    valve.run(20);
    let armed = details.whole(0, 4) != 0;
    if armed {
        valve.complete(OperatorKind::Arm);
        let (kind, value) = if details.whole(0, 2) == 0 {
            (SetPointKind::Angle, details.real(-1.0, 1.0))
        } else {
            (SetPointKind::Speed, details.real(-12.0, 12.0))
        };
        valve.set(kind, value);
        valve.run(details.whole(1, 600));
    }
    let left = valve.die(details.whole(100, 400))?;
    let rests = valve.run(50);
    let homed = valve.check_zero(&rests.plant, "after the start");
    let moved_rad = rests.plant.truth.angle_rad - left.truth.angle_rad;
    // Where the current goes and comes the rotor jumps to the nearest tooth: half a pitch at the most.
    let most_rad = if holds { 1e-3 } else { 0.5 * std::f64::consts::TAU / 50.0 + 1e-3 };
    valve.expect(moved_rad.abs() <= most_rad, || format!("the start moved the rotor by {moved_rad} rad"));
    let expected = absolute || holds || armed && after_stop == AfterStop::Hold;
    valve.expect(homed == expected, || format!("homed: {homed}, expected {expected}"));
    go_on(&mut valve, homed, rests.plant.truth.angle_rad);
    Ok(Outcome {
        fault: format!("start anew, {kept}"),
        exact: format!("seed {seed}, {kept}"),
        stopped: true,
        violations: valve.end(),
        ..Outcome::default()
    })
}

/// A valve that knows its angle goes where it is sent; one that does not refuses to.
fn go_on(valve: &mut Watched<'_>, homed: bool, rests_rad: f64) {
    let (result, _) = valve.complete(OperatorKind::Arm);
    valve.expect(result == OperatorResult::Done, || format!("arm: {result}"));
    let to_rad = rests_rad + 0.2;
    valve.set(SetPointKind::Angle, to_rad);
    let there = valve.run(1000);
    let refused = there.reference.refusal == SetPointRefusal::NotHomed.code();
    valve.expect(refused != homed, || format!("homed: {homed}, refused: {refused}"));
    let off_rad = there.plant.truth.angle_rad - to_rad;
    valve.expect(!homed || off_rad.abs() < 2e-3, || format!("{off_rad} rad off where it was sent"));
}
