//! The controller's own socket for disarming: the shortest way from an operator to the process that stops the valve.
//!
//! It waits behind nothing: not behind the supervisor, nor its clients and pipes, any of which may hang. Whoever connects
//! wants the valve disarmed; there is nothing to say, and one line of JSON comes back. The thread that listens is one of
//! the normal scheduler; the cycle looks at a count.

use crate::side_thread;
use serde_json::json;
use signals::{ControllerState, OperatorCommand, OperatorKind};
use std::fs::Permissions;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// After this a client is told that the valve still moves, so that `stepvalve disarm` answers within a second.
const PATIENCE: Duration = Duration::from_millis(700);
/// How often a waiting client's case is looked at.
const LOOK: Duration = Duration::from_millis(1);
/// More do not wait for an answer at once; what they want is done all the same.
const MAX_WAITING: usize = 16;
/// Bits of the controller's state in the word that the cycle leaves, and the bit among them that says that nothing is heard of the valve.
const STATE_BITS: u32 = 8;
const UNHEARD: u64 = 1 << (STATE_BITS - 1);

/// The supervisor numbers its orders in steps of this. Disarms that come straight to the controller take the numbers
/// between, so that ControlStatus tells which order it was, and a replay knows of them.
pub const ORDER_ID_STEP: u64 = 1 << 16;

/// The order that a disarm which came straight to the controller is, by its id.
pub fn straight_disarm(id: u64) -> OperatorCommand {
    let kind = OperatorKind::Disarm.code();
    OperatorCommand { id, valid_until_cycle: u64::MAX, kind, ..OperatorCommand::default() }
}

/// What the cycle and the thread that listens know of each other.
#[derive(Debug, Default)]
pub(crate) struct DisarmDesk {
    /// Clients so far: each of them wants a disarm.
    asked: AtomicU64,
    /// How many of them the cycle has obeyed, and the state that the controller was in then, in one word.
    obeyed: AtomicU64,
}

impl DisarmDesk {
    /// Listens on a socket of this path. The path never lacks a socket: a new one takes the place of an old one at once.
    pub(crate) fn open(path: &Path) -> io::Result<Arc<Self>> {
        let new = path.with_extension("new");
        let _ = std::fs::remove_file(&new);
        let listener = UnixListener::bind(&new)?;
        std::fs::set_permissions(&new, Permissions::from_mode(0o600))?;
        std::fs::rename(&new, path)?;
        let desk = Arc::new(Self::default());
        let listening = Arc::clone(&desk);
        side_thread::start("disarm", move || listening.listen(&listener))?;
        Ok(desk)
    }

    /// How many clients have wanted a disarm so far; for the cycle.
    pub(crate) fn asked(&self) -> u64 {
        self.asked.load(Ordering::Relaxed)
    }

    /// The cycle has obeyed so many; its controller is in this state, and hears of the valve or not.
    pub(crate) fn obeyed(&self, asked: u64, state: u64, heard: bool) {
        let unheard = if heard { 0 } else { UNHEARD };
        self.obeyed.store(asked << STATE_BITS | unheard | state, Ordering::Relaxed);
    }

    fn listen(&self, listener: &UnixListener) {
        let mut waiting: Vec<Waiting> = Vec::new();
        loop {
            // With nobody waiting this thread sleeps until somebody comes.
            let _ = listener.set_nonblocking(!waiting.is_empty());
            match listener.accept() {
                Ok((client, _)) => waiting.extend(self.receive(client, waiting.len())),
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(LOOK),
                // Out of descriptors, say: that passes.
                Err(_) => std::thread::sleep(LOOK * 10),
            }
            waiting.retain_mut(|one| !self.answer(one));
        }
    }

    /// Takes a client's wish, unless it has gone meanwhile: this process may have been stopped for long.
    fn receive(&self, mut client: UnixStream, waiting: usize) -> Option<Waiting> {
        client.set_nonblocking(true).ok()?;
        let gone = matches!(client.read(&mut [0]), Ok(0));
        if gone {
            return None;
        }
        let number = self.asked.fetch_add(1, Ordering::Relaxed) + 1;
        (waiting < MAX_WAITING).then(|| Waiting { client, number, since: Instant::now() })
    }

    /// Answers a client whose case is clear; whether it was.
    fn answer(&self, waiting: &mut Waiting) -> bool {
        let word = self.obeyed.load(Ordering::Relaxed);
        let obeyed = word >> STATE_BITS >= waiting.number;
        let state = ControllerState::from_code(word & (UNHEARD - 1));
        let heard = word & UNHEARD == 0;
        let late = waiting.since.elapsed() > PATIENCE;
        let (done, text) = match state.filter(|_| obeyed) {
            Some(ControllerState::Disarmed) if heard => (true, "disarmed: the valve stands"),
            Some(ControllerState::Fault) if heard => {
                (true, "the valve stands, stopped by a fault; stepvalve status tells which")
            }
            Some(ControllerState::Disarmed | ControllerState::Fault) if late => (
                false,
                "the command stands, but nothing is heard of the valve: whether it stands is not known; its drive stops it by itself once that \
                 hears no more commands",
            ),
            Some(ControllerState::Disarmed | ControllerState::Fault) => return false,
            Some(_) if late => (false, "disarming, but the valve does not stand yet"),
            None if late => (false, "the controller's cycle does not run"),
            _ => return false,
        };
        // A client that is gone does not take it.
        let _ = writeln!(waiting.client, "{}", json!({"done": done, "text": text}));
        true
    }
}

/// A client that waits for its answer.
struct Waiting {
    client: UnixStream,
    number: u64,
    since: Instant,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};

    fn answer_of(client: UnixStream) -> String {
        let mut line = String::new();
        BufReader::new(client).read_line(&mut line).unwrap();
        line
    }

    #[test]
    fn whoever_connects_is_answered_when_the_cycle_has_obeyed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("disarm.sock");
        let desk = DisarmDesk::open(&path).unwrap();
        let client = UnixStream::connect(&path).unwrap();
        while desk.asked() < 1 {
            std::thread::sleep(LOOK);
        }
        desk.obeyed(1, ControllerState::QuickStop.code(), true);
        std::thread::sleep(LOOK * 5);
        desk.obeyed(1, ControllerState::Disarmed.code(), false);
        std::thread::sleep(LOOK * 5);
        desk.obeyed(1, ControllerState::Disarmed.code(), true);
        assert!(answer_of(client).contains("disarmed: the valve stands"));
        // Of a valve that nothing is heard of nobody says that it stands.
        for (number, state) in [(2, ControllerState::Disarmed), (3, ControllerState::Fault)] {
            let client = UnixStream::connect(&path).unwrap();
            desk.obeyed(number, state.code(), false);
            let answer = answer_of(client);
            assert!(
                answer.contains("whether it stands is not known") && answer.contains("false"),
                "{answer}"
            );
        }
        // A cycle that doesn't run is told in time.
        let client = UnixStream::connect(&path).unwrap();
        assert!(answer_of(client).contains("does not run"));
    }

    #[test]
    fn one_that_has_gone_wants_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("disarm.sock");
        let listener = UnixListener::bind(&path).unwrap();
        drop(UnixStream::connect(&path).unwrap());
        let desk = DisarmDesk::default();
        let (client, _) = listener.accept().unwrap();
        assert!(desk.receive(client, 0).is_none());
        assert_eq!(desk.asked(), 0);
    }
}
