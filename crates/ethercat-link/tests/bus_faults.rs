//! Faults of the bus, one by one and drawn by the hundred: no unsafe pulse, no leap, no hang, no arming by itself.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Rig, SILENCE_CYCLES, arming, drive_file, go, guard, off};
use ethercat_link::BusPhase;
use signals::{FaultCode, Feedback, StepCommand, validity};
use subdevice::{Hurt, Line, OnMissed, Settings, SyncRow};

const MS: u64 = 1_000_000;

/// A controller as simple as can be: follows a rate from where the drive stands, ramps, counts from what was accepted, and lets go
/// at the first fault.
struct Driver {
    position: f64,
    rate_hz: f64,
    wanted_hz: f64,
    fault: FaultCode,
    fault_cycle: Option<u64>,
    silent: u64,
}

impl Driver {
    fn new(accepted: i64, wanted_hz: f64) -> Self {
        Self {
            position: accepted as f64,
            rate_hz: 0.0,
            wanted_hz,
            fault: FaultCode::None,
            fault_cycle: None,
            silent: 0,
        }
    }

    fn command(&mut self) -> StepCommand {
        if self.fault != FaultCode::None {
            return off();
        }
        self.rate_hz += (self.wanted_hz - self.rate_hz).clamp(-19_000.0, 19_000.0);
        self.position += self.rate_hz * 1e-3;
        go(self.position, self.rate_hz)
    }

    fn hear(&mut self, cycle: u64, feedback: Option<&Feedback>) {
        self.silent = if feedback.is_none() { self.silent + 1 } else { 0 };
        let Some(feedback) = feedback else { return };
        if feedback.drive_fault != 0 && self.fault == FaultCode::None {
            self.fault = FaultCode::from_code(feedback.drive_fault).unwrap();
            self.fault_cycle = Some(cycle);
        }
    }
}

/// Turns at `rate_hz`, then suffers `hurt`, and goes on for `cycles`.
fn suffer(settings: Settings, rate_hz: f64, hurt: Hurt, cycles: u64) -> (Rig, Driver, u64, Vec<SyncRow>) {
    let mut rig = Rig::new(settings, drive_file());
    let start = rig.enabled().accepted_microsteps;
    let mut driver = Driver::new(start, rate_hz);
    rig.rows();
    for _ in 0..60 {
        let command = driver.command();
        let (cycle, feedback) = (rig.cycle, rig.step(Some(&command), false));
        driver.hear(cycle, feedback.as_ref());
    }
    assert_eq!(driver.fault, FaultCode::None);
    let hurt_cycle = rig.cycle;
    rig.hurt(hurt);
    for _ in 0..cycles {
        let command = driver.command();
        let (cycle, feedback) = (rig.cycle, rig.step(Some(&command), false));
        driver.hear(cycle, feedback.as_ref());
    }
    let rows = rig.rows();
    (rig, driver, hurt_cycle, rows)
}

/// No cycle's way is longer than the driver's highest rate allows.
fn no_leap(rows: &[SyncRow], what: &str) {
    let longest = guard().max_pulse_rate_hz * 1e-3 + 1.0;
    for row in rows {
        let way = (row.end - row.start) as f64;
        assert!(way.abs() <= longest, "{what}: {row:?}");
    }
}

/// It stands at the end.
fn stands(rows: &[SyncRow], what: &str) {
    // A bring-up ends SYNC0, so there may be few rows after the ramp.
    for row in rows.iter().rev().take(5) {
        assert_eq!(row.start, row.end, "{what}: {row:?}");
    }
}

#[test]
fn a_few_lost_frames_are_survived() {
    let lines = [
        Line::DropRequest,
        Line::DropReply,
        Line::Delay(MS),
        Line::Delay(5 * MS),
        Line::Duplicate,
        Line::Reorder,
        Line::Truncate,
        Line::Garbage,
        Line::Foreign,
        Line::WorkingCounter,
    ];
    for line in lines {
        for on_missed in [OnMissed::Hold, OnMissed::Extrapolate] {
            let count = SILENCE_CYCLES as u32 - 1;
            let settings = Settings { on_missed, ..Settings::default() };
            let (rig, driver, _, rows) = suffer(settings, 600e3, Hurt::Line(line, count), 300);
            let what = format!("{line:?} {on_missed:?}");
            assert_eq!(driver.fault, FaultCode::None, "{what}");
            assert!(rig.bridge.enabled(), "{what}");
            no_leap(&rows, &what);
        }
    }
}

