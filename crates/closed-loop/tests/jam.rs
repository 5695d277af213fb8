//! A rotor that is stopped in full motion: the command waits for it within 85° electrical, and no step is lost where the
//! dead time allows it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{InProcess, Parts, wire};
use common::{Valve, scenario};
use config::{Damping, Scenario, ScheduledSetPoint, SetPoint};
use signals::limiting;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

const TEETH: f64 = 50.0;

/// The reading in whose cycle the rotor stops shows the jam only in part, and the observer answers it, degrees.
const SLACK_DEG: f64 = 12.0;

/// How the loop is timed, and how fast the valve runs into the stop.
#[derive(Debug, Clone, Copy)]
struct Case {
    period_ns: u64,
    loop_delay_cycles: u64,
    encoder_delay_cycles: u64,
    counts_per_turn: u64,
    speed_rad_per_s: f64,
    /// Where in a cycle the rotor meets the stop, in parts of the cycle's motion.
    phase: f64,
}

impl Case {
    fn scenario(&self) -> Scenario {
        let mut scenario = scenario(1.0, "");
        scenario.period_ns = self.period_ns;
        scenario.loop_delay_cycles = self.loop_delay_cycles;
        scenario.encoder.delay_cycles = self.encoder_delay_cycles;
        scenario.encoder.counts_per_turn = self.counts_per_turn;
        scenario.limits.max_speed_rad_per_s = 40.0;
        // Out of the way: the valve is to go on pulling at the stop.
        scenario.safety.max_following_error_rad = 100.0;
        scenario.control.observer = true;
        scenario.control.damping = Damping::Active;
        scenario.homing.marks.high_stop_rad = Some(self.stop_rad());
        let set_point = SetPoint::Speed { speed_rad_per_s: self.speed_rad_per_s };
        scenario.set_points = vec![ScheduledSetPoint { time_s: 0.1, set_point, line: 0 }];
        scenario
    }

    /// Far enough away for the valve to reach its speed.
    fn stop_rad(&self) -> f64 {
        let far_rad = if self.speed_rad_per_s < 2.0 { 0.1 } else { 1.5 };
        far_rad + self.phase * self.speed_rad_per_s * self.period_ns as f64 / 1e9
    }

    /// Electrical way of the reference, degrees, from the reading before the stop to the end of the first command that knows
    /// of it, and while the driver's acceleration brakes the command.
    fn blind_deg(&self, parts: &Parts) -> f64 {
        let period_s = self.period_ns as f64 / 1e9;
        let cycles = (self.loop_delay_cycles + self.encoder_delay_cycles + 2) as f64;
        let drive = &parts.controller.params.drive;
        let most_rad_per_s2 = drive.max_pulse_acceleration_hz_per_s * drive.microstep_angle_rad;
        let blind_rad = self.speed_rad_per_s * cycles * period_s;
        // The lead that the observer adds makes the command up to half as fast again.
        let braking_rad = (1.5 * self.speed_rad_per_s).powi(2) / (2.0 * most_rad_per_s2);
        (TEETH * (blind_rad + braking_rad)).to_degrees()
    }

    fn name(&self) -> String {
        let Self { loop_delay_cycles, encoder_delay_cycles, speed_rad_per_s, .. } = self;
        let period_ms = self.period_ns as f64 / 1e6;
        format!(
            "{period_ms} ms, {loop_delay_cycles} + {encoder_delay_cycles} cycles, {speed_rad_per_s:4} rad/s"
        )
    }

    /// Electrical angle of a count, degrees.
    fn count_deg(&self) -> f64 {
        (TEETH * TAU / self.counts_per_turn as f64).to_degrees()
    }
}

/// The load angle when the valve met the stop, degrees; the largest since, and the largest once all has settled.
#[derive(Debug, Default)]
struct Found {
    before_deg: f64,
    most_deg: f64,
    settled_deg: f64,
    limited: bool,
    lost: i64,
}

fn run(case: &Case, parts: &Parts) -> Found {
    let mut found = Found::default();
    let mut met = None;
    for cycle in InProcess::new(parts).take_while(|cycle| cycle.cycle < parts.timeline.disarm_cycle) {
        let truth = &cycle.plant.truth;
        let load_deg = (TEETH * (truth.command_angle_rad - truth.angle_rad)).to_degrees();
        if met.is_none() && truth.angle_rad >= case.stop_rad() - 1e-9 {
            met = Some(cycle.cycle);
        }
        let Some(met) = met else {
            found.before_deg = load_deg;
            continue;
        };
        found.most_deg = found.most_deg.max(load_deg);
        if (cycle.cycle - met) * case.period_ns > 50_000_000 {
            found.settled_deg = found.settled_deg.max(load_deg);
        }
        found.limited |= cycle.status.limiting & limiting::TORQUE != 0;
        found.lost = truth.lost_teeth;
    }
    assert!(met.is_some(), "{case:?} did not reach the stop");
    found
}

const TIMINGS: [(u64, u64, u64); 5] =
    [(1_000_000, 1, 0), (1_000_000, 2, 0), (1_000_000, 1, 1), (250_000, 1, 0), (250_000, 2, 2)];

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (period_ns, loop_delay_cycles, encoder_delay_cycles) in TIMINGS {
        for counts_per_turn in [131_072, 4_000] {
            for speed_rad_per_s in [0.5, 1.0, 5.0, 9.0, 12.0] {
                cases.extend([0.0, 0.2, 0.4, 0.6, 0.8].map(|phase| Case {
                    period_ns,
                    loop_delay_cycles,
                    encoder_delay_cycles,
                    counts_per_turn,
                    speed_rad_per_s,
                    phase,
                }));
            }
        }
    }
    cases
}

#[test]
fn a_jammed_rotor_is_pulled_by_no_more_than_85_degrees() {
    let mut worst: BTreeMap<String, f64> = BTreeMap::new();
    for case in cases() {
        let parts = wire(&case.scenario(), &Valve::default().model(), &Valve::default().model()).unwrap();
        let found = run(&case, &parts);
        // What nobody can know of yet, and the readings of coarse encoders.
        let most_deg =
            (found.before_deg + case.blind_deg(&parts)).max(85.0) + SLACK_DEG + 3.0 * case.count_deg();
        assert!(found.most_deg <= most_deg, "{case:?}: {found:?}, expected at most {most_deg:.1}°");
        assert!(found.settled_deg <= 86.0 + case.count_deg(), "{case:?}: {found:?}");
        assert!(found.settled_deg >= 60.0, "{case:?}: gave the valve up, {found:?}");
        assert!(found.limited && found.lost == 0, "{case:?}: {found:?}");
        let most = worst.entry(case.name()).or_default();
        *most = most.max(found.most_deg);
    }
    for (name, most_deg) in worst {
        println!("{name}: {most_deg:.0}° at the most");
    }
}
