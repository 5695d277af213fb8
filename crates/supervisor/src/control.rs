//! The control socket: what an operator may ask of a running instance, and how it is carried there and back.
//!
//! One connection carries one request and one answer, each a line of JSON. A client that dies, says nothing or talks
//! nonsense costs a thread for a few seconds and nothing else.

use crate::news::{Asked, News};
use crate::request::{Answer, Request};
use anyhow::{Context, Result, bail};
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

/// No request is longer, in bytes.
const MAX_REQUEST: u64 = 8192;
/// A client must have said all of it within this.
const CLIENT_PATIENCE: Duration = Duration::from_secs(5);
/// The longest that an answer may take: a disarm waits for the valve to stand.
const ANSWER_PATIENCE: Duration = Duration::from_secs(60);
/// More clients at once are turned away.
const MAX_CLIENTS: usize = 32;

/// The socket in an instance's folder.
pub fn socket_path(folder: &Path) -> PathBuf {
    folder.join("control.sock")
}

/// Listens on the socket from a thread of its own, and hands every request to the supervisor.
///
/// # Errors
/// Where the socket can't be made.
pub fn serve(folder: &Path, news: Sender<News>) -> Result<()> {
    let path = socket_path(folder);
    // The instance's lock is held: a socket that is there was left by a crash.
    let _ = std::fs::remove_file(&path);
    let listener = UnixListener::bind(&path).with_context(|| path.display().to_string())?;
    let clients = Arc::new(AtomicUsize::new(0));
    std::thread::spawn(move || {
        for client in listener.incoming().flatten() {
            if clients.fetch_add(1, Ordering::Relaxed) >= MAX_CLIENTS {
                clients.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (news, clients) = (news.clone(), Arc::clone(&clients));
            std::thread::spawn(move || {
                // What goes wrong with a client is the client's loss.
                let _ = attend(&client, &news);
                clients.fetch_sub(1, Ordering::Relaxed);
            });
        }
    });
    Ok(())
}

fn attend(client: &UnixStream, news: &Sender<News>) -> Result<()> {
    client.set_read_timeout(Some(CLIENT_PATIENCE))?;
    client.set_write_timeout(Some(CLIENT_PATIENCE))?;
    let peer = getsockopt(client, PeerCredentials)?.uid();
    let own = nix::unistd::getuid().as_raw();
    let answer = if peer == own || peer == 0 {
        forward(client, news)
    } else {
        Answer::refused(format!("user {peer} may not control this instance of user {own}"))
    };
    let mut line = serde_json::to_vec(&answer)?;
    line.push(b'\n');
    let mut client = client;
    Ok(client.write_all(&line)?)
}

fn forward(client: &UnixStream, news: &Sender<News>) -> Answer {
    let mut line = String::new();
    if let Err(error) = BufReader::new(client.take(MAX_REQUEST)).read_line(&mut line) {
        return Answer::refused(format!("no request: {error}"));
    }
    let request = match serde_json::from_str(&line) {
        Ok(request) => request,
        Err(error) => return Answer::refused(format!("not a request: {error}")),
    };
    let (answer, answers) = channel();
    if news.send(News::Asked(Asked { request, answer })).is_err() {
        return Answer::refused("the instance is ending");
    }
    answers
        .recv_timeout(ANSWER_PATIENCE)
        .unwrap_or_else(|_| Answer::refused("no answer: the instance is ending"))
}

/// Asks a running instance.
///
/// # Errors
/// Where nobody listens on the socket, or it ends without an answer.
pub fn ask(socket: &Path, request: &Request) -> Result<Answer> {
    let mut stream = UnixStream::connect(socket).with_context(|| socket.display().to_string())?;
    stream.set_read_timeout(Some(ANSWER_PATIENCE + CLIENT_PATIENCE))?;
    let mut line = serde_json::to_vec(request)?;
    line.push(b'\n');
    stream.write_all(&line)?;
    let mut answer = String::new();
    BufReader::new(&stream).read_line(&mut answer)?;
    if answer.is_empty() {
        bail!("{} ended without an answer", socket.display());
    }
    Ok(serde_json::from_str(&answer)?)
}
