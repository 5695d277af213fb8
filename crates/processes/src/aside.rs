//! What a process of the loop says on stderr while it runs, by a thread beside it: whoever reads stderr may pause while a valve turns.

use crate::complain::complain;
use crate::side_thread;
use std::io;
use std::sync::mpsc::{SyncSender, sync_channel};

/// What waits for a reader of stderr; what comes while so much waits is left out, since `status` tells the newest.
const WAITING: usize = 64;

/// Where to say it. Lines that wait at the process's end may be lost.
pub(crate) struct Aside<T>(SyncSender<T>);

impl<T: Send + 'static> Aside<T> {
    /// `words` makes a line of what is told, or none, in the thread.
    ///
    /// # Errors
    /// Where the system has no thread for it.
    pub(crate) fn start(
        name: &str,
        words: impl Fn(T) -> Option<String> + Send + 'static,
    ) -> io::Result<Self> {
        let (news, heard) = sync_channel(WAITING);
        side_thread::start(name, move || heard.into_iter().filter_map(words).for_each(complain))?;
        Ok(Self(news))
    }

    /// Never waits.
    pub(crate) fn tell(&self, news: T) {
        let _ = self.0.try_send(news);
    }
}

/// Where a process says what went wrong. Its thread begins with the first complaint, so that most processes have none.
#[derive(Default)]
pub(crate) struct Complaints(Option<Aside<String>>);

impl Complaints {
    /// Never waits. Nothing is said where the system has no thread for it.
    pub(crate) fn tell(&mut self, complaint: String) {
        if self.0.is_none() {
            self.0 = Aside::start("complaints", Some).ok();
        }
        if let Some(aside) = &self.0 {
            aside.tell(complaint);
        }
    }
}
