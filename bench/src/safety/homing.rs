//! Homing interrupted in every phase, by a disarm or by a death, and then repeated.

use super::ground::Ground;
use super::operated::{self, Watched};
use super::tally::{Outcome, Tally};
use anyhow::Result;
use config::{HomingMarks, HomingMethod, HomingSearch, Scenario};
use injection::SplitSeed;
use signals::{ControllerState, FaultCode, HomingPhase, OperatorKind, OperatorResult};

const METHODS: [HomingMethod; 4] =
    [HomingMethod::Switch, HomingMethod::Stop, HomingMethod::Index, HomingMethod::Absolute];
const PHASES: [HomingPhase; 5] = [
    HomingPhase::Seek,
    HomingPhase::BackOff,
    HomingPhase::Approach,
    HomingPhase::Align,
    HomingPhase::SetZero,
];
/// By so much a current that comes moves the rotor at most: what static friction held it off its teeth by, rad.
const PULL_RAD: f64 = 1e-2;
/// No phase is reached later, in cycles.
const MOST_CYCLES: u64 = 100_000;

/// A valve just switched on, somewhere, with its mark.
struct SwitchedOn {
    scenario: Scenario,
    method: HomingMethod,
    /// Direction of the search.
    towards: f64,
    mark_rad: f64,
}

impl SwitchedOn {
    fn draw(ground: &Ground, details: &mut SplitSeed) -> Self {
        let method = details.one(&METHODS, HomingMethod::Switch);
        let towards = details.one(&[1.0, -1.0], 1.0);
        let mark_rad = details.real(-0.5, 0.5);
        let mut scenario = ground.scenario.clone();
        scenario.seed = details.whole(0, 1 << 60);
        scenario.initial_angle_rad = mark_rad - towards * details.real(0.1, 0.8);
        scenario.encoder.absolute = method == HomingMethod::Absolute;
        scenario.homing.begins_homed = false;
        scenario.homing.search = Some(HomingSearch {
            method,
            speed_rad_per_s: towards * details.real(0.1, 0.4),
            angle_rad: mark_rad,
            longest_rad: 1.5,
            stop_current: 0.7,
            largest_spread_rad: 4e-3,
        });
        scenario.homing.marks = HomingMarks::of(method, mark_rad, towards);
        Self { scenario, method, towards, mark_rad }
    }

    /// Whether a repeated search goes the other way from its mark: an index that lies behind is not met by going on. One just ahead is
    /// passed when the current comes.
    fn is_behind(&self, rests_rad: f64) -> bool {
        self.method == HomingMethod::Index && self.towards * (rests_rad - self.mark_rad) > -PULL_RAD
    }
}

/// Runs many trials.
///
/// # Errors
/// Where the shipped scenarios can't be used.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    operated::campaign("homing interrupted", (seed, trials), tally, trial)
}

fn trial(ground: &Ground, seed: u64) -> Result<Outcome> {
    let mut details = SplitSeed::new(seed);
    let on = SwitchedOn::draw(ground, &mut details);
    let wanted = details.one(&PHASES, HomingPhase::Seek);
    // Setting the zero takes some cycles, the other phases hundreds.
    let more = details.whole(0, if wanted == HomingPhase::SetZero { 4 } else { 1000 });
    let dies = details.whole(0, 3) == 0;
    let mut valve = Watched::new(&on.scenario, &ground.models)?;
    valve.run(20);
    let mut last = valve.order(OperatorKind::Home);
    // Not every way of homing has every phase; the next one does as well.
    for _ in 0..MOST_CYCLES {
        if last.status.homing_phase >= wanted.code() {
            break;
        }
        last = valve.run(1);
    }
    let begun = last.status.homing_phase;
    for _ in 0..more {
        if last.status.homing_phase != begun {
            break;
        }
        last = valve.run(1);
    }
    let phase = HomingPhase::from_code(last.status.homing_phase).unwrap_or(HomingPhase::None);
    let by = if dies { "a death" } else { "disarm" };
    if dies {
        let left = valve.die(300)?;
        valve.expect(left.feedback.pulse_rate_hz == 0.0, || "did not stop after the death".to_owned());
    } else {
        valve.order(OperatorKind::Disarm);
    }
    let rests = valve.run(300);
    let disarmed = rests.status.state == ControllerState::Disarmed.code();
    valve.expect(disarmed, || format!("state {} after {by}, expected disarmed", rests.status.state));
    valve.expect(rests.plant.feedback.pulse_rate_hz == 0.0, || format!("moves after {by}"));
    let homed = valve.check_zero(&rests.plant, "interrupted");
    let may_be = [HomingPhase::SetZero, HomingPhase::Done].contains(&phase);
    valve.expect(!homed || may_be, || format!("homed after {by} in {phase}"));
    repeat(&on, &mut valve, rests.plant.truth.angle_rad);
    Ok(Outcome {
        fault: format!("homing, {by} in {phase}"),
        exact: format!("seed {seed}, {:?}, {by} in {phase}", on.method),
        stopped: true,
        violations: valve.end(),
        ..Outcome::default()
    })
}

/// Homes again, and wants the right zero or, where there is no mark ahead, a fault that homes nothing.
fn repeat(on: &SwitchedOn, valve: &mut Watched<'_>, rests_rad: f64) {
    let (result, last) = valve.complete(OperatorKind::Home);
    let homed = valve.run(100);
    let is_homed = valve.check_zero(&homed.plant, "homed again");
    if on.is_behind(rests_rad) && result == OperatorResult::Failed {
        valve.expect(last.status.fault == FaultCode::Homing.code(), || {
            format!("fault {} for a mark that lies behind", last.status.fault)
        });
    } else {
        valve.expect(result == OperatorResult::Done && is_homed, || {
            let ahead_rad = on.towards * (on.mark_rad - rests_rad);
            format!("homing again, {ahead_rad} rad before the mark: {result}, fault {}", last.status.fault)
        });
    }
}
