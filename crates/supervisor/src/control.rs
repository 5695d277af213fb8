//! The control socket: how requests of operators come to the supervisor, and answers back.
//!
//! One connection carries one request and one answer, each a line of JSON. A client that dies, says nothing or talks
//! nonsense costs a thread for a few seconds and nothing else. Where too many are connected, those that have said nothing
//! yet have to go, the oldest first, so that idle clients keep nobody out.

use crate::clients::{Client, Clients};
use crate::news::{Asked, News};
use crate::request::{Answer, Ask, Request};
use crate::status::Status;
use anyhow::{Context, Result, bail};
use realtime::now_ns;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

/// No request is longer, in bytes.
const MAX_REQUEST: u64 = 8192;
/// A client must have said all of it within this.
const CLIENT_PATIENCE: Duration = Duration::from_secs(5);
/// The longest that an answer may take: a disarm waits for the valve to stand.
const ANSWER_PATIENCE: Duration = Duration::from_secs(60);

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
    std::thread::spawn(move || {
        let clients = Clients::default();
        for stream in listener.incoming().flatten() {
            let Some(client) = clients.welcome(stream) else { continue };
            let (news, clients) = (news.clone(), clients.clone());
            std::thread::spawn(move || {
                // What goes wrong with a client is the client's loss.
                let _ = attend(&client, &news);
                clients.farewell(&client);
            });
        }
    });
    Ok(())
}

fn attend(client: &Arc<Client>, news: &Sender<News>) -> Result<()> {
    client.stream.set_read_timeout(Some(CLIENT_PATIENCE))?;
    client.stream.set_write_timeout(Some(CLIENT_PATIENCE))?;
    let answer = forward(client, news);
    let mut line = serde_json::to_vec(&answer)?;
    line.push(b'\n');
    Ok((&client.stream).write_all(&line)?)
}

fn forward(client: &Arc<Client>, news: &Sender<News>) -> Answer {
    let mut line = String::new();
    if let Err(error) = BufReader::new((&client.stream).take(MAX_REQUEST)).read_line(&mut line) {
        return Answer::refused(format!("no request: {error}"));
    }
    client.has_spoken();
    let Ask { request, until_ns } = match serde_json::from_str(&line) {
        Ok(ask) => ask,
        Err(error) => return Answer::refused(format!("not a request: {error}")),
    };
    let (answer, answers) = channel();
    if news.send(News::Asked(Asked { request, until_ns, answer, client: Arc::clone(client) })).is_err() {
        return Answer::refused("the instance is ending");
    }
    answers
        .recv_timeout(ANSWER_PATIENCE)
        .unwrap_or_else(|_| Answer::refused("no answer: the instance is ending"))
}

/// Asks a running instance, and waits for its answer as long as `patience`. The request tells how long that is: what
/// could not be done by then is not done later.
///
/// # Errors
/// Where nobody listens on the socket, or no answer comes in time.
pub fn ask(socket: &Path, request: &Request, patience: Duration) -> Result<Answer> {
    let (answer, answers) = channel();
    let (socket, request) = (socket.to_owned(), request.clone());
    let shown = socket.display().to_string();
    // In a thread, since connecting waits too while a supervisor that is stopped has many clients waiting.
    std::thread::spawn(move || answer.send(ask_patiently(&socket, request, patience)));
    match answers.recv_timeout(patience + GRACE) {
        Ok(answer) => answer,
        Err(_) => bail!("{shown}: the supervisor does not answer within {:.1} s", patience.as_secs_f64()),
    }
}

/// How a running instance is.
///
/// # Errors
/// As [`ask`]; and where the answer holds no status.
pub fn ask_status(socket: &Path, patience: Duration) -> Result<Status> {
    let answer = ask(socket, &Request::Status, patience)?;
    Ok(serde_json::from_value(answer.status.with_context(|| answer.text)?)?)
}

/// How long after the request's deadline an answer may still arrive.
const GRACE: Duration = Duration::from_millis(100);

fn ask_patiently(socket: &Path, request: Request, patience: Duration) -> Result<Answer> {
    let until_ns = now_ns() + u64::try_from(patience.as_nanos()).unwrap_or(u64::MAX);
    let mut stream = UnixStream::connect(socket).with_context(|| socket.display().to_string())?;
    let mut line = serde_json::to_vec(&Ask { request, until_ns: Some(until_ns) })?;
    line.push(b'\n');
    stream.write_all(&line)?;
    let mut answer = String::new();
    BufReader::new(&stream).read_line(&mut answer)?;
    if answer.is_empty() {
        bail!("{} ended without an answer", socket.display());
    }
    Ok(serde_json::from_str(&answer)?)
}
