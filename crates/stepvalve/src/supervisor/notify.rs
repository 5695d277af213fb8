//! What systemd wants to hear of a service: that it is ready, and that it is alive.

use std::os::unix::net::UnixDatagram;

/// The processes run.
pub fn ready() {
    send("READY=1");
}

/// The supervisor looks around.
pub fn alive() {
    send("WATCHDOG=1");
}

/// Nothing where no systemd waits for it. A message that gets lost is followed by the next.
fn send(message: &str) {
    if let (Ok(path), Ok(socket)) = (std::env::var("NOTIFY_SOCKET"), UnixDatagram::unbound()) {
        let _ = socket.send_to(message.as_bytes(), path);
    }
}
