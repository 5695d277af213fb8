//! What changes on the drive's bus, told on stderr by a thread beside the cycle: whoever reads stderr may pause while a valve turns.

use crate::complain::complain;
use crate::side_thread;
use ethercat_link::BringUpError;
use signals::BusPhase;
use std::io;
use std::sync::mpsc::{SyncSender, sync_channel};

/// Changes that wait for a reader of stderr; what comes while so many wait is left out, since `status` tells the newest.
const WAITING: usize = 64;

/// The bus's state, and why the last bring-up failed.
type State = (BusPhase, Option<BringUpError>);

/// Tells each change of the bus's state once.
pub(crate) struct BusNews {
    told: State,
    changes: SyncSender<(State, State)>,
}

impl BusNews {
    /// Begins to tell of the bus at `interface`.
    ///
    /// # Errors
    /// Where the system has no thread for it.
    pub(crate) fn of(interface: String) -> io::Result<Self> {
        let (changes, heard) = sync_channel(WAITING);
        side_thread::start("bus-news", move || {
            for (before, now) in heard {
                if let Some(words) = words(before, now) {
                    complain(format_args!("{interface}: {words}"));
                }
            }
        })?;
        Ok(Self { told: (BusPhase::Wait, None), changes })
    }

    /// A healthy bus says nothing in a cycle. Never waits.
    pub(crate) fn tell(&mut self, now: State) {
        if now != self.told {
            let before = std::mem::replace(&mut self.told, now);
            let _ = self.changes.try_send((before, now));
        }
    }
}

/// What there is to say when the bus goes from one state to another.
fn words(before: State, now: State) -> Option<String> {
    match now {
        (BusPhase::Wait, Some(error)) if before.1 != now.1 => Some(error.to_string()),
        (BusPhase::Operate, _) => Some("the drive is in operation".to_owned()),
        (BusPhase::Wait, _) if before.0 == BusPhase::Operate => {
            Some("the drive is not in operation any more".to_owned())
        }
        _ => None,
    }
}
