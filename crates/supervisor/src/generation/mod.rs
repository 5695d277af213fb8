//! One generation of processes, from its services to its end.

mod begin;
mod end;
mod events;

use crate::angle_doubt::AngleDoubt;
use crate::child::Child;
use crate::instance::{Instance, Whereabouts};
use crate::interruption::Interruption;
use crate::journal::{At, EventKind, Journal, Peer, Transitions};
use crate::mission::Mission;
use crate::news::{Asked, Channel};
use crate::notify::Pulse;
use crate::progress::Progress;
use crate::recorder_keeper::RecorderKeeper;
use crate::request::Request;
use crate::watch::Watch;
use anyhow::{Context, Result};
use closed_loop::Parts;
use processes::{ChildSummary, Keep, ORDER_ID_STEP, Pace, ToChild};
use realtime::Obtained;
use recording::RecordInfo;
use signal_bus::{Bus, Place, Writer};
use signals::{Feedback, OperatorCommand, PlantTruth, SetPoint, Source};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::time::Duration;

/// How often the supervisor looks around when nobody says anything.
const LOOK_AROUND: Duration = Duration::from_millis(2);
/// How long a process may take to end once it may.
const END_PATIENCE: Duration = Duration::from_secs(10);

/// Nobody is called silent sooner.
const LEAST_SILENCE: Duration = Duration::from_millis(50);

/// Time for an order's effect to show on the bus. An order expires this much before its client stops waiting, so that
/// none is carried out after it was reported as refused.
pub(crate) const SEEN_WITHIN: Duration = Duration::from_millis(10);

const LOOP: [Source; 3] = [Source::Plant, Source::Trajectory, Source::Controller];

/// What a generation leaves to the next.
#[derive(Debug, Clone, Copy, Default)]
pub struct Left {
    /// The valve as it was last seen.
    pub valve: Option<(Feedback, PlantTruth)>,
    /// Whether its angle is in doubt.
    pub angle_doubt: AngleDoubt,
}

/// What a generation is started from.
pub struct Setup<'a> {
    /// The run.
    pub mission: &'a Mission,
    /// Where events are noted.
    pub journal: &'a Journal,
    /// Its instance.
    pub instance: &'a Instance,
    /// The number of the generation in messages: 0 without a clock, so that recordings are identical.
    pub generation: u64,
    /// Whether the user wants it to end.
    pub interruption: &'a Interruption,
    /// What the generation before left.
    pub left: Left,
}

/// Which order the loop's changes of state may come from.
#[derive(Debug, Default)]
struct OrdersSeen {
    /// Being carried out.
    now: Option<Request>,
    /// The last one that was done.
    done: Option<Request>,
}

/// A process that says nothing for so long is silent: what the controller grants its partners, but at least what a machine
/// with other guests stalls for now and then.
fn silence(mission: &Mission) -> Duration {
    let granted = mission.parts.plant.drive.silence_cycles.saturating_mul(mission.parts.timeline.period_ns);
    Duration::from_nanos(granted).max(LEAST_SILENCE)
}

impl Setup<'_> {
    /// How often the processes were started, this time too.
    pub fn starts(&self) -> u64 {
        self.generation - self.mission.info.generation + 1
    }

    /// What the generation's record says of itself.
    fn record_info(&self) -> RecordInfo {
        RecordInfo { generation: self.generation, ..self.mission.info.clone() }
    }

    /// What each process is told. A generation begins where the one before left the valve.
    fn parts(&self) -> Parts {
        let mut parts = self.mission.parts.clone();
        parts.controller.zero_in_doubt = self.left.angle_doubt.is_doubted();
        match &self.left.valve {
            Some((feedback, truth)) => parts.left_by(feedback, truth, self.mission.absolute_encoder),
            None => parts,
        }
    }
}

/// A generation under way.
pub struct Generation<'a> {
    setup: &'a Setup<'a>,
    channel: &'a Channel,
    place: Place,
    children: BTreeMap<Source, Child>,
    started: u32,
    recorders: RecorderKeeper,
    obtained: BTreeMap<Source, Obtained>,
    summaries: BTreeMap<Source, ChildSummary>,
    asked: VecDeque<Asked>,
    saved: Option<Result<PathBuf, String>>,
    /// What of the loop was noted already.
    transitions: Transitions,
    /// The order that is being carried out, else the last one that was.
    orders_seen: OrdersSeen,
    /// How long the client that is attended to waits.
    pub(crate) patience: Duration,
    /// When cycle 0 begins, on CLOCK_MONOTONIC.
    epoch_ns: u64,
    /// What is seen of the loop.
    pub(crate) watch: Watch,
    orders: Writer<OperatorCommand>,
    set_points: Writer<SetPoint>,
    /// The last set-point of an operator that the reference followed.
    pub(crate) followed: Option<SetPoint>,
    progress: Progress,
    pulse: Pulse,
    interrupted: bool,
    /// Whether the loop was told to end.
    ends: bool,
    failure: Option<String>,
    // Last, so that ports go before the node that they belong to.
    _bus: Bus,
}

