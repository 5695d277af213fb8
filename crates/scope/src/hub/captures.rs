//! Captures: from a window that is complete to a file and to the pages.

use super::{Hub, State, View};
use crate::block::Stored;
use crate::capture::{Capture, Cause};
use crate::frame::{Purpose, append};
use crate::request::Request;
use crate::trigger::{Condition, Machine, Settings, Window};
use recording::Topic;
use serde_json::{Value, json};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// A window is cut when the newest message is so many cycles past its end: References are two cycles ahead, timing one behind.
const MARGIN_CYCLES: u64 = 8;

/// Captures that are held in memory, so that other signals of them can be looked at.
const HELD: usize = 8;
/// Bytes of them together; the newest is held whatever it has.
const HELD_BYTES: usize = 64 << 20;

/// What is captured of a generation that ended, s before its end: what led to it.
const BEFORE_END_S: f64 = 10.0;

/// Why a window is cut.
#[derive(Clone, Copy, PartialEq)]
enum Why {
    /// The trigger came, or was forced.
    Trigger,
    /// A user asked for what the page shows.
    ByHand,
    /// The generation ended.
    Ended,
}

/// A window that waits for its last messages.
pub(super) struct Pending {
    window: Window,
    why: Why,
}

impl Pending {
    pub(super) fn triggered(window: Window) -> Self {
        Self { window, why: Why::Trigger }
    }

    /// The last of a generation whose newest cycle was `to`.
    pub(super) fn ended(to: u64, period_ns: u64) -> Self {
        let before = (BEFORE_END_S * 1e9 / period_ns.max(1) as f64) as u64;
        Self {
            window: Window { trigger: None, zero: to, from: to.saturating_sub(before), to },
            why: Why::Ended,
        }
    }
}

/// The captures that are held.
#[derive(Default)]
pub(super) struct Recent {
    held: VecDeque<Arc<Capture>>,
}

impl Recent {
    fn add(&mut self, capture: Arc<Capture>) {
        self.held.push_back(capture);
        let bytes = |held: &VecDeque<Arc<Capture>>| held.iter().map(|one| one.block.len()).sum::<usize>();
        while self.held.len() > HELD || self.held.len() > 1 && bytes(&self.held) > HELD_BYTES {
            self.held.pop_front();
        }
    }

    fn get(&self, id: u64) -> Option<Arc<Capture>> {
        self.held.iter().find(|capture| capture.id == id).cloned()
    }
}

impl Hub {
    /// Does what a page asks for.
    ///
    /// # Errors
    /// What to tell the page.
    pub(crate) fn obey(&self, client: u64, request: Request) -> Result<(), String> {
        match request {
            Request::Show { signals } => return self.show(client, &signals),
            Request::Trigger { settings } => return self.set_trigger(settings),
            Request::Arm => self.lock().machine()?.arm(),
            Request::Force => {
                let mut state = self.lock();
                let newest = state.history.newest_cycle();
                state.machine()?.force(newest);
            }
            Request::AutoSave { on } => {
                let mut state = self.lock();
                (state.auto_save, state.kept) = (on, self.store.names().len());
            }
            Request::Save { from, to, zero } => return self.save_view(from, to, zero),
            Request::SaveCapture { id } => {
                let mut state = self.lock();
                let capture = state.recent.get(id).ok_or("this capture is not held any more")?;
                self.hand_to_saver(&mut state, capture);
            }
            Request::Samples { id } => {
                let state = self.lock();
                let capture = state.recent.get(id).ok_or("this capture is not held any more")?;
                state.send_capture(client, &capture);
            }
            Request::Open { file } => return self.open(client, &file),
            Request::Ping { t } => {
                let now_us = realtime::now_ns() as f64 / 1e3;
                self.tell(client, &json!({ "is": "pong", "t": t, "us": now_us }));
            }
        }
        self.lock().tell_trigger();
        Ok(())
    }

