//! Faults of the bus, one by one and drawn by the hundred: no unsafe pulse, no leap, no hang, no arming by itself.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{PERIOD_NS, Rig, SILENCE_CYCLES, arming, drive_file, go, guard, off};
use ethercat_link::BringUpError;
use signals::{BusPhase, FaultCode, Feedback, StepCommand, validity};
use subdevice::{Hurt, Line, OnMissed, Settings, SyncRow};

const MS: u64 = 1_000_000;

/// A controller as simple as can be: follows a rate from where the drive stands, ramps, counts from what was accepted, and lets go
/// at the first fault.
struct Driver {
    position: f64,
    rate_hz: f64,
    wanted_hz: f64,
    fault: FaultCode,
    /// When the fault was told: the cycle, and the time, ns.
    fault_at: Option<(u64, u64)>,
}

impl Driver {
    fn new(accepted: i64, wanted_hz: f64) -> Self {
        Self { position: accepted as f64, rate_hz: 0.0, wanted_hz, fault: FaultCode::None, fault_at: None }
    }

    fn command(&mut self) -> StepCommand {
        if self.fault != FaultCode::None {
            return off();
        }
        self.rate_hz += (self.wanted_hz - self.rate_hz).clamp(-19_000.0, 19_000.0);
        self.position += self.rate_hz * 1e-3;
        go(self.position, self.rate_hz)
    }

    fn hear(&mut self, (cycle, now_ns): (u64, u64), feedback: Option<&Feedback>) {
        let Some(feedback) = feedback else { return };
        if feedback.drive_fault != 0 && self.fault == FaultCode::None {
            self.fault = FaultCode::from_code(feedback.drive_fault).unwrap();
            self.fault_at = Some((cycle, now_ns));
        }
    }

