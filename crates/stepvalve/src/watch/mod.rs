//! `stepvalve watch`: a running instance on the terminal, ten times a second. It looks only: nothing it does moves the valve.

mod draw;
mod view;

use crate::operator::{Plain, find};
use anyhow::{Context, anyhow};
use crossterm::event::{Event, KeyCode, KeyEventKind, KeyModifiers, poll, read};
use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal, Seek, SeekFrom, stdout};
use std::path::Path;
use std::time::{Duration, Instant};
use supervisor::{Entry, Failure, Interruption, Outcome, ask_status, journal_path, socket_path, whereabouts};
use view::View;

/// How often it looks.
const LOOK: Duration = Duration::from_millis(100);
/// How long an instance may take to answer before the view says that it does not.
const PATIENCE: Duration = Duration::from_millis(500);
/// How much of the journal's end is read at first, in bytes: more than the events that fit on a screen.
const JOURNAL_TAIL: i64 = 16 << 10;

/// Shows the instance until q, Esc or Ctrl-C.
///
/// # Errors
/// [`Failure::Input`] where there is no such instance, or no terminal.
pub fn run(arguments: &Plain) -> Result<Outcome, Failure> {
    let socket = find(&arguments.which)?;
    if !stdout().is_terminal() {
        return Err(Failure::Input(anyhow!("watch needs a terminal; stepvalve status --watch prints lines")));
    }
    let (columns, rows) = crossterm::terminal::size().context("the terminal").map_err(Failure::Failed)?;
    if columns == 0 || rows == 0 {
        return Err(Failure::Input(anyhow!(
            "the terminal says that it has {columns} columns and {rows} rows; stty cols 80 rows 24 sets them"
        )));
    }
    let interruption = Interruption::watch()?;
    let folder = socket.parent().unwrap_or(Path::new("/")).to_owned();
    // Restores the terminal on a panic too.
    let mut terminal = ratatui::try_init().context("the terminal").map_err(Failure::Failed)?;
    let shown = show(&mut terminal, &folder, &interruption);
    ratatui::restore();
    shown.map_err(Failure::Failed)?;
    Ok(Outcome::Done)
}

fn show(
    terminal: &mut ratatui::DefaultTerminal,
    folder: &Path,
    interruption: &Interruption,
) -> Result<(), anyhow::Error> {
    let mut view = View::default();
    let mut journal = Journal::default();
    while !interruption.wanted() {
        let begun = Instant::now();
        match ask_status(&socket_path(folder), PATIENCE) {
            Ok(status) => view.take(status),
            Err(error) => view.unanswered(format!("{error:#}")),
        }
        view.take_events(journal.news(folder));
        terminal.draw(|frame| draw::draw(frame, &view))?;
        while poll(LOOK.saturating_sub(begun.elapsed()))? {
            if let Event::Key(key) = read()?
                && key.kind == KeyEventKind::Press
                && (matches!(key.code, KeyCode::Char('q') | KeyCode::Esc)
                    || (key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL)))
            {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// The end of the instance's journal.
#[derive(Default)]
struct Journal {
    file: Option<BufReader<File>>,
}

impl Journal {
    /// What was noted since the last look.
    fn news(&mut self, folder: &Path) -> Vec<Entry> {
        let Some(file) = self.file.as_mut() else {
            self.file = open(folder);
            return Vec::new();
        };
        let mut entries = Vec::new();
        let mut line = String::new();
        while file.read_line(&mut line).is_ok_and(|bytes| bytes > 0) {
            // The first line may be cut.
            entries.extend(serde_json::from_str(&line));
            line.clear();
        }
        entries
    }
}

fn open(folder: &Path) -> Option<BufReader<File>> {
    let mut file = File::open(journal_path(&whereabouts(folder).ok()?.record)).ok()?;
    // A shorter one is read from its beginning.
    let _ = file.seek(SeekFrom::End(-JOURNAL_TAIL));
    Some(BufReader::new(file))
}
