//! The server: accepts clients, reads the bus, saves captures.

use crate::aside::stand_aside;
use crate::block::Block;
use crate::capture::Capture;
use crate::client;
use crate::http::{Door, Verdict, accept, answer, read_head};
use crate::hub::{Hub, SAVED_ALONE};
use crate::observer::Observer;
use crate::page;
use crate::store::Store;
use crate::token::Token;
use serde_json::json;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use supervisor::{Interruption, Whereabouts, whereabouts};

/// How often the bus is looked at: a page that draws 60 times a second sees each time something new.
const LOOK: Duration = Duration::from_millis(4);
/// How often it is asked where the instance's services are.
const ASK: Duration = Duration::from_millis(100);
/// Connections that are being talked to, clients included.
const MOST_CONNECTIONS: usize = 64;

/// What to serve, and where.
#[derive(Debug, Clone)]
pub struct Options {
    /// The instance's folder; `None` to look at captures alone.
    pub instance: Option<PathBuf>,
    /// The cores of the loop's processes, which the server keeps off.
    pub loop_cores: Vec<usize>,
    /// Captures that can be opened, wherever they are.
    pub files: Vec<PathBuf>,
    /// Port on 127.0.0.1; 0 for any that is free.
    pub port: u16,
    /// How much of the past is held.
    pub history: Duration,
    /// Where captures are saved.
    pub folder: PathBuf,
    /// How many captures save themselves.
    pub captures: usize,
    /// Origins of other pages that may connect, with the token.
    pub origins: Vec<String>,
    /// The command line: `PROGRAM convert` makes HDF5 of a capture.
    pub program: PathBuf,
}

/// What keeps the server from being.
#[derive(Debug, thiserror::Error)]
pub enum ScopeError {
    /// The port can't be had.
    #[error("127.0.0.1:{port}: {source}")]
    Port {
        /// Which.
        port: u16,
        /// Why.
        source: std::io::Error,
    },
    /// No random numbers.
    #[error("/dev/urandom: {0}")]
    Random(std::io::Error),
}

/// Where the server is.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The page's address, with its token.
    pub page: String,
    /// The address for Foxglove, Lichtblick and PlotJuggler.
    pub foxglove: String,
}

/// Serves until it is interrupted; `opened` is told where.
///
/// # Errors
/// [`ScopeError`].
pub fn serve(
    options: &Options,
    interruption: &Interruption,
    opened: impl FnOnce(&Opened),
) -> Result<(), ScopeError> {
    // Before there are threads.
    stand_aside(&options.loop_cores);
    let port_error = |source| ScopeError::Port { port: options.port, source };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.port)).map_err(port_error)?;
    let port = listener.local_addr().map_err(port_error)?.port();
    let token = Token::draw().map_err(ScopeError::Random)?;
    let secret = token.as_str().to_owned();
    let door = Arc::new(Door { token, port, origins: options.origins.clone() });
    let store =
        Store::new(options.folder.clone(), options.files.clone(), options.program.clone(), options.captures);
    let (saver, to_save) = channel();
    let hub = Arc::new(Hub::new(store, options.history, saver));
    {
        let hub = Arc::clone(&hub);
        std::thread::spawn(move || accept_all(&hub, &door, &listener));
    }
    {
        let hub = Arc::clone(&hub);
        std::thread::spawn(move || save_all(&hub, &to_save));
    }
    opened(&Opened {
        page: format!("http://127.0.0.1:{port}/?token={secret}"),
        foxglove: format!("ws://127.0.0.1:{port}/?token={secret}"),
    });
    match &options.instance {
        Some(folder) => read_all(&hub, folder, interruption),
        None => {
            hub.detached(SAVED_ALONE);
            while !interruption.wanted() {
                std::thread::sleep(ASK);
            }
        }
    }
    Ok(())
}

/// Reads the instance's generations, one after the other.
fn read_all(hub: &Hub, folder: &Path, interruption: &Interruption) {
    let mut observer: Option<Observer> = None;
    let mut asked: Option<Instant> = None;
    let (mut came, mut lost) = (Block::default(), Vec::new());
    while !interruption.wanted() {
        if asked.is_none_or(|asked| asked.elapsed() >= ASK) {
            asked = Some(Instant::now());
            observer = follow(hub, folder, observer);
        }
        if let Some(joined) = &mut observer {
            came.clear();
            lost.clear();
            let drained = joined.drain(&mut came, &mut lost);
            hub.take(&came, &lost);
            if let Err(error) = drained {
                hub.detached(&error.to_string());
                observer = None;
            }
        }
        std::thread::sleep(LOOK);
    }
}

/// Joins the generation that runs now, if it is another than before.
fn follow(hub: &Hub, folder: &Path, mut observer: Option<Observer>) -> Option<Observer> {
    let now = whereabouts(folder).ok();
    let place = |at: &Whereabouts| (at.place.clone(), at.generation, at.info.started_unix_ns);
    let same = match (&observer, &now) {
        (Some(observer), Some(now)) => place(observer.at()) == place(now),
        (None, None) => true,
        _ => false,
    };
    if same && (observer.is_some() || now.is_none()) {
        if now.is_none() {
            hub.detached("the instance does not run");
        }
        return observer;
    }
    if let Some(old) = &mut observer {
        old.running = false;
    }
    drop(observer);
    match Observer::join(now?) {
        Ok(joined) => {
            hub.attached(joined.at());
            Some(joined)
        }
        Err(error) => {
            hub.detached(&error.to_string());
            None
        }
    }
}

fn accept_all(hub: &Arc<Hub>, door: &Arc<Door>, listener: &TcpListener) {
    let connections = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming().flatten() {
        let (hub, door, connections) = (Arc::clone(hub), Arc::clone(door), Arc::clone(&connections));
        if connections.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
            connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        std::thread::spawn(move || {
            talk(&hub, &door, stream);
            connections.fetch_sub(1, Ordering::Relaxed);
        });
    }
}

fn talk(hub: &Hub, door: &Door, mut stream: TcpStream) {
    static PAGE: OnceLock<String> = OnceLock::new();
    let Some(asked) = read_head(&mut stream) else { return };
    match door.judge(&asked) {
        Verdict::Page => answer(&mut stream, 200, "text/html", PAGE.get_or_init(page::html)),
        Verdict::Refused(status, why) => answer(&mut stream, status, "text/plain", why),
        Verdict::Stay { key, foxglove } => {
            if accept(&mut stream, &key, foxglove).is_ok() {
                // A client that goes, in whatever way, is no failure.
                let _ = client::serve(hub, stream, foxglove);
            }
        }
    }
}

/// Saves captures, one at a time.
fn save_all(hub: &Hub, to_save: &Receiver<Arc<Capture>>) {
    for capture in to_save {
        let saved = hub.store.save(&capture).and_then(|path| {
            hub.tell_pages(&hub.captures());
            hub.store.convert(&path)?;
            Ok(path)
        });
        match saved {
            Ok(path) => {
                let path = path.display().to_string();
                hub.tell_pages(&json!({ "is": "saved", "id": capture.id, "path": path }));
            }
            Err(error) => hub.tell_pages(&json!({ "is": "error", "text": error.to_string() })),
        }
        hub.tell_pages(&hub.captures());
    }
}
