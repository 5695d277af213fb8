//! One client's thread: sends what waits in its mailbox, and does what it asks for.

use crate::foxglove;
use crate::hub::{Hub, View};
use crate::mailbox::Mailbox;
use crate::request::Request;
use recording::Topic;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::json;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// The longest request.
const MOST_REQUEST_BYTES: usize = 64 << 10;
/// A thread looks around at least this often, in seconds.
const LOOK_SECONDS: i64 = 10;

/// Serves a client until it goes.
pub(crate) fn serve(hub: &Hub, stream: TcpStream, foxglove: bool) -> Result<(), Error> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(None)?;
    stream.set_nonblocking(true)?;
    let mailbox = Arc::new(Mailbox::new()?);
    let view = if foxglove { View::Foxglove(BTreeMap::new()) } else { View::Page(BTreeMap::new()) };
    let config = WebSocketConfig::default()
        .max_message_size(Some(MOST_REQUEST_BYTES))
        .max_frame_size(Some(MOST_REQUEST_BYTES));
    let socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    if foxglove {
        foxglove::greetings().iter().for_each(|greeting| mailbox.tell(greeting));
    }
    let Some(id) = hub.join(Arc::clone(&mailbox), view) else { return Ok(()) };
    if !foxglove {
        mailbox.tell(&hub.captures());
    }
    let mut client =
        Client { hub, id, mailbox, socket, subscribed: foxglove.then(BTreeMap::new), unsent: false };
    let ended = client.run();
    hub.leave(id);
    ended
}

struct Client<'a> {
    hub: &'a Hub,
    id: u64,
    mailbox: Arc<Mailbox>,
    socket: WebSocket<TcpStream>,
    /// What a Foxglove viewer subscribed to; `None` for our page.
    subscribed: Option<BTreeMap<Topic, u32>>,
    /// The system's buffer is full: something of the last message is still to be sent.
    unsent: bool,
}

impl Client<'_> {
    fn run(&mut self) -> Result<(), Error> {
        loop {
            self.read()?;
            self.write()?;
            self.wait()?;
        }
    }

    fn wait(&self) -> Result<(), Error> {
        let bell = self.mailbox.bell();
        let mut wanted = PollFlags::IN;
        if self.unsent {
            wanted |= PollFlags::OUT;
        }
        let mut fds = vec![PollFd::new(self.socket.get_ref(), wanted)];
        // While the client takes nothing the bell rings in vain.
        if !self.unsent {
            fds.push(PollFd::new(&bell, PollFlags::IN));
        }
        let patience = Timespec { tv_sec: LOOK_SECONDS, tv_nsec: 0 };
        match poll(&mut fds, Some(&patience)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(Error::Io(error.into())),
        }
        self.mailbox.heard();
        Ok(())
    }

    fn read(&mut self) -> Result<(), Error> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => self.asked(text.as_str()),
                // Pings are answered by the library; a viewer's binary messages would publish something.
                Ok(_) => {}
                Err(error) if is_full(&error) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }

    fn write(&mut self) -> Result<(), Error> {
        self.unsent = !self.sent(|socket| socket.flush())?;
        while !self.unsent
            && let Some(message) = self.mailbox.next()
        {
            self.unsent = !self.sent(|socket| socket.send(message))?;
        }
        Ok(())
    }

    /// Whether all of it went out.
    fn sent(
        &mut self,
        send: impl FnOnce(&mut WebSocket<TcpStream>) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        match send(&mut self.socket) {
            Ok(()) => Ok(true),
            Err(error) if is_full(&error) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn asked(&mut self, text: &str) {
        if let Some(subscribed) = &mut self.subscribed {
            foxglove::obey(subscribed, text).iter().for_each(|answer| self.mailbox.tell(answer));
            self.hub.set_view(self.id, View::Foxglove(subscribed.clone()));
            return;
        }
        let done = match serde_json::from_str::<Request>(text) {
            Ok(request) => self.hub.obey(self.id, request),
            Err(error) => Err(format!("request not understood: {error}")),
        };
        if let Err(text) = done {
            self.mailbox.tell(&json!({ "is": "error", "text": text }));
        }
    }
}

fn is_full(error: &Error) -> bool {
    matches!(error, Error::Io(error) if error.kind() == ErrorKind::WouldBlock)
}