    fn show(&self, client: u64, names: &[String]) -> Result<(), String> {
        let mut shown = BTreeMap::<Topic, Vec<_>>::new();
        for name in names {
            let signal = self.signals.iter().find(|signal| signal.name == *name);
            let signal = signal.ok_or_else(|| format!("no signal {name:?}"))?;
            shown.entry(signal.topic).or_default().push(signal.field);
        }
        let mut state = self.lock();
        let State { clients, history, .. } = &mut *state;
        if let Some(client) = clients.get_mut(&client) {
            client.view = View::Page(shown);
            client.send_past(history);
        }
        Ok(())
    }

    fn set_trigger(&self, settings: Option<Settings>) -> Result<(), String> {
        let mut state = self.lock();
        state.trigger = match settings {
            None => None,
            Some(settings) => {
                let signal = self.signals.iter().find(|signal| signal.name == settings.signal);
                let signal = signal.ok_or_else(|| format!("no signal {:?}", settings.signal))?.clone();
                let period_ns = state.info.as_ref().map_or(1_000_000, |info| info.period_ns.max(1));
                let held = self.span.as_nanos() as u64 / period_ns;
                settings.check(held).map_err(|error| error.to_string())?;
                let since = state.history.oldest_cycle();
                Some((signal, Machine::new(settings, since)))
            }
        };
        state.tell_trigger();
        Ok(())
    }

    /// Saves what a page shows of the rolling view.
    fn save_view(&self, from: u64, to: u64, zero: u64) -> Result<(), String> {
        let mut state = self.lock();
        let oldest = state.history.oldest_cycle().ok_or("nothing was read yet")?;
        if from > to || to < oldest {
            return Err(format!("cycles {from} to {to} are not held: the oldest is {oldest}"));
        }
        let window = Window { trigger: None, zero, from: from.max(oldest), to };
        state.pending.push(Pending { window, why: Why::ByHand });
        let newest = state.history.newest_cycle();
        self.finish(&mut state, newest);
        Ok(())
    }

    fn open(&self, client: u64, file: &str) -> Result<(), String> {
        // Read without the lock: the loop's messages wait for nobody's disk.
        let id = {
            let mut state = self.lock();
            state.ids += 1;
            state.ids
        };
        let opened = self.store.open(file, id).ok_or_else(|| format!("no capture {file:?}"))?;
        let capture = Arc::new(opened.map_err(|error| error.to_string())?);
        let mut state = self.lock();
        state.recent.add(Arc::clone(&capture));
        if let Some(client) = state.clients.get(&client) {
            client.mailbox.tell(&announced(&capture, Some(file)));
        }
        state.send_capture(client, &capture);
        Ok(())
    }

    /// Cuts the windows whose last messages have come.
    pub(super) fn finish(&self, state: &mut State, newest: u64) {
        let due = |pending: &Pending| newest >= pending.window.to.saturating_add(MARGIN_CYCLES);
        let (done, waiting) = std::mem::take(&mut state.pending).into_iter().partition(due);
        state.pending = waiting;
        let done: Vec<Pending> = done;
        for pending in done {
            let Some(capture) = state.cut(&pending) else { continue };
            let capture = Arc::new(capture);
            state.recent.add(Arc::clone(&capture));
            let ids: Vec<_> = state.clients.keys().copied().collect();
            let by_hand = pending.why == Why::ByHand;
            if !by_hand {
                state.tell_pages(&announced(&capture, None));
                ids.iter().for_each(|id| state.send_capture(*id, &capture));
            }
            if by_hand || state.auto_save && capture.cause.window.trigger.is_some() {
                self.save(state, &capture, by_hand);
            }
        }
    }

    fn save(&self, state: &mut State, capture: &Arc<Capture>, by_hand: bool) {
        let limit = self.store.limit;
        if !by_hand && state.kept >= limit {
            state.auto_save = false;
            let text = format!(
                "{limit} captures are saved: no more are saved by themselves. --captures sets the limit"
            );
            state.tell_pages(&json!({ "is": "error", "text": text }));
            return;
        }
        self.hand_to_saver(state, Arc::clone(capture));
    }

