//! What the supervisor sees of the loop on the bus: the newest of each message, and who is late or silent.

use crate::angle_doubt::AngleDoubt;
use crate::drive_fault::DriveFault;
use crate::journal::{Seen, advice, reason};
use crate::status::{DriveBus, ProcessStatus, Status};
use anyhow::Result;
use processes::Pace;
use signal_bus::{Bus, CycleReader, Service};
use signals::{
    BusStatus, ControlStatus, ControllerState, FaultCode, Feedback, HeldFlow, HomingPhase, LoopTiming,
    Message, PlantTruth, RecorderProgress, Reference, SetPointKind, Source, alarm, validity,
};
use std::time::{Duration, Instant};

/// A process is reported late for this long after its last overrun.
const LATE_FOR: Duration = Duration::from_secs(10);

/// The recorder tells of itself now and then only: silent after this.
const RECORDER_SILENT_AFTER: Duration = Duration::from_millis(500);

/// The state of a controller that says nothing.
const SILENT: &str = "silent";

/// The newest message that a process sends about itself, and when it came.
struct Heard<B: Service> {
    reader: CycleReader<B>,
    newest: Option<Message<B>>,
    at: Instant,
}

struct Timing {
    source: Source,
    heard: Heard<LoopTiming>,
    late: Option<Instant>,
    latency: Worst,
}

/// The largest of what was seen in this second and in the one before.
struct Worst {
    since: Instant,
    now: u64,
    before: u64,
}

impl Worst {
    fn new() -> Self {
        Self { since: Instant::now(), now: 0, before: 0 }
    }

    fn take(&mut self, value: u64) {
        if self.since.elapsed() > Duration::from_secs(1) {
            *self = Self { before: self.now, ..Self::new() };
        }
        self.now = self.now.max(value);
    }

    fn get(&self) -> u64 {
        self.now.max(self.before)
    }
}

/// Readers of everything that a status is made of. Without a clock nobody asks for one, and each reader costs the loop time:
/// then there is ControlStatus alone, for progress.
pub struct Watch {
    status: Heard<ControlStatus>,
    /// A process that has said nothing for so long is silent.
    silence: Duration,
    feedback: Option<CycleReader<Feedback>>,
    reference: Option<CycleReader<Reference>>,
    truth: Option<CycleReader<PlantTruth>>,
    bus: Option<CycleReader<BusStatus>>,
    recorder: Option<Heard<RecorderProgress>>,
    timing: Vec<Timing>,
    /// Why the plant side stopped the valve by itself.
    drive_fault: DriveFault,
    angle_doubt: AngleDoubt,
}

impl Watch {
    /// Opens them, beside a valve whose angle is in doubt or not.
    ///
    /// # Errors
    /// Where a service can't be read.
    pub fn open(
        bus: &Bus,
        pace: Pace,
        stays: bool,
        silence: Duration,
        angle_doubt: AngleDoubt,
    ) -> Result<Self> {
        let realtime = pace == Pace::Realtime;
        let timed = [Source::Plant, Source::Trajectory, Source::Controller];
        let timing = timed.into_iter().filter(|_| realtime).map(|source| {
            Ok(Timing { source, heard: Heard::open(bus, source)?, late: None, latency: Worst::new() })
        });
        Ok(Self {
            status: Heard::open(bus, Source::Controller)?,
            silence,
            feedback: realtime.then(|| bus.cycle_reader(Source::Plant)).transpose()?,
            reference: realtime.then(|| bus.cycle_reader(Source::Trajectory)).transpose()?,
            // Another plant process is to begin where this one ends.
            truth: stays.then(|| bus.cycle_reader(Source::Plant)).transpose()?,
            bus: realtime.then(|| bus.cycle_reader(Source::Plant)).transpose()?,
            recorder: realtime.then(|| Heard::open(bus, Source::Recorder)).transpose()?,
            timing: timing.collect::<Result<_>>()?,
            drive_fault: DriveFault::NONE,
            angle_doubt,
        })
    }

    /// Takes in what is new of the timing; often enough that nobody counts as silent who is not.
    pub fn listen(&mut self) {
        if let Some(recorder) = &mut self.recorder {
            recorder.listen();
        }
        if let Some(truth) = &mut self.truth {
            truth.latest();
        }
        self.remember_drive_fault();
        if let Some(bus) = &mut self.bus {
            bus.latest();
        }
        for timing in &mut self.timing {
            let lost_before = timing.lost();
            timing.heard.listen();
            let latency_ns = timing.heard.newest.map_or(0, |message| message.body.wake_up_latency_ns);
            timing.latency.take(latency_ns);
            if timing.lost() > lost_before {
                timing.late = Some(Instant::now());
            }
        }
    }