    fn fault_cycle(&self) -> u64 {
        self.fault_at.unwrap().0
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
        driver.hear((cycle, rig.cable().now_ns), feedback.as_ref());
    }
    assert_eq!(driver.fault, FaultCode::None);
    let hurt_cycle = rig.cycle;
    rig.hurt(hurt);
    for _ in 0..cycles {
        let command = driver.command();
        let (cycle, feedback) = (rig.cycle, rig.step(Some(&command), false));
        driver.hear((cycle, rig.cable().now_ns), feedback.as_ref());
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

/// The drive stands so many cycles after a fault was told: its watchdog's silence + 2, its ramp from the highest rate at 0x6085,
/// the frame or SYNC0 that is under way, and the SYNC0 at which a ramp begins.
fn stops_within_cycles() -> u64 {
    let guard = guard();
    let ramp_s = guard.max_pulse_rate_hz / guard.quick_stop_deceleration_hz_per_s;
    SILENCE_CYCLES + 2 + (ramp_s / guard.period_s).ceil() as u64 + 2
}

/// It stands at every SYNC0 from [`stops_within_cycles`] after `fault_ns` on; how many there were.
fn stands(rows: &[SyncRow], fault_ns: u64, what: &str) -> usize {
    let from_ns = fault_ns + stops_within_cycles() * u64::from(PERIOD_NS);
    let late = rows.iter().filter(|row| row.host_ns >= from_ns);
    late.inspect(|row| {
        let after_ms = (row.host_ns - fault_ns) as f64 / 1e6;
        assert_eq!(row.start, row.end, "{what}, {after_ms} ms after the fault: {row:?}");
    })
    .count()
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
        let after = driver.fault_cycle() - hurt_cycle;
        assert!(after < SILENCE_CYCLES + 1, "{what}: {after} cycles");
        no_leap(&rows, &what);
        assert!(stands(&rows, driver.fault_at.unwrap().1, &what) > 0, "{what}");
        assert!(!rig.bridge.enabled());
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
        assert!(driver.fault_cycle() - hurt_cycle <= 1, "{what}");
        no_leap(&rows, &what);
        assert!(stands(&rows, driver.fault_at.unwrap().1, &what) > 0, "{what}");
        assert!(!rig.bridge.enabled(), "{what}");
    }
}

#[test]
fn a_clock_that_leaps_stops_the_valve() {
    // A leap back of more than the frame's place puts two frames into one SYNC0 cycle: at 600 kHz two cycles' way at once, but
    // for the drive's own limit of speed.
    for (jump, rate_hz) in [(300_000, 200e3), (-300_000, 200e3), (-480_000, 600e3)] {
        let (_, driver, hurt_cycle, rows) = suffer(Settings::default(), rate_hz, Hurt::ClockJump(jump), 3000);
        let what = format!("clock jump {jump} at {rate_hz} Hz");
        assert_eq!(driver.fault, FaultCode::NotSynchronised, "{what}");
        assert!(driver.fault_cycle() - hurt_cycle <= 11, "{what}");
        no_leap(&rows, &what);
        assert!(stands(&rows, driver.fault_at.unwrap().1, &what) > 0, "{what}");
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

/// Cycles that do not run are frames that are lost: a drive that went on meanwhile is not drawn back.
#[test]
fn a_bridge_that_stood_still_is_a_lost_bus() {
    for on_missed in [OnMissed::Hold, OnMissed::Extrapolate] {
        for cycles in [1, SILENCE_CYCLES - 1, SILENCE_CYCLES, 40] {
            let what = format!("{cycles} cycles, {on_missed:?}");
            let mut rig = Rig::new(Settings { on_missed, ..Settings::default() }, drive_file());
            let mut driver = Driver::new(rig.enabled().accepted_microsteps, 600e3);
            rig.rows();
            for cycle in 0..400 {
                if cycle == 60 {
                    rig.skip(cycles);
                }
                let command = driver.command();
                let (cycle, feedback) = (rig.cycle, rig.step(Some(&command), false));
                driver.hear((cycle, rig.cable().now_ns), feedback.as_ref());
            }
            let lost = cycles >= SILENCE_CYCLES;
            assert_eq!(driver.fault, if lost { FaultCode::BusLost } else { FaultCode::None }, "{what}");
            let rows = rig.rows();
            no_leap(&rows, &what);
            if let Some((_, fault_ns)) = driver.fault_at {
                stands(&rows, fault_ns, &what);
            }
        }
    }
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
    assert!(stands(&rows, killed_ns, "bridge killed") > 0);
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

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u64) as usize]
    }
}

/// What goes wrong: at the drive and its cable, or on our side.
#[derive(Debug, Clone, Copy)]
enum Trouble {
    Far(Hurt),
    /// The interface takes no frames for so long, ns.
    LinkDown(u64),
    /// The bridge does not run for so many cycles.
    Stopped(u64),
}

fn draw_trouble(draw: &mut Draw) -> Trouble {
    let count = draw.one_of(&[1, 1, 2, 5, 40, 200]);
    let line = draw.one_of(&[
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
    ]);
    let ms = draw.one_of(&[1, 3, 10, 100, 1000, 5000]);
    let hurt = match draw.below(12) {
        0..4 => Hurt::Line(line, count),
        4 => Hurt::Cable(ms * MS),
        5 => Hurt::Power(ms * MS),
        6 => Hurt::AlFall(draw.one_of(&[0x1A, 0x1B, 0x2C, 0x32])),
        7 => Hurt::DriveFault(draw.one_of(&[0x2310, 0x3220, 0x8611, 0x7500])),
        8 => match draw.below(2) {
            0 => Hurt::NoFollowing(1 + draw.below(50) as u32),
            _ => Hurt::Mode(draw.below(10) as i8, 1 + draw.below(20) as u32),
        },
        9 => match draw.below(2) {
            0 => Hurt::ClockJump(draw.below(1_000_000).cast_signed() - 500_000),
            _ => Hurt::Drift(draw.below(300_000).cast_signed() - 150_000),
        },
        10 => return Trouble::LinkDown(ms * MS),
        _ => return Trouble::Stopped(ms),
    };
    Trouble::Far(hurt)
}

