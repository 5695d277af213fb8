//! What the supervisor waits for: messages and exits of child processes, requests of operators.

use crate::clients::Client;
use crate::request::{Answer, Request};
use processes::FromChild;
use signals::Source;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Something that a child said, or its end.
pub struct Event {
    /// Who.
    pub source: Source,
    /// Counts the processes started, so that a dead recorder's last words aren't taken for its successor's.
    pub number: u32,
    /// What; `None` when it is dead, as its pidfd says, or will say no more.
    pub said: Option<FromChild>,
}

/// What the supervisor waits for: a child's words, or an operator's wish.
pub enum News {
    /// From a child.
    Child(Event),
    /// From the control socket.
    Asked(Asked),
}

/// A request on its way to the supervisor, with the way back.
pub struct Asked {
    /// What is asked.
    pub request: Request,
    /// Until when the client waits for an effect, on CLOCK_MONOTONIC, ns; `None` for as long as it takes.
    pub until_ns: Option<u64>,
    /// Where the answer goes; a client that is gone doesn't take it.
    pub answer: Sender<Answer>,
    /// Who asks: what nobody waits for any more is not done.
    pub(crate) client: Arc<Client>,
}

/// Where children and operators are heard.
pub struct Channel {
    /// Its entrance.
    sender: Sender<News>,
    /// Its exit.
    pub(crate) receiver: Receiver<News>,
}

impl Channel {
    /// An empty one.
    pub fn new() -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver }
    }

    /// Its entrance.
    pub fn sender(&self) -> Sender<News> {
        self.sender.clone()
    }
}