    /// The newest ControlStatus.
    pub fn status(&mut self) -> Option<Message<ControlStatus>> {
        self.status.listen();
        if let Some(status) = self.status.newest.map(|message| message.body)
            && let Some(fault) = FaultCode::from_code(status.fault)
            && let Some(homing) = HomingPhase::from_code(status.homing_phase)
        {
            self.angle_doubt.take(fault, homing);
        }
        self.status.newest
    }

    /// Whether the valve's angle may be wrong by whole steps.
    pub fn angle_doubt(&self) -> AngleDoubt {
        self.angle_doubt
    }

    /// The newest cycle of the controller that was heard of.
    pub fn newest_cycle(&self) -> u64 {
        self.status.newest.map_or(0, |message| message.header.cycle)
    }

    /// For how long the controller has said nothing, where that is too long.
    fn controller_silent_for(&self) -> Option<Duration> {
        self.status.newest.and(Some(self.status.at.elapsed())).filter(|age| *age > self.silence)
    }

    fn remember_drive_fault(&mut self) {
        let plant = self.feedback().and_then(|feedback| {
            Some((feedback.header.cycle, FaultCode::from_code(feedback.body.drive_fault)?))
        });
        let controller = self
            .status
            .newest
            .and_then(|status| Some((status.header.cycle, FaultCode::from_code(status.body.fault)?)));
        self.drive_fault.take(plant, controller);
    }

    /// What the journal compares; `None` before the controller's first word.
    pub fn seen(&mut self) -> Option<Seen> {
        let status = self.status.newest?.body;
        let silent = self.timing.iter().filter(|timing| timing.heard.is_silent(self.silence));
        let silent = silent.map(|timing| timing.source.name()).collect();
        let recorder = self.recorder.as_ref().and_then(|recorder| recorder.newest);
        let reference = self.reference().map(|message| message.body).unwrap_or_default();
        Some(Seen {
            state: ControllerState::from_code(status.state)?,
            fault: FaultCode::from_code(status.fault)?,
            drive_fault: self.drive_fault.fault(),
            fault_cycle: status.fault_cycle,
            alarms: status.alarms,
            held_flow: HeldFlow::from_code(reference.held_flow)?,
            silent,
            recorded: recorder.is_none_or(|progress| progress.body.healthy == 1),
        })
    }

    /// The newest Reference.
    pub fn reference(&mut self) -> Option<Message<Reference>> {
        self.reference.as_mut()?.latest()
    }

    /// The newest Feedback.
    pub fn feedback(&mut self) -> Option<Message<Feedback>> {
        self.feedback.as_mut()?.latest()
    }

    /// How the plant left the valve, by its last messages; `None` where it never said anything.
    pub fn valve_left(&mut self) -> Option<(Feedback, PlantTruth)> {
        let truth = self.truth.as_mut()?.latest()?.body;
        Some((self.feedback()?.body, truth))
    }

    /// Whether the drive says that it stands, and nobody will move it: it stopped by itself, or the controller has come to
    /// rest, if that still lives.
    pub fn stands_for_good(&mut self, controller_lives: bool) -> bool {
        let stopped = validity::STANDSTILL | validity::STOPPED_ITSELF;
        let at_rest = controller_lives && self.at_rest();
        let wanted = if at_rest { validity::STANDSTILL } else { stopped };
        self.feedback().is_some_and(|feedback| feedback.body.validity & wanted == wanted)
    }

    /// Whether the controller hears of the valve, by its last word.
    pub fn hears_the_valve(&self) -> bool {
        self.status.newest.is_some_and(|status| status.body.feedback_silent_cycles == 0)
    }

    /// Whether the controller has come to rest.
    pub fn at_rest(&mut self) -> bool {
        let at_rest = [ControllerState::Disarmed.code(), ControllerState::Fault.code()];
        self.status().is_some_and(|status| at_rest.contains(&status.body.state))
    }