/// Everything that was drawn for one trial.
#[derive(Debug, Clone, Copy)]
struct Trial {
    settings: (OnMissed, u32, i64),
    trouble: Trouble,
    when: u64,
    rate_hz: f64,
}

impl Trial {
    fn draw(draw: &mut Draw) -> Self {
        /// A current that never comes, in cycles.
        const NEVER: u32 = u32::MAX;
        let on_missed = draw.one_of(&[OnMissed::Hold, OnMissed::Extrapolate]);
        let enable_cycles = draw.one_of(&[1, 1, 5, 5, 100, 100, NEVER]);
        let drift_ppb = draw.below(300_000).cast_signed() - 150_000;
        Self {
            settings: (on_missed, enable_cycles, drift_ppb),
            trouble: draw_trouble(draw),
            when: draw.below(300),
            rate_hz: draw.one_of(&[600e3, -200e3, 50e3]),
        }
    }

    fn settings(&self) -> Settings {
        let (on_missed, enable_cycles, drift_ppb) = self.settings;
        Settings { on_missed, enable_cycles, drift_ppb, ..Settings::default() }
    }

    fn never_enables(&self) -> bool {
        self.settings.1 == u32::MAX
    }

    /// Lets it go wrong; when our side is well again, ns.
    fn strike(&self, rig: &mut Rig) -> u64 {
        let now_ns = rig.cable().now_ns;
        match self.trouble {
            Trouble::Far(hurt) => {
                rig.hurt(hurt);
                now_ns
            }
            Trouble::LinkDown(ns) => {
                rig.cable().down = true;
                now_ns + ns
            }
            Trouble::Stopped(cycles) => {
                rig.skip(cycles);
                now_ns
            }
        }
    }
}

/// The operator arms once, the controller turns and lets go at the first fault: what was told, and when, ns.
fn ride(rig: &mut Rig, trial: &Trial, what: &str) -> Option<(FaultCode, u64)> {
    let mut driver: Option<Driver> = None;
    let mut fault = None;
    let mut well_from_ns = 0;
    for cycle in 0..3000 {
        if cycle == trial.when {
            well_from_ns = trial.strike(rig);
        }
        if rig.cable().now_ns >= well_from_ns {
            rig.cable().down = false;
        }
        let command = match &mut driver {
            _ if fault.is_some() => off(),
            Some(driver) => driver.command(),
            None => arming(),
        };
        let enabled_before = rig.bridge.enabled();
        let feedback = rig.step(Some(&command), false);
        if let Some(code) = feedback.as_ref().map(|feedback| feedback.drive_fault).filter(|code| *code != 0) {
            fault.get_or_insert((FaultCode::from_code(code).unwrap(), rig.cable().now_ns));
        }
        assert!(fault.is_none() || enabled_before || !rig.bridge.enabled(), "{what}: armed by itself");
        if let (None, true, Some(feedback)) = (&driver, rig.bridge.enabled(), &feedback) {
            driver = Some(Driver::new(feedback.accepted_microsteps, trial.rate_hz));
        }
    }
    fault
}

/// The bus operates again within so many cycles of the trouble's end: it is looked for every cycle, and brought up by the first attempt.
const BACK_WITHIN_CYCLES: u64 = 600;
/// Nothing drawn here lasts longer, cycles.
const LONGEST_HURT_CYCLES: u64 = 10_000;

