//! One generation of processes, from its services to its end.

use crate::child::Child;
use crate::disarm::disarm_path;
use crate::instance::{Instance, Whereabouts};
use crate::interruption::Interruption;
use crate::mission::{Ending, Mission, ProcessEnding};
use crate::news::{Asked, Channel, Event, News};
use crate::notify::Pulse;
use crate::progress::Progress;
use crate::recorder_keeper::RecorderKeeper;
use crate::watch::Watch;
use anyhow::{Context, Result, bail};
use closed_loop::{Parts, PlantStart};
use injection::Injection;
use processes::{
    ChildSummary, FromChild, Keep, Membership, ORDER_ID_STEP, Pace, Part, RecorderPart, Task, ToChild,
    complain, segments_in,
};
use realtime::Obtained;
use recording::RecordInfo;
use signal_bus::{Bus, Place, Writer};
use signals::{Feedback, OperatorCommand, OperatorKind, PlantTruth, SetPoint, Source};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};
use thiserror::Error;

/// How long all processes may take to say ready.
const START_PATIENCE: Duration = Duration::from_secs(20);
/// From the last process's ready to cycle 0.
const EPOCH_AHEAD_NS: u64 = 20_000_000;
/// How often the supervisor looks around when nobody says anything.
const LOOK_AROUND: Duration = Duration::from_millis(2);
/// How long a process may take to end once it may.
const END_PATIENCE: Duration = Duration::from_secs(10);
/// Beyond the time that the ramp takes, how long the plant may take to stop.
const STOP_MARGIN: Duration = Duration::from_secs(1);

/// An effect is seen within this: an order must not be obeyed so late that its operator is told it was not.
pub(crate) const SEEN_WITHIN: Duration = Duration::from_millis(10);

const LOOP: [Source; 3] = [Source::Plant, Source::Trajectory, Source::Controller];

/// A process that died before it was ready: that is its fault, not the user's.
#[derive(Debug, Error)]
#[error("{0} ended before it was ready")]
pub struct DiedAtStart(Source);

/// A device that is not the one it should be: wrong input, and nothing runs.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Refused(String);

/// What a generation is started from.
pub struct Setup<'a> {
    /// The run.
    pub mission: &'a Mission,
    /// Its instance.
    pub instance: &'a Instance,
    /// The number of the generation in messages: 0 without a clock, so that recordings are identical.
    pub generation: u64,
    /// Whether the user wants it to end.
    pub interruption: &'a Interruption,
    /// How the generation before left the valve.
    pub left: Option<(Feedback, PlantTruth)>,
}

