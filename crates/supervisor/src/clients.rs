//! The clients of the control socket: a bounded number of them, of this user alone.

use crate::journal::Peer;
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::Write;
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// More are not connected at once.
const MAX_CLIENTS: usize = 32;

/// A client.
pub(crate) struct Client {
    /// Its connection.
    pub(crate) stream: UnixStream,
    spoke: AtomicBool,
}

impl Client {
    /// It has made its request: from now on it waits for an answer.
    pub(crate) fn has_spoken(&self) {
        self.spoke.store(true, Ordering::Relaxed);
    }

    /// Who it is.
    pub(crate) fn peer(&self) -> Option<Peer> {
        let peer = getsockopt(&self.stream, PeerCredentials).ok()?;
        Some(Peer { uid: peer.uid(), pid: peer.pid() })
    }

    /// Whether nobody waits for an answer any more.
    pub(crate) fn is_gone(&self) -> bool {
        let mut watched = [PollFd::new(&self.stream, PollFlags::empty())];
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        let over = PollFlags::HUP | PollFlags::ERR;
        poll(&mut watched, Some(&now)).is_ok() && watched.iter().any(|end| end.revents().intersects(over))
    }
}

/// All that are connected, the oldest first.
#[derive(Clone, Default)]
pub(crate) struct Clients(Arc<Mutex<Vec<Arc<Client>>>>);

impl Clients {
    /// Takes a client in, unless it is another user's or everybody waits for answers.
    pub(crate) fn welcome(&self, mut stream: UnixStream) -> Option<Arc<Client>> {
        let peer = getsockopt(&stream, PeerCredentials).ok()?.uid();
        let own = nix::unistd::getuid().as_raw();
        if peer != own && peer != 0 {
            refuse(&mut stream, &format!("user {peer} may not control this instance of user {own}"));
            return None;
        }
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() >= MAX_CLIENTS {
            let Some(idle) = all.iter().position(|client| !client.spoke.load(Ordering::Relaxed)) else {
                refuse(&mut stream, &format!("{MAX_CLIENTS} clients wait for answers already"));
                return None;
            };
            // Its thread finds the connection ended.
            let _ = all.remove(idle).stream.shutdown(Shutdown::Both);
        }
        let client = Arc::new(Client { stream, spoke: AtomicBool::new(false) });
        all.push(Arc::clone(&client));
        Some(client)
    }

    /// Lets a client go.
    pub(crate) fn farewell(&self, client: &Arc<Client>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).retain(|one| !Arc::ptr_eq(one, client));
    }
}

/// Says why, as far as the connection takes it without waiting.
fn refuse(stream: &mut UnixStream, why: &str) {
    let answer = serde_json::to_string(&crate::request::Answer::refused(why)).unwrap_or_default();
    let _ = stream.set_nonblocking(true).and_then(|()| stream.write_all(format!("{answer}\n").as_bytes()));
}