    fn hand_to_saver(&self, state: &mut State, capture: Arc<Capture>) {
        state.kept += 1;
        // The saver ends with the server.
        let _ = self.saver.send(capture);
    }

    fn tell(&self, client: u64, told: &Value) {
        if let Some(client) = self.lock().clients.get(&client) {
            client.mailbox.tell(told);
        }
    }
}

impl State {
    fn machine(&mut self) -> Result<&mut Machine, String> {
        self.trigger.as_mut().map(|(_, machine)| machine).ok_or_else(|| "no trigger is set".to_owned())
    }

    fn cut(&mut self, pending: &Pending) -> Option<Capture> {
        let info = self.info.clone()?;
        let window = pending.window;
        let (block, lost) = self.history.cut(window.from, window.to);
        if block.is_empty() {
            return None;
        }
        self.ids += 1;
        let (word, text) = match (pending.why, &self.trigger) {
            (Why::ByHand, _) => ("view", "what the page showed".to_owned()),
            (Why::Ended, _) => ("ended", format!("the last of generation {}", info.generation)),
            (Why::Trigger, Some((signal, machine))) if window.trigger.is_some() => {
                describe(machine.settings(), signal.unit)
            }
            (Why::Trigger, _) => ("forced", "without a trigger".to_owned()),
        };
        let cause = Cause { word: word.to_owned(), text, window };
        Some(Capture { id: self.ids, cause, info, block, lost })
    }

    /// Sends a page the signals that it looks at.
    fn send_capture(&self, id: u64, capture: &Capture) {
        let Some(client) = self.clients.get(&id) else { return };
        let View::Page(shown) = &client.view else { return };
        for (topic, fields) in shown {
            let rows: Vec<Stored<'_>> =
                capture.block.iter().filter(|stored| stored.topic == *topic).collect();
            let mut out = Vec::new();
            append(&mut out, Purpose::Capture, capture.id as f64, *topic, &rows, fields);
            client.mailbox.send(out, rows.len() as u64);
        }
        client.mailbox.tell(&json!({ "is": "samples", "id": capture.id }));
    }
}

fn announced(capture: &Capture, file: Option<&str>) -> Value {
    let Cause { word, text, window } = &capture.cause;
    let gaps: Vec<_> = capture
        .lost
        .iter()
        .map(|lost| {
            json!({
                "topic": lost.gap.topic as u32, "before_cycle": lost.before_cycle, "lost": lost.gap.missed,
            })
        })
        .collect();
    json!({
        "is": "capture", "id": capture.id, "word": word, "text": text, "window": window, "file": file, "gaps": gaps,
        "instance": capture.info.instance, "title": capture.info.title,
        "generation": capture.info.generation, "period_ns": capture.info.period_ns,
    })
}

/// A word for file names, and a sentence.
fn describe(settings: &Settings, unit: &str) -> (&'static str, String) {
    let signal = &settings.signal;
    let level = |level: f64| {
        let unit = if unit == "1" { "" } else { unit };
        format!("{} {unit}", short(level)).trim_end().to_owned()
    };
    match settings.condition {
        Condition::Edge { level: at, .. } => ("edge", format!("{signal} passed {}", level(at))),
        Condition::Level { level: at, above: true } => ("level", format!("{signal} was above {}", level(at))),
        Condition::Level { level: at, above: false } => {
            ("level", format!("{signal} was below {}", level(at)))
        }
        Condition::Window { low, high, inside: true } => {
            ("window", format!("{signal} came between {} and {}", short(low), level(high)))
        }
        Condition::Window { low, high, inside: false } => {
            ("window", format!("{signal} left {} to {}", short(low), level(high)))
        }
        Condition::Change => ("change", format!("{signal} changed")),
        Condition::Raised => ("raised", format!("{signal} was raised")),
    }
}

/// Four significant digits.
fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