#[test]
fn a_lost_bus_is_a_fault_after_silence_and_comes_back_without_arming() {
    for hurt in
        [Hurt::Cable(10 * MS), Hurt::Cable(300 * MS), Hurt::Power(100 * MS), Hurt::Line(Line::DropReply, 40)]
    {
        let (mut rig, driver, hurt_cycle, rows) = suffer(Settings::default(), 200e3, hurt, 4000);
        let what = format!("{hurt:?}");
        assert_eq!(driver.fault, FaultCode::BusLost, "{what}");
        let after = driver.fault_cycle.unwrap() - hurt_cycle;
        assert!(after < SILENCE_CYCLES + 1, "{what}: {after} cycles");
        no_leap(&rows, &what);
        stands(&rows, &what);
        assert!(!rig.bridge.enabled());
        // Tried once a second; forty lost replies spoil some attempts.
        rig.operate(Some(&off()));
        // The drive itself stopped with a fault, unless its power went: only the operator's reset leaves it.
        rig.step(Some(&off()), true);
        let feedback = (0..10).filter_map(|_| rig.step(Some(&off()), false)).last().unwrap();
        assert_eq!(feedback.drive_fault, 0, "{what}");
        // Asked for, it goes again.
        rig.enabled();
    }
}

#[test]
fn a_device_that_leaves_op_or_fails_is_a_fault_in_the_same_cycle() {
    let rows = [
        (Hurt::AlFall(0x001B), FaultCode::DriveLeftOperation),
        (Hurt::AlFall(0x001A), FaultCode::DriveLeftOperation),
        (Hurt::DriveFault(0x8611), FaultCode::Drive),
        (Hurt::DriveFault(0x2310), FaultCode::Drive),
        (Hurt::NoFollowing(5), FaultCode::DriveLeftOperation),
        (Hurt::Mode(6, 5), FaultCode::DriveLeftOperation),
    ];
    for (hurt, fault) in rows {
        let (rig, driver, hurt_cycle, rows) = suffer(Settings::default(), 200e3, hurt, 3000);
        let what = format!("{hurt:?}");
        assert_eq!(driver.fault, fault, "{what}");
        // The status word is latched at the next SYNC0, and read with the frame after it.
        assert!(driver.fault_cycle.unwrap() - hurt_cycle <= 1, "{what}");
        no_leap(&rows, &what);
        stands(&rows, &what);
        assert!(!rig.bridge.enabled(), "{what}");
    }
}

#[test]
fn a_clock_that_leaps_stops_the_valve() {
    for jump in [300_000, -300_000] {
        let (_, driver, hurt_cycle, rows) = suffer(Settings::default(), 200e3, Hurt::ClockJump(jump), 3000);
        let what = format!("clock jump {jump}");
        assert_eq!(driver.fault, FaultCode::NotSynchronised, "{what}");
        assert!(driver.fault_cycle.unwrap() - hurt_cycle <= 11, "{what}");
        no_leap(&rows, &what);
        stands(&rows, &what);
    }
}

#[test]
fn a_link_that_is_down_is_a_lost_bus_and_the_cycles_go_on() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    rig.enabled();
    rig.cable().down = true;
    let mut faults = Vec::new();
    for _ in 0..500 {
        let before = rig.cable().now_ns;
        faults.extend(rig.step(Some(&arming()), false).map(|feedback| feedback.drive_fault));
        let passed = rig.cable().now_ns - before;
        assert!((500_000..1_600_000).contains(&passed), "the period is kept: {passed} ns");
    }
    assert_eq!(faults[0], FaultCode::BusLost.code());
    rig.cable().down = false;
    for _ in 0..3000 {
        rig.step(Some(&arming()), false);
        assert!(!rig.bridge.enabled(), "current was wanted all the time; it does not come by itself");
    }
    rig.step(Some(&arming()), true);
    let feedback = (0..10).filter_map(|_| rig.step(Some(&off()), false)).last().unwrap();
    assert_eq!(feedback.validity & validity::STOPPED_ITSELF, 0, "the operator's reset");
}

#[test]
fn the_bridge_silent_the_drive_stops_by_itself() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    let start = rig.enabled().accepted_microsteps;
    let mut driver = Driver::new(start, 200e3);
    for _ in 0..60 {
        let command = driver.command();
        rig.step(Some(&command), false);
    }
    rig.rows();
    let killed_ns = rig.cable().now_ns;
    let until = killed_ns + 200 * MS;
    let cable = rig.cable();
    cable.bus.advance(until);
    let rows = rig.rows();
    no_leap(&rows, "bridge killed");
    stands(&rows, "bridge killed");
    let left = rows.iter().find(|row| row.al != 8).unwrap();
    assert!(left.host_ns - killed_ns <= (SILENCE_CYCLES + 3) * MS, "its own watchdog");
}

/// A generator of numbers that is the same everywhere.
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