    /// All of it; the caller adds what it alone knows.
    pub fn describe(&mut self) -> Status {
        let newest = self.status();
        let status = newest.map(|message| message.body).unwrap_or_default();
        let silent_for = self.controller_silent_for();
        let state = ControllerState::from_code(status.state).map_or("unknown", ControllerState::name);
        let fault = FaultCode::from_code(status.fault);
        let faulty = fault.filter(|fault| *fault != FaultCode::None);
        let since = newest.map_or(0, |message| message.header.cycle.saturating_sub(status.fault_cycle));
        let heard = self.feedback();
        let feedback = heard.map(|message| message.body).unwrap_or_default();
        let drive_fault = self.drive_fault.fault();
        let reference = self.reference().map(|message| message.body).unwrap_or_default();
        // A recorder that has never said anything is not there: nothing is recorded.
        let recorder_silent = self
            .recorder
            .as_ref()
            .is_some_and(|heard| heard.newest.is_some() && heard.is_silent(RECORDER_SILENT_AFTER));
        let recorder = self.recorder.as_ref().and_then(|recorder| recorder.newest);
        let recorder = recorder.map(|message| message.body).unwrap_or_default();
        Status {
            state: if silent_for.is_some() { SILENT } else { state }.to_owned(),
            last_state: state.to_owned(),
            controller_silent_s: silent_for.map_or(0.0, |silent| silent.as_secs_f64()),
            fault: fault.map_or("unknown", FaultCode::name).to_owned(),
            fault_cycle: status.fault_cycle,
            fault_since_cycles: faulty.map_or(0, |_| since),
            fault_advice: faulty.map_or("", |fault| advice(reason(fault, drive_fault))).to_owned(),
            drive_fault: drive_fault.name().to_owned(),
            set_point: reference.set_point_id,
            set_point_kind: SetPointKind::from_code(reference.set_point_kind)
                .map_or("", SetPointKind::name)
                .to_owned(),
            target_angle_rad: reference.target_angle_rad,
            moving: reference.moving == 1,
            held_flow: HeldFlow::from_code(reference.held_flow).map_or("unknown", HeldFlow::name).to_owned(),
            angle_rad: feedback.angle_rad,
            angle_heard: heard.is_some(),
            homed: feedback.validity & validity::HOMED != 0,
            angle_doubted: self.angle_doubt.is_doubted(),
            energised: feedback.validity & validity::ENERGISED != 0,
            homing: HomingPhase::from_code(status.homing_phase)
                .map_or("unknown", HomingPhase::name)
                .to_owned(),
            alignment_offset_rad: status.alignment_offset_rad,
            alignment_spread_rad: status.alignment_spread_rad,
            following_error_rad: status.following_error_rad,
            following_error_peak_rad: status.following_error_peak_rad,
            torque_reserve_nm: status.torque_reserve_nm,
            limiting: status.limiting != 0,
            alarms: alarm::names(status.alarms).map(str::to_owned).collect(),
            missed_commands: status.missed_commands,
            pulse_rate_hz: feedback.pulse_rate_hz,
            pressure_drop_pa: feedback.pressure_drop_pa,
            oil_temperature_c: feedback.oil_temperature_c,
            bus: self.bus.as_mut().and_then(|bus| bus.latest()).map(|message| DriveBus::new(&message.body)),
            processes: self
                .timing
                .iter()
                .map(|timing| (timing.source.name().to_owned(), process(timing, self.silence)))
                .collect(),
            recorded: recorder.recorded,
            recorder_missed: recorder.missed,
            recorder_healthy: recorder.healthy == 1,
            recorder_silent,
            ..Status::default()
        }
    }
}

impl<B: Service> Heard<B> {
    fn open(bus: &Bus, source: Source) -> Result<Self> {
        Ok(Self { reader: bus.cycle_reader(source)?, newest: None, at: Instant::now() })
    }

    fn listen(&mut self) {
        let newest = self.reader.latest();
        if newest != self.newest {
            (self.newest, self.at) = (newest, Instant::now());
        }
    }

    fn is_silent(&self, silence: Duration) -> bool {
        self.at.elapsed() > silence
    }
}

impl Timing {
    /// Cycles overrun or skipped so far.
    fn lost(&self) -> u64 {
        self.heard.newest.map_or(0, |message| message.body.overruns + message.body.skipped_cycles)
    }
}

fn process(timing: &Timing, silence: Duration) -> ProcessStatus {
    let newest = timing.heard.newest;
    let body = newest.map(|message| message.body).unwrap_or_default();
    ProcessStatus {
        cycle: newest.map_or(0, |message| message.header.cycle),
        overruns: body.overruns,
        skipped_cycles: body.skipped_cycles,
        missed_samples: body.missed_samples,
        wake_up_latency_us: timing.latency.get() as f64 / 1e3,
        late: timing.late.is_some_and(|late| late.elapsed() < LATE_FOR),
        silent: timing.heard.is_silent(silence),
    }
}
