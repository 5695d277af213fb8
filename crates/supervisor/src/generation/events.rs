//! What happens while a generation runs: what its processes say, that one dies, and that a recorder is replaced.

use super::{END_PATIENCE, Generation, LOOK_AROUND};
use crate::news::{Event, News};
use processes::{FromChild, Pace, ToChild, complain};
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

    pub(super) fn fail(&mut self, reason: String) {
        self.failure.get_or_insert(reason);
    }
}
