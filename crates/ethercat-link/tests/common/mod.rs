//! The bridge and the simulated drive in one thread, on a cable in memory with a clock of its own.
#![allow(dead_code, reason = "each test uses a part")]

use ethercat_link::{Bridge, BridgeParams, Link, LinkError};
use fieldbus::{DriveFile, Homing, Profile};
use signals::{BusPhase, Feedback, StepCommand};
use subdevice::{Bus, Device, Hurt, Settings, SyncRow, Valve};

pub const PERIOD_NS: u32 = 1_000_000;
pub const SILENCE_CYCLES: u64 = 3;
/// From the main device to the drive, and back, ns.
const ONE_WAY_NS: u64 = 10_000;

/// A cable in memory.
pub struct Cable {
    pub bus: Bus,
    pub now_ns: u64,
    /// The interface takes no frames.
    pub down: bool,
    pub sent: u64,
}

impl Link for Cable {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError> {
        if self.down {
            return Err(LinkError::Down);
        }
        self.sent += 1;
        self.now_ns += ONE_WAY_NS;
        self.bus.send(frame, self.now_ns);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, LinkError> {
        if self.down {
            self.now_ns = self.now_ns.max(until_ns);
            self.bus.advance(self.now_ns);
            return Err(LinkError::Down);
        }
        loop {
            if let Some(reply) = self.bus.receive(self.now_ns) {
                self.now_ns += ONE_WAY_NS;
                buffer[..reply.len()].copy_from_slice(&reply);
                return Ok(Some(reply.len()));
            }
            if self.now_ns >= until_ns {
                return Ok(None);
            }
            let next = self.bus.next_event_ns().unwrap_or(u64::MAX).max(self.now_ns + 1);
            self.now_ns = next.min(until_ns);
            self.bus.advance(self.now_ns);
        }
    }
}

pub fn drive_file() -> DriveFile {
    DriveFile {
        name: "simulated".to_owned(),
        profile: Profile::Cia402Csp,
        vendor: 0x5356,
        product: 0x0402,
        revision_min: 0x0001_0000,
        units_per_rev: 112_500,
        reversed: false,
        position_is_measured: true,
        sync_shift_ns: 0,
        bus_lost_cycles: SILENCE_CYCLES,
        enable_timeout_ns: 2_000_000_000,
        homing: Homing::Absolute { offset: 0 },
        absent: Vec::new(),
        sdos: Vec::new(),
    }
}

pub fn guard() -> drive::Params {
    drive::Params {
        period_s: 1e-3,
        microstep_angle_rad: std::f64::consts::TAU / 112_500.0,
        max_pulse_rate_hz: 600e3,
        max_pulse_acceleration_hz_per_s: 40e6,
        quick_stop_deceleration_hz_per_s: 20e6,
        after_stop: drive::AfterStop::Hold,
        silence_cycles: SILENCE_CYCLES,
        energise_cycles: 0,
        lowest_angle_rad: None,
        highest_angle_rad: None,
        standstill_rad: 1e-3,
    }
}

pub fn valve() -> Valve {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rt-config/models/rig.toml");
    let model = config::parse_model(&std::fs::read_to_string(path).unwrap(), path).unwrap();
    Valve::new(&model, 0.0).unwrap()
}

pub fn params(file: DriveFile, guard: drive::Params) -> BridgeParams {
    BridgeParams::new(file, guard, PERIOD_NS.into(), PERIOD_NS.into()).unwrap()
}

/// A bridge and its drive, cycle by cycle.
pub struct Rig {
    pub bridge: Bridge<Cable>,
    pub cycle: u64,
    epoch_ns: u64,
}

impl Rig {
    pub fn new(settings: Settings, file: DriveFile) -> Self {
        Self::with(vec![Device::new(settings, valve(), 1_000)], file)
    }

    pub fn with(devices: Vec<Device>, file: DriveFile) -> Self {
        Self::over(devices, params(file, guard()))
    }

    pub fn over(devices: Vec<Device>, params: BridgeParams) -> Self {
        let epoch_ns = 5_000_000;
        let cable = Cable { bus: Bus::new(devices), now_ns: epoch_ns, down: false, sent: 0 };
        Self { bridge: Bridge::new(cable, params), cycle: 0, epoch_ns }
    }

    /// Counts cycles from here on anew.
    pub fn begin_anew(&mut self) {
        self.epoch_ns += self.cycle * u64::from(PERIOD_NS);
        self.cycle = 0;
    }

    /// The cycle that a SYNC0 begins.
    pub fn cycle_of(&self, row: &SyncRow) -> i64 {
        let ours_ns = self.epoch_ns.saturating_add_signed(self.bridge.correction_ns());
        let period_ns = i64::from(PERIOD_NS);
        (row.host_ns.cast_signed() - ours_ns.cast_signed() + period_ns / 2).div_euclid(period_ns)
    }

    pub fn cable(&mut self) -> &mut Cable {
        self.bridge.link()
    }

    pub fn hurt(&mut self, hurt: Hurt) {
        let now_ns = self.cable().now_ns;
        self.cable().bus.hurt(hurt, now_ns);
    }

    pub fn device(&mut self) -> &mut Device {
        &mut self.cable().bus.devices()[0]
    }

    pub fn rows(&mut self) -> Vec<SyncRow> {
        self.device().take_rows()
    }

    /// The bridge's process does not run for so many cycles.
    pub fn skip(&mut self, cycles: u64) {
        self.cycle += cycles;
    }

    /// The next cycle.
    pub fn step(&mut self, command: Option<&StepCommand>, reset: bool) -> Option<Feedback> {
        let begin = self.epoch_ns + self.cycle * u64::from(PERIOD_NS);
        let begin = begin.saturating_add_signed(self.bridge.correction_ns());
        let wake = begin + u64::from(PERIOD_NS) / 10;
        let cable = self.cable();
        // Everything happens at its own time; frames that come while nobody waits are there later.
        cable.now_ns = cable.now_ns.max(wake);
        cable.bus.advance(cable.now_ns);
        let feedback = self.bridge.cycle(self.cycle, begin, command, reset);
        self.cycle += 1;
        feedback
    }

    /// Cycles with one command until the bus operates; how many.
    pub fn operate(&mut self, command: Option<&StepCommand>) -> u64 {
        for cycles in 0..20_000 {
            if self.bridge.phase() == BusPhase::Operate {
                return cycles;
            }
            self.step(command, false);
        }
        panic!("not in operation: {:?} {:?}", self.bridge.status(), self.bridge.error());
    }

    /// In operation, and enabled; the last Feedback.
    pub fn enabled(&mut self) -> Feedback {
        self.operate(Some(&off()));
        let mut feedback = None;
        for _ in 0..3000 {
            feedback = self.step(Some(&arming()), false).or(feedback);
            if self.bridge.enabled() {
                return feedback.unwrap();
            }
        }
        panic!("not enabled: {feedback:?}");
    }
}

pub fn off() -> StepCommand {
    StepCommand::default()
}

pub fn arming() -> StepCommand {
    StepCommand { energise: 1, ..StepCommand::default() }
}

pub fn go(position: f64, rate_hz: f64) -> StepCommand {
    StepCommand {
        position_microsteps: position.round() as i64,
        position_unrounded: position,
        pulse_rate_hz: rate_hz,
        follow: 1,
        follow_id: 1,
        energise: 1,
        ..StepCommand::default()
    }
}