impl<'a> Generation<'a> {
    /// Makes the services, starts the processes, waits until all are ready, and gives the start. `started` counts the
    /// processes that were started before, so that nobody's last words are taken for another's.
    ///
    /// # Errors
    /// Where one can't be started, fails, or doesn't get the scheduling that is required.
    pub fn start(setup: &'a Setup<'a>, channel: &'a Channel, started: u32) -> Result<Self> {
        let generation = setup.generation;
        let place = setup.instance.place(generation)?;
        let bus = Bus::create(&place, generation)?;
        let record = std::path::absolute(&setup.mission.folder)?;
        let info = setup.record_info();
        setup.instance.announce(&Whereabouts { place: place.clone(), generation, record, info })?;
        let mut this = Self {
            setup,
            channel,
            place,
            children: BTreeMap::new(),
            started,
            recorders: RecorderKeeper::default(),
            obtained: BTreeMap::new(),
            summaries: BTreeMap::new(),
            asked: VecDeque::new(),
            saved: None,
            transitions: Transitions::default(),
            orders_seen: OrdersSeen::default(),
            patience: Duration::ZERO,
            epoch_ns: 0,
            watch: Watch::open(
                &bus,
                setup.mission.pace,
                setup.mission.stays,
                silence(setup.mission),
                setup.left.angle_doubt,
            )?,
            orders: bus.writer(Source::Supervisor)?,
            set_points: bus.writer(Source::Supervisor)?,
            followed: None,
            progress: Progress::new(&setup.mission.parts.timeline),
            pulse: Pulse::new(),
            interrupted: false,
            ends: false,
            failure: None,
            _bus: bus,
        };
        let begun = this.start_all();
        if let Err(error) = begun {
            this.end_all();
            return Err(error);
        }
        Ok(this)
    }

    /// True while there is no reason to end.
    pub fn goes_on(&self) -> bool {
        let all_done = LOOP.iter().all(|source| self.summaries.contains_key(source));
        !all_done && self.failure.is_none() && !self.setup.interruption.wanted()
    }

    /// Processes started so far.
    pub fn started(&self) -> u32 {
        self.started
    }

    /// Whether something went wrong for good.
    pub fn failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Notes an event in the journal.
    pub fn note(&self, event: EventKind, text: impl Into<String>) {
        self.note_by(event, None, text);
    }

    /// The same, with whose order it was.
    pub fn note_by(&self, event: EventKind, by: Option<Peer>, text: impl Into<String>) {
        let at = At { generation: self.setup.generation, cycle: self.watch.newest_cycle() };
        self.setup.journal.note_by(at, event, by, text);
    }

    /// The next thing that an operator asked for.
    pub fn next_asked(&mut self) -> Option<Asked> {
        self.asked.pop_front()
    }

    /// What the recorder saved last, once.
    pub fn take_saved(&mut self) -> Option<Result<PathBuf, String>> {
        self.saved.take()
    }

    /// Whether nothing is recorded any more.
    pub fn recorder_given_up(&self) -> bool {
        self.recorders.given_up()
    }

    /// Instance, generation, recorder restarts.
    pub fn names(&self) -> (String, u64, u32) {
        (self.setup.mission.name.to_string(), self.setup.generation, self.recorders.restarts())
    }

    /// The run.
    pub fn mission(&self) -> &Mission {
        self.setup.mission
    }

    /// The cycle that begins after so long, in real time.
    fn cycle_after(&self, time: Duration) -> u64 {
        let since_epoch_ns = realtime::now_ns().saturating_sub(self.epoch_ns) + time.as_nanos() as u64;
        since_epoch_ns / self.setup.mission.parts.timeline.period_ns
    }

    /// Publishes an order that holds so long; its id.
    pub fn give_order(&mut self, order: OperatorCommand, holds: Duration) -> u64 {
        let id = (self.orders.published() + 1) * ORDER_ID_STEP;
        let order = OperatorCommand { id, valid_until_cycle: self.cycle_after(holds), ..order };
        self.orders.write(0, realtime::now_ns(), order);
        id
    }

    /// Publishes a set-point, which holds as long as its operator waits; its id.
    pub fn give_set_point(&mut self, set_point: SetPoint) -> u64 {
        let id = self.set_points.published() + 1;
        let valid_until_cycle = self.cycle_after(self.patience.saturating_sub(SEEN_WITHIN));
        let set_point = SetPoint { id, valid_until_cycle, ..set_point };
        self.set_points.write(0, realtime::now_ns(), set_point);
        id
    }

    /// Whether faults may be injected.
    pub fn allows_injection(&self) -> bool {
        self.setup.mission.injections.is_some()
    }

    /// A child process, while it lives.
    ///
    /// # Errors
    /// Where it is gone.
    pub fn child(&self, source: Source) -> Result<&Child> {
        self.children.get(&source).with_context(|| format!("{source} is gone"))
    }

    /// Tells a child something.
    ///
    /// # Errors
    /// Where it is gone.
    pub fn tell(&mut self, source: Source, order: &ToChild) -> Result<()> {
        self.children.get_mut(&source).with_context(|| format!("{source} is gone"))?.tell(order)
    }

    /// Without a clock a recorder that records nothing has nothing to do: there is no timing to keep either.
    fn recorded(&self) -> bool {
        self.setup.mission.pace == Pace::Realtime || self.setup.mission.keep != Keep::None
    }
}
