//! What happens while a generation runs: what its processes say, that one dies, and that a recorder is replaced.

use super::{END_PATIENCE, Generation, LOOK_AROUND};
use crate::journal::EventKind;
use crate::news::{Event, News};
use crate::request::Request;
use processes::{FromChild, Pace, ToChild};
use realtime::Obtained;
use signals::Source;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Instant;

impl Generation<'_> {
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
        self.note_transitions();
    }

    /// Notes what has changed in the loop since the last look.
    fn note_transitions(&mut self) {
        // A run that ends by itself tells of its faults in its summary.
        let seen = if self.setup.mission.stays { self.watch.seen() } else { None };
        let Some(mut seen) = seen else { return };
        if self.ends {
            // Processes that were told to end fall silent, and one that died is not heard again: what was said stays.
            seen.silent = self.transitions.silent();
        }
        let order = self.orders_seen.now.as_ref().or(self.orders_seen.done.as_ref());
        for (event, text) in self.transitions.look(seen, order) {
            self.note(event, text);
        }
    }

    /// An order is being carried out.
    pub(crate) fn order_begins(&mut self, request: &Request) {
        self.orders_seen.now = Some(request.clone());
    }

    /// It was carried out, or refused.
    pub(crate) fn order_ends(&mut self, done: bool) {
        let request = self.orders_seen.now.take();
        if done {
            self.orders_seen.done = request;
        }
    }

    pub(super) fn is_ours(&self, event: &Event) -> bool {
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
                self.note(
                    EventKind::Record,
                    format!("{source} died ({how}); another takes over with the next segment"),
                );
            }
            Some(pause) => self.note(
                EventKind::Record,
                format!(
                    "{source} died ({how}); another takes over in {} ms with the next segment",
                    pause.as_millis()
                ),
            ),
            None => self.note(
                EventKind::Record,
                format!(
                    "{source} died ({how}) again and again: NOTHING IS RECORDED ANY MORE, the loop goes on"
                ),
            ),
        }
        self.replace_recorder();
    }

    /// Starts a successor of a recorder that died, when its time has come.
    fn replace_recorder(&mut self) {
        if self.recorders.take_due(Instant::now())
            && let Err(error) = self.start_recorder()
        {
            self.note(EventKind::Record, format!("{error:#}"));
            self.recorders.died(Instant::now());
        }
    }

    pub(super) fn fail(&mut self, reason: String) {
        self.failure.get_or_insert(reason);
    }
}
