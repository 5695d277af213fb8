//! A bridge in this process, paced as valve-bridge paces it, and the drive's process at the other end.

use crate::programs::beside;
use crate::scenario::repository;
use anyhow::{Context, Result, anyhow, bail};
use closed_loop::wire;
use config::{parse_drive, parse_model, parse_scenario};
use ethercat_link::{Bridge, BridgeParams, PacketLink};
use realtime::{CyclicTimer, Wake, now_ns};
use signals::{BusPhase, Feedback, StepCommand};
use std::path::{Path, PathBuf};
use subdevice::{DriveProcess, NEAR};

/// A cycle, ns.
pub(super) const PERIOD_NS: u64 = 1_000_000;
/// Where the frame goes out in it, ns.
pub(super) const PLACE_NS: u64 = PERIOD_NS / 10;
/// Until when its reply is awaited, ns.
pub(super) const REPLY_NS: u64 = PERIOD_NS * 4 / 10;

/// The first cycle begins so long after the bridge was made, ns.
const LEAD_NS: u64 = 5_000_000;
/// Cycles in which the bus comes to operation, and the drive to current, or never.
const PATIENCE_CYCLES: u64 = 20_000;

/// The model of the valve at the far end.
fn model_path() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

/// The simulated drive.
pub(super) fn drive(arguments: &[&str]) -> Result<DriveProcess> {
    DriveProcess::start(&beside("subdevice")?, &model_path(), arguments).context("subdevice")
}

/// The shipped drive file and scenario, with a bus that counts as lost after so many cycles.
fn params(bus_lost_cycles: u64) -> Result<BridgeParams> {
    let read = |path: &Path| std::fs::read_to_string(path).with_context(|| path.display().to_string());
    let folder = repository().join("rt-config");
    let mut file = parse_drive(&read(&folder.join("drives/simulated.toml"))?, "simulated.toml")
        .map_err(|errors| anyhow!("{errors}"))?;
    let scenario = parse_scenario(&read(&folder.join("scenarios/drive.toml"))?, "drive.toml")
        .map_err(|errors| anyhow!("{errors}"))?;
    let model = parse_model(&read(&model_path())?, "rig.toml").map_err(|errors| anyhow!("{errors}"))?;
    let parts = wire(&scenario, &model, &model)?;
    file.bus_lost_cycles = bus_lost_cycles;
    Ok(BridgeParams::new(file, parts.plant.drive, PERIOD_NS, REPLY_NS)?)
}

/// A bridge and its cycles.
pub(super) struct Ride {
    pub(super) bridge: Bridge<PacketLink>,
    timer: CyclicTimer,
    correction_ns: i64,
}

impl Ride {
    /// Looks at the drive, and begins.
    pub(super) fn start(bus_lost_cycles: u64) -> Result<Self> {
        let mut bridge = Bridge::new(PacketLink::open(NEAR)?, params(bus_lost_cycles)?);
        bridge.check()?;
        let timer = CyclicTimer::new(now_ns() + LEAD_NS, PERIOD_NS, PLACE_NS);
        Ok(Self { bridge, timer, correction_ns: 0 })
    }

    /// The next cycle.
    pub(super) fn step(&mut self, command: &StepCommand, reset: bool) -> (Wake, Option<Feedback>) {
        let wake = self.timer.wait();
        let begin_ns = wake.deadline_ns.saturating_sub(PLACE_NS);
        let feedback = self.bridge.cycle(wake.cycle, begin_ns, Some(command), reset);
        let newest = self.bridge.correction_ns();
        self.timer.steer(std::mem::replace(&mut self.correction_ns, newest));
        (wake, feedback)
    }

    /// Whether the bus operates.
    pub(super) fn operates(&self) -> bool {
        self.bridge.phase() == BusPhase::Operate
    }

    /// Cycles until the bus operates, without current.
    pub(super) fn operate(&mut self) -> Result<()> {
        for _ in 0..PATIENCE_CYCLES {
            if self.operates() {
                return Ok(());
            }
            self.step(&StepCommand::default(), false);
        }
        bail!("the bus does not operate: {:?} {:?}", self.bridge.status(), self.bridge.error())
    }

    /// The same, and then until the drive follows: the position where it stands.
    pub(super) fn enable(&mut self) -> Result<f64> {
        self.operate()?;
        let energise = StepCommand { energise: 1, ..StepCommand::default() };
        for _ in 0..PATIENCE_CYCLES {
            let (_, feedback) = self.step(&energise, false);
            if let (true, Some(feedback)) = (self.bridge.enabled(), feedback) {
                return Ok(feedback.accepted_microsteps as f64);
            }
        }
        bail!("the drive does not follow: {:?} {:?}", self.bridge.status(), self.bridge.error())
    }
}
