//! What changes on the drive's bus, told on stderr beside the cycle.

use crate::aside::Aside;
use ethercat_link::BringUpError;
use signals::BusPhase;
use std::io;

/// The bus's state, and why the last bring-up failed.
type State = (BusPhase, Option<BringUpError>);

/// Tells each change of the bus's state once.
pub(crate) struct BusNews {
    told: State,
    changes: Aside<(State, State)>,
}

impl BusNews {
    /// Begins to tell of the bus at `interface`.
    ///
    /// # Errors
    /// Where the system has no thread for it.
    pub(crate) fn of(interface: String) -> io::Result<Self> {
        let changes = Aside::start("bus-news", move |(before, now)| {
            words(before, now).map(|words| format!("{interface}: {words}"))
        })?;
        Ok(Self { told: (BusPhase::Wait, None), changes })
    }

    /// A healthy bus says nothing in a cycle. Never waits.
    pub(crate) fn tell(&mut self, now: State) {
        if now != self.told {
            let before = std::mem::replace(&mut self.told, now);
            self.changes.tell((before, now));
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