/// Waits until the trouble is over and the bus operates again, disarmed all the time.
fn comes_back(rig: &mut Rig, what: &str) {
    let mut since_over = 0;
    for _ in 0..LONGEST_HURT_CYCLES {
        let now_ns = rig.cable().now_ns;
        let hurt = rig.cable().bus.is_hurt(now_ns) || rig.cable().down;
        rig.cable().down = false;
        since_over = if hurt { 0 } else { since_over + 1 };
        if since_over > 1 && rig.bridge.phase() == BusPhase::Operate {
            return;
        }
        assert!(since_over <= BACK_WITHIN_CYCLES, "{what}: not back: {:?}", rig.bridge.error());
        rig.step(Some(&off()), false);
        assert!(!rig.bridge.enabled(), "{what}: armed by itself");
    }
    panic!("{what}: hurt for {LONGEST_HURT_CYCLES} cycles");
}

fn suffers(trial: &Trial, what: &str) {
    let mut rig = Rig::new(trial.settings(), drive_file());
    rig.operate(Some(&off()));
    let fault = ride(&mut rig, trial, what);
    let rows = rig.rows();
    no_leap(&rows, what);
    if let Some((_, fault_ns)) = fault {
        stands(&rows, fault_ns, what);
    }
    println!("{what}: {fault:?}");
    // Told to let go, and to let go of what it came from.
    for _ in 0..stops_within_cycles() {
        rig.step(Some(&off()), false);
    }
    comes_back(&mut rig, what);
    let rows = rig.rows();
    no_leap(&rows, what);
    stands(&rows, rows.first().map_or(0, |row| row.host_ns), what);
    // Asked to, after an operator's reset, it goes again.
    rig.step(Some(&off()), true);
    for _ in 0..10 {
        rig.step(Some(&off()), false);
    }
    if trial.never_enables() {
        assert!(fault.is_some(), "{what}: the current never came, and nothing was said");
    } else {
        rig.enabled();
    }
}

/// As many devices seem to answer as there should not be: nothing is brought up, and that is told.
#[test]
fn a_wrong_number_of_devices_is_told_and_left_alone() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    rig.operate(Some(&off()));
    rig.hurt(Hurt::Line(Line::WorkingCounter, 2000));
    for _ in 0..1900 {
        rig.step(Some(&off()), false);
    }
    assert_eq!(rig.bridge.phase(), BusPhase::Wait);
    let error = rig.bridge.error();
    assert!(matches!(error, Some(BringUpError::Count { expected: 1, .. })), "{error:?}");
    let before = rig.bridge.status().bring_ups;
    comes_back(&mut rig, "a wrong number of devices");
    assert_eq!(rig.bridge.status().bring_ups, before + 1, "the first attempt");
    assert_eq!(rig.bridge.error(), None);
}

/// A process that stood still while it looked for the drive has heard nothing meanwhile.
#[test]
fn a_pause_is_no_answer() {
    let mut rig = Rig::new(Settings::default(), drive_file());
    rig.operate(Some(&off()));
    rig.hurt(Hurt::Cable(200 * MS));
    let before = rig.bridge.status().bring_ups;
    while rig.bridge.phase() != BusPhase::Wait {
        rig.step(Some(&off()), false);
    }
    let asked = (1..=60).find(|_| {
        rig.skip(100);
        rig.step(Some(&off()), false);
        rig.bridge.status().bring_ups > before
    });
    assert!(asked.is_some_and(|cycles| cycles >= 50), "after {asked:?} cycles that ran");
}

/// Faults drawn from a seed, in every state of the drive, with an operator who resets and arms again.
#[test]
fn faults_drawn_by_the_hundred() {
    let count: u64 = std::env::var("STEPVALVE_BUS_FAULTS").map_or(200, |text| text.parse().unwrap());
    let seed: u64 = std::env::var("STEPVALVE_SEED").map_or(1, |text| text.parse().unwrap());
    println!("{count} faults from seed {seed}");
    let only: Option<u64> = std::env::var("STEPVALVE_ONLY").ok().map(|text| text.parse().unwrap());
    let mut draw = Draw(seed);
    for number in 0..count {
        let trial = Trial::draw(&mut draw);
        if only.is_none_or(|only| only == number) {
            suffers(&trial, &format!("seed {seed}, fault {number}: {trial:?}"));
        }
    }
}
