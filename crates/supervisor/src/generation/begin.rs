//! The beginning of a generation: its processes are started, say that they are ready, and get the start.

use super::{Generation, LOOK_AROUND};
use crate::child::Child;
use crate::disarm::disarm_path;
use crate::exit::{DiedAtStart, Refused};
use crate::journal::EventKind;
use crate::mission::Mission;
use crate::news::News;
use anyhow::{Result, bail};
use closed_loop::Parts;
use injection::Injection;
use processes::{FromChild, Membership, Pace, Part, RecorderPart, Task, ToChild, segments_in};
use signals::Source;
use std::time::{Duration, Instant};

/// How long all processes may take to say ready.
const START_PATIENCE: Duration = Duration::from_secs(20);
/// From the last process's ready to cycle 0.
const EPOCH_AHEAD_NS: u64 = 20_000_000;

impl Generation<'_> {
    pub(super) fn start_all(&mut self) -> Result<()> {
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

    pub(super) fn start_recorder(&mut self) -> Result<()> {
        self.recorders.started(Instant::now());
        self.start_child(Task::Recorder(Box::new(RecorderPart {
            folder: self.setup.mission.folder.clone(),
            segment: segments_in(&self.setup.mission.folder).last().map_or(1, |name| name.number + 1),
            first: self.recorders.restarts() == 0,
            keep: self.setup.mission.keep,
            info: self.setup.record_info(),
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
        self.note(
            EventKind::Alarm,
            "DEGRADED: this run does not have the real-time rights that its scenario asks for:",
        );
        refused.iter().for_each(|what| self.note(EventKind::Alarm, format!("  {what}")));
        Ok(())
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
