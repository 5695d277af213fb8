//! The end of a generation, in the right order: the valve, the loop, the recorder, the rest.

use super::{END_PATIENCE, Generation, LOOP, Left};
use crate::angle_doubt::AngleDoubt;
use crate::journal::EventKind;
use crate::mission::{Ending, ProcessEnding};
use processes::{Pace, ToChild};
use recording::INTERRUPTED;
use signals::{OperatorCommand, OperatorKind, Source};
use std::time::{Duration, Instant};

/// Beyond the time that the ramp takes, how long the plant may take to stop.
const STOP_MARGIN: Duration = Duration::from_secs(1);

impl Generation<'_> {
    /// Ends the generation in the right order: the valve, the loop, the recorder, the rest. How it ended, and what it left.
    pub fn end(mut self) -> (Ending, Left) {
        if self.failure.is_none() && self.setup.interruption.wanted() {
            self.interrupted = true;
            self.interrupt();
        }
        if self.failure.is_some() {
            self.wait_for_standstill();
            self.tell_where_it_stands();
        }
        self.end_loop();
        if self.interrupted && !self.setup.mission.stays {
            // Nobody would see it in a record that just ends; without a recorder there is none.
            let _ = self.tell(Source::Recorder, &ToChild::Mark(INTERRUPTED.to_owned()));
        }
        self.finish_recorder();
        let angle_doubt = AngleDoubt::left(self.watch.angle_doubt().is_doubted());
        let left = Left { valve: self.watch.valve_left(), angle_doubt };
        self.end_all();
        (self.ending(), left)
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

    /// Whoever reads of a death wants to know first what became of the valve.
    fn tell_where_it_stands(&mut self) {
        let Some(feedback) = self.watch.feedback().map(|message| message.body) else { return };
        let stands = self.watch.stands_for_good(self.children.contains_key(&Source::Controller));
        let how = if stands { "the valve has been stopped: it stands" } else { "the valve was last seen" };
        self.note(EventKind::Process, format!("{how} at {:.3}°", feedback.angle_rad.to_degrees()));
    }

    /// Ends the loop's cycles, and waits for what its processes have to say.
    fn end_loop(&mut self) {
        self.ends = true;
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

    pub(super) fn end_all(&mut self) {
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
            generations: self.setup.starts(),
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