fn draw_hurt(draw: &mut Draw) -> Hurt {
    let count = [1, 1, 2, 5, 40, 200][draw.below(6) as usize];
    let line = [
        Line::DropRequest,
        Line::DropReply,
        Line::Delay(MS),
        Line::Delay(5 * MS),
        Line::Delay(40 * MS),
        Line::Duplicate,
        Line::Reorder,
        Line::Truncate,
        Line::Garbage,
        Line::Foreign,
        Line::WorkingCounter,
    ][draw.below(11) as usize];
    let ms = [1, 3, 10, 100, 1000, 5000][draw.below(6) as usize] * MS;
    match draw.below(10) {
        0..4 => Hurt::Line(line, count),
        4 => Hurt::Cable(ms),
        5 => Hurt::Power(ms),
        6 => Hurt::AlFall([0x1A, 0x1B, 0x2C, 0x32][draw.below(4) as usize]),
        7 => Hurt::DriveFault([0x2310, 0x3220, 0x8611, 0x7500][draw.below(4) as usize]),
        8 => [
            Hurt::NoFollowing(1 + draw.below(50) as u32),
            Hurt::Mode(draw.below(10) as i8, 1 + draw.below(20) as u32),
        ][draw.below(2) as usize],
        _ => [
            Hurt::ClockJump(draw.below(1_000_000).cast_signed() - 500_000),
            Hurt::Drift(draw.below(300_000).cast_signed() - 150_000),
        ][draw.below(2) as usize],
    }
}

/// Faults drawn from a seed, in every state of the drive, with an operator who resets and arms again.
#[test]
fn faults_drawn_by_the_hundred() {
    let count: u64 = std::env::var("STEPVALVE_BUS_FAULTS").map_or(20, |text| text.parse().unwrap());
    let seed: u64 = std::env::var("STEPVALVE_SEED").map_or(1, |text| text.parse().unwrap());
    println!("{count} faults from seed {seed}");
    let only: Option<u64> = std::env::var("STEPVALVE_ONLY").ok().map(|text| text.parse().unwrap());
    let mut draw = Draw(seed);
    for number in 0..count {
        let settings = Settings {
            on_missed: [OnMissed::Hold, OnMissed::Extrapolate][draw.below(2) as usize],
            enable_cycles: [1, 5, 100][draw.below(3) as usize],
            drift_ppb: draw.below(300_000).cast_signed() - 150_000,
            ..Settings::default()
        };
        let hurt = draw_hurt(&mut draw);
        let (when, rate_hz) = (draw.below(300), [600e3, -200e3, 50e3][draw.below(3) as usize]);
        if only.is_some_and(|only| only != number) {
            continue;
        }
        let mut rig = Rig::new(settings, drive_file());
        let what = format!("seed {seed}, fault {number}: {hurt:?} after {when} cycles at {rate_hz} Hz");
        rig.operate(Some(&off()));
        let mut driver: Option<Driver> = None;
        let mut fault = None;
        for cycle in 0..3000 {
            if cycle == when {
                rig.hurt(hurt);
            }
            let command = match &mut driver {
                _ if fault.is_some() => off(),
                Some(driver) => driver.command(),
                None => arming(),
            };
            let enabled_before = rig.bridge.enabled();
            let feedback = rig.step(Some(&command), false);
            if let Some(feedback) = &feedback
                && feedback.drive_fault != 0
            {
                fault.get_or_insert(feedback.drive_fault);
            }
            assert!(fault.is_none() || enabled_before || !rig.bridge.enabled(), "{what}: armed by itself");
            match (&mut driver, rig.bridge.enabled(), &feedback) {
                (Some(driver), _, feedback) => driver.hear(cycle, feedback.as_ref()),
                (None, true, Some(feedback)) => {
                    driver = Some(Driver::new(feedback.accepted_microsteps, rate_hz))
                }
                _ => {}
            }
        }
        let rows = rig.rows();
        no_leap(&rows, &what);
        // Without power there are no rows to look at.
        if fault.is_some() && !matches!(hurt, Hurt::Power(_)) {
            stands(&rows, &what);
        }
        // Everything passes: at the end the bus operates again, and goes when it is asked to.
        for _ in 0..90_000 {
            rig.step(Some(&off()), false);
            if rig.bridge.report().phase == BusPhase::Operate && rig.cycle > 9000 {
                break;
            }
        }
        assert_eq!(rig.bridge.report().phase, BusPhase::Operate, "{what}: {:?}", rig.bridge.error());
        rig.step(Some(&off()), true);
        for _ in 0..10 {
            rig.step(Some(&off()), false);
        }
        println!("{what}: {fault:?}");
        rig.enabled();
    }
}
