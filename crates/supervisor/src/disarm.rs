//! Disarming from outside, within a second whatever hangs: straight at the controller, and through the supervisor beside.

use crate::control::{ask, socket_path};
use crate::request::{Answer, Request};
use anyhow::{Context, Result, bail};
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// An operator who wants the valve disarmed knows after this what became of it.
const PATIENCE: Duration = Duration::from_millis(950);
/// How long the supervisor has for it.
const SUPERVISORS_PATIENCE: Duration = Duration::from_millis(750);
/// An operator hears within a second what came of it, whatever is stopped or hung.
const _: () = assert!(PATIENCE.as_millis() < 1000 && SUPERVISORS_PATIENCE.as_millis() < PATIENCE.as_millis());

/// The socket of an instance's controller, on which every connection is a disarm.
pub fn disarm_path(folder: &Path) -> PathBuf {
    folder.join("disarm.sock")
}

/// What one of the two ways came to.
enum Word {
    /// The controller's process is this.
    Controller(i32),
    /// What the controller says, or why it says nothing.
    Straight(Result<Answer>),
    /// What the supervisor says.
    Through(Result<Answer>),
}

/// Disarms an instance by both ways at once; whichever is done first. Takes less than a second. Where neither is done, the
/// answer says what stops the valve instead.
pub fn disarm(folder: &Path) -> Answer {
    let begun = Instant::now();
    let (sender, words) = channel();
    let (straight, control) = (disarm_path(folder), socket_path(folder));
    let through = sender.clone();
    std::thread::spawn(move || {
        let answer = straight_away(&straight, &sender);
        sender.send(Word::Straight(answer))
    });
    std::thread::spawn(move || {
        through.send(Word::Through(ask(&control, &Request::Disarm, SUPERVISORS_PATIENCE)))
    });
    let mut heard = Heard::default();
    while let Ok(word) = words.recv_timeout(PATIENCE.saturating_sub(begun.elapsed())) {
        match word {
            Word::Straight(Ok(answer)) | Word::Through(Ok(answer)) if answer.done => return answer,
            Word::Controller(pid) => heard.controller = Some(pid),
            Word::Straight(answer) => heard.straight = Some(answer),
            Word::Through(answer) => heard.through = Some(answer),
        }
    }
    heard.refusal()
}

/// What was heard of both ways when the time was over.
#[derive(Default)]
struct Heard {
    controller: Option<i32>,
    straight: Option<Result<Answer>>,
    through: Option<Result<Answer>>,
}

impl Heard {
    fn refusal(self) -> Answer {
        let controller = match (&self.straight, self.controller) {
            (Some(Ok(answer)), _) => answer.text.clone(),
            (_, Some(pid)) => format!("the controller (process {pid}) does not answer"),
            (_, None) => "no controller is there".to_owned(),
        };
        let supervisor = match self.through {
            Some(Ok(answer)) => format!("the supervisor says: {}", answer.text),
            _ => "nor does the supervisor answer".to_owned(),
        };
        let by_hand = self.controller.map_or(String::new(), |pid| format!(" (kill -KILL {pid})"));
        Answer::refused(format!(
            "not disarmed within 1 s: {controller}; {supervisor}. What stops the valve instead: the drive's own guard, \
             as soon as the scenario's silence_cycles have gone without a command from the controller, which a stopped or \
             killed controller{by_hand} gives none; and the machine's emergency stop"
        ))
    }
}

fn straight_away(path: &Path, words: &Sender<Word>) -> Result<Answer> {
    let stream = UnixStream::connect(path).with_context(|| path.display().to_string())?;
    let pid = getsockopt(&stream, PeerCredentials)?.pid();
    let _ = words.send(Word::Controller(pid));
    let mut line = String::new();
    BufReader::new(&stream).read_line(&mut line)?;
    if line.is_empty() {
        bail!("{} ended without an answer", path.display());
    }
    Ok(serde_json::from_str(&line)?)
}