impl Setup<'_> {
    /// What each process is told. A generation begins where the one before left the valve.
    fn parts(&self) -> Parts {
        let mut parts = self.mission.parts.clone();
        if let Some((feedback, truth)) = &self.left {
            let (microstep_rad, absolute) =
                (parts.plant.drive.microstep_angle_rad, self.mission.absolute_encoder);
            let start = PlantStart::left_by(feedback, truth, microstep_rad, absolute);
            parts.controller.initial_microsteps = start.count_microsteps;
            parts.trajectory.initial_angle_rad = feedback.angle_rad;
            parts.plant.start = start;
        }
        parts
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
    /// How long the client that is attended to waits.
    pub(crate) patience: Duration,
    /// When cycle 0 begins, on CLOCK_MONOTONIC.
    epoch_ns: u64,
    /// What is seen of the loop.
    pub(crate) watch: Watch,
    orders: Writer<OperatorCommand>,
    set_points: Writer<SetPoint>,
    progress: Progress,
    pulse: Pulse,
    interrupted: bool,
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
        setup.instance.announce(&Whereabouts { place: place.clone(), generation })?;
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
            patience: Duration::ZERO,
            epoch_ns: 0,
            watch: Watch::open(&bus, setup.mission.pace, setup.mission.stays)?,
            orders: bus.writer(Source::Supervisor)?,
            set_points: bus.writer(Source::Supervisor)?,
            progress: Progress::new(&setup.mission.parts.timeline),
            pulse: Pulse::new(),
            interrupted: false,
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

    /// Whether nothing speaks for the end yet.
    pub fn goes_on(&self) -> bool {
        let all_done = LOOP.iter().all(|source| self.summaries.contains_key(source));
        !all_done && self.failure.is_none() && !self.setup.interruption.wanted()
    }

    /// Ends the generation in the right order: the valve, the loop, the recorder, the rest. How it ended, and how it left the
    /// valve.
    pub fn end(mut self) -> (Ending, Option<(Feedback, PlantTruth)>) {
        if self.failure.is_none() && self.setup.interruption.wanted() {
            self.interrupted = true;
            self.interrupt();
        }
        if self.failure.is_some() {
            self.wait_for_standstill();
        }
        self.end_loop();
        self.finish_recorder();
        let left = self.watch.valve_left();
        self.end_all();
        (self.ending(), left)
    }

    /// Processes started so far.
    pub fn started(&self) -> u32 {
        self.started
    }

    /// Whether something went wrong for good.
    pub fn failed(&self) -> bool {
        self.failure.is_some()
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

    fn start_all(&mut self) -> Result<()> {
        if self.recorded() {
            self.start_recorder()?;
        }
        for task in loop_tasks(self.setup.mission, &self.setup.parts()) {
            self.start_child(task)?;
        }
        self.wait_until_ready()?;
        self.judge_scheduling()?;
        self.orders.connect();
        self.set_points.connect();
        let epoch_ns = realtime::now_ns() + EPOCH_AHEAD_NS;
        self.epoch_ns = epoch_ns;
        for (source, child) in &mut self.children {
            child.tell(&ToChild::Go { epoch_ns }).map_err(|_| DiedAtStart(*source))?;
        }
        Ok(())
    }

    /// Without a clock a recorder that records nothing has nothing to do: there is no timing to keep either.
    fn recorded(&self) -> bool {
        self.setup.mission.pace == Pace::Realtime || self.setup.mission.keep != Keep::None
    }

    fn start_child(&mut self, task: Task) -> Result<()> {
        let (source, program) = (task.source(), task.program());
        let part = Part {
            membership: Membership {
                place: self.place.clone(),
                generation: self.setup.generation,
                lock: self.setup.instance.members_lock(),
                supervisor: std::process::id(),
            },
            pace: self.setup.mission.pace,
            recorded: self.recorded(),
            timeline: self.setup.mission.parts.timeline,
            timing: self.setup.mission.timings.of(source),
            injections: self.setup.mission.injections.as_ref().map(|all| injections_within(all, source)),
            disarm_socket: (self.setup.mission.stays && source == Source::Controller)
                .then(|| disarm_path(self.setup.instance.folder())),
            task,
        };
        self.started += 1;
        let mut child = Child::start(source, program, self.started, &self.channel.sender())?;
        let told = child.tell(&ToChild::Part(Box::new(part)));
        self.children.insert(source, child);
        told.map_err(|_| DiedAtStart(source).into())
    }

    fn start_recorder(&mut self) -> Result<()> {
        self.recorders.started(Instant::now());
        self.start_child(Task::Recorder(Box::new(RecorderPart {
            folder: self.setup.mission.folder.clone(),
            segment: segments_in(&self.setup.mission.folder).last().map_or(1, |name| name.number + 1),
            first: self.recorders.restarts() == 0,
            keep: self.setup.mission.keep,
            info: RecordInfo { generation: self.setup.generation, ..self.setup.mission.info.clone() },
        })))
    }

    fn wait_until_ready(&mut self) -> Result<()> {
        let begun = Instant::now();
        while self.obtained.len() < self.children.len() {
            self.pulse.beat();
            if begun.elapsed() > START_PATIENCE {
                let silent = self.children.keys().find(|source| !self.obtained.contains_key(source));
                bail!(
                    "{} was not ready within {} s",
                    silent.map_or("?", |source| source.name()),
                    START_PATIENCE.as_secs()
                );
            }
            let event = match self.channel.receiver.recv_timeout(LOOK_AROUND) {
                Ok(News::Child(event)) if self.is_ours(&event) => event,
                Ok(News::Asked(asked)) => {
                    self.asked.push_back(asked);
                    continue;
                }
                _ => continue,
            };
            match event.said {
                Some(FromChild::Ready(obtained)) => drop(self.obtained.insert(event.source, obtained)),
                Some(FromChild::Refused(reason)) => return Err(Refused(reason).into()),
                Some(FromChild::Failed(reason)) => bail!("{}: {reason}", event.source),
                _ => return Err(DiedAtStart(event.source).into()),
            }
        }
        Ok(())
    }

    fn judge_scheduling(&self) -> Result<()> {
        if self.setup.mission.pace == Pace::Lockstep {
            return Ok(());
        }
        let refused: Vec<_> = self
            .obtained
            .iter()
            .flat_map(|(source, obtained)| {
                obtained.refused.iter().map(move |what| format!("{source}: {what}"))
            })
            .collect();
        if refused.is_empty() {
            return Ok(());
        }
        if self.setup.mission.require_realtime {
            bail!("real time is required, and was not obtained:\n  {}", refused.join("\n  "));
        }
        complain("DEGRADED: this run does not have the real-time rights that its scenario asks for:");
        refused.iter().for_each(|what| complain(format_args!("  {what}")));
        Ok(())
    }

    /// Takes what is said, and shows progress.
    pub fn look_around(&mut self) {
        self.pulse.beat();
        match self.channel.receiver.recv_timeout(LOOK_AROUND) {
            Ok(News::Child(event)) => self.take(event),
            Ok(News::Asked(asked)) => self.asked.push_back(asked),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        self.watch.listen();
        self.replace_recorder();
        if let Some(status) = self.watch.status() {
            self.progress.set(status.header.cycle);
        }
    }

    fn is_ours(&self, event: &Event) -> bool {
        self.children.get(&event.source).is_some_and(|child| child.is_origin(event))
    }

    fn take(&mut self, event: Event) {
        if !self.is_ours(&event) {
            return;
        }
        match event.said {
            Some(FromChild::Done(summary)) => drop(self.summaries.insert(event.source, *summary)),
            Some(FromChild::Refused(reason) | FromChild::Failed(reason)) => {
                self.fail(format!("{}: {reason}", event.source))
            }
            Some(FromChild::Ready(obtained)) => self.successor_ready(event.source, obtained),
            Some(FromChild::Saved(saved)) => self.saved = Some(saved),
            None => self.died(event.source),
        }
    }

    /// A recorder that was started while the loop runs needs no epoch.
    fn successor_ready(&mut self, source: Source, obtained: Obtained) {
        self.obtained.insert(source, obtained);
        let told = self.children.get_mut(&source).map(|child| child.tell(&ToChild::Go { epoch_ns: 0 }));
        if let Some(Err(error)) = told {
            self.fail(format!("{error:#}"));
        }
    }

    fn died(&mut self, source: Source) {
        if self.summaries.contains_key(&source) {
            return;
        }
        self.obtained.remove(&source);
        let status = self.children.remove(&source).map(|child| child.end(END_PATIENCE));
        let how = match status {
            Some(Ok(status)) => status.to_string(),
            _ => "unknown".to_owned(),
        };
        if source != Source::Recorder || self.setup.mission.pace == Pace::Lockstep {
            return self.fail(format!("{source} died ({how})"));
        }
        match self.recorders.died(Instant::now()) {
            Some(pause) if pause.is_zero() => {
                complain(format_args!("{source} died ({how}); another takes over with the next segment"));
            }
            Some(pause) => complain(format_args!(
                "{source} died ({how}); another takes over in {} ms with the next segment",
                pause.as_millis()
            )),
            None => complain(format_args!(
                "{source} died ({how}) again and again: NOTHING IS RECORDED ANY MORE, the loop goes on"
            )),
        }
        self.replace_recorder();
    }

    /// Starts a successor of a recorder that died, when its time has come.
    fn replace_recorder(&mut self) {
        if self.recorders.take_due(Instant::now())
            && let Err(error) = self.start_recorder()
        {
            complain(format_args!("{error:#}"));
            self.recorders.died(Instant::now());
        }
    }

    fn fail(&mut self, reason: String) {
        self.failure.get_or_insert(reason);
    }

    /// The user wants an end: the valve is stopped first.
    fn interrupt(&mut self) {
        if self.setup.mission.pace == Pace::Realtime {
            let disarm = OperatorCommand { kind: OperatorKind::Disarm.code(), ..OperatorCommand::default() };
            self.give_order(disarm, self.stop_patience());
            let begun = Instant::now();
            while begun.elapsed() < self.stop_patience() && !self.watch.at_rest() && self.failure.is_none() {
                self.look_around();
            }
        }
    }

    /// A loop process died: the plant's guard, or a controller that lives, notices the silence and stops the valve; only
    /// then the plant ends.
    fn wait_for_standstill(&mut self) {
        let begun = Instant::now();
        while self.setup.mission.pace == Pace::Realtime
            && self.children.contains_key(&Source::Plant)
            && !self.summaries.contains_key(&Source::Plant)
            && begun.elapsed() < self.stop_patience()
            && !self.watch.stands_for_good(self.children.contains_key(&Source::Controller))
        {
            self.look_around();
        }
    }

    /// Ends the loop's cycles, and waits for what its processes have to say.
    fn end_loop(&mut self) {
        for source in LOOP {
            // One that is gone is noticed by its silence.
            let _ = self.tell(source, &ToChild::Stop);
        }
        let begun = Instant::now();
        let running = |this: &Self| {
            LOOP.iter().any(|s| this.children.contains_key(s) && !this.summaries.contains_key(s))
        };
        while running(self) && begun.elapsed() < END_PATIENCE {
            self.look_around();
        }
    }

    /// The silence, the ramp, and a margin.
    pub fn stop_patience(&self) -> Duration {
        let parts = &self.setup.mission.parts;
        let cycles = drive::stop_cycles_bound(&parts.plant.drive);
        Duration::from_nanos(cycles.saturating_mul(parts.timeline.period_ns)) + STOP_MARGIN
    }

    /// The loop's processes still hold their last messages: the recorder takes them and ends.
    fn finish_recorder(&mut self) {
        let begun = Instant::now();
        // Finish is said again to a successor that started meanwhile.
        let mut told = 0;
        while !self.summaries.contains_key(&Source::Recorder) && begun.elapsed() < END_PATIENCE {
            let (started, ready) = (self.started, self.obtained.contains_key(&Source::Recorder));
            match self.children.get_mut(&Source::Recorder) {
                Some(child) if told != started && ready => {
                    let _ = child.tell(&ToChild::Finish);
                    told = started;
                }
                Some(_) => {}
                None => return,
            }
            self.look_around();
        }
    }

    fn end_all(&mut self) {
        for child in self.children.values_mut() {
            let _ = child.tell(&ToChild::Finish);
        }
        for (source, child) in std::mem::take(&mut self.children) {
            self.pulse.beat();
            match child.end(END_PATIENCE) {
                Ok(status) if !status.success() && self.failure.is_none() => {
                    self.fail(format!("{source} ended with {status}"));
                }
                Err(error) => self.fail(format!("{source}: {error:#}")),
                Ok(_) => {}
            }
        }
    }

    fn ending(self) -> Ending {
        let realtime = self.setup.mission.pace == Pace::Realtime;
        let sources = LOOP.into_iter().chain(self.recorded().then_some(Source::Recorder));
        let process = |source: &Source| ProcessEnding {
            scheduling: self.obtained.get(source).filter(|_| realtime).cloned(),
            counts: self.summaries.get(source).cloned(),
        };
        Ending {
            generations: self.setup.generation,
            processes: sources.map(|source| (source.name().to_owned(), process(&source))).collect(),
            published: self.orders.published() + self.set_points.published(),
            interrupted: self.interrupted,
            terminated: false,
            failure: self.failure.clone(),
            recorder_restarts: self.recorders.restarts(),
            recorder_given_up: self.recorders.given_up(),
        }
    }
}

fn loop_tasks(mission: &Mission, parts: &Parts) -> [Task; 3] {
    let plant = match &mission.bridge {
        Some(bridge) => Task::Bridge(Box::new(bridge.clone())),
        None => Task::Plant(Box::new(parts.plant.clone())),
    };
    [
        plant,
        Task::Trajectory(Box::new(parts.trajectory.clone())),
        Task::Controller(Box::new(parts.controller.clone())),
    ]
}

/// The faults that a process carries out itself.
fn injections_within(all: &[Injection], source: Source) -> Vec<Injection> {
    all.iter().filter(|injection| injection.fault.within() == Some(source)).cloned().collect()
}
