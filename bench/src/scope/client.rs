//! A client of the scope that is no browser: it reads all that it is sent, or nothing.

use anyhow::{Context, Result};
use serde_json::json;
use std::net::TcpStream;
use std::thread::JoinHandle;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// A client.
pub(super) struct Client {
    /// The connection of one that does not read.
    _idle: Option<WebSocket<MaybeTlsStream<TcpStream>>>,
    /// The thread of one that does.
    reading: Option<JoinHandle<()>>,
}

impl Client {
    /// Asks for signals; reads what comes, until the scope ends, or never.
    ///
    /// # Errors
    /// Where it is not let in.
    pub(super) fn connect(page: &str, signals: &[&str], reads: bool) -> Result<Self> {
        let address = page.strip_prefix("http://").context("the page's address")?.replacen("/?", "/ws?", 1);
        let (mut socket, _) = connect(format!("ws://{address}"))?;
        socket.send(Message::text(json!({ "do": "show", "signals": signals }).to_string()))?;
        if !reads {
            return Ok(Self { _idle: Some(socket), reading: None });
        }
        let reading = std::thread::spawn(move || while socket.read().is_ok() {});
        Ok(Self { _idle: None, reading: Some(reading) })
    }

    /// Waits until it has noticed that the scope has ended.
    pub(super) fn end(self) {
        self.reading.map(JoinHandle::join);
    }
}
