//! What the thread that reads the bus and the clients' threads share.

mod captures;
mod clients;

use crate::block::{Block, Stored};
use crate::history::{History, Lost};
use crate::mailbox::Mailbox;
use crate::signal::{Signal, signals};
use crate::store::Store;
use crate::trigger::{Machine, Window};
use captures::{Pending, Recent};
use clients::Client;
pub(crate) use clients::View;
use recording::RecordInfo;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use supervisor::Whereabouts;

use crate::capture::Capture;

/// What is said where no instance is looked at, and none will be.
pub(crate) const SAVED_ALONE: &str = "no instance: saved captures alone";

/// What all threads share.
pub(crate) struct Hub {
    state: Mutex<State>,
    pub(crate) signals: Vec<Signal>,
    pub(crate) store: Store,
    span: Duration,
    saver: Sender<Arc<Capture>>,
}

struct State {
    /// What is read; `None` while nothing is.
    info: Option<RecordInfo>,
    /// Whether its end was noticed.
    ended: bool,
    /// In words, for who comes later.
    source: Value,
    history: History,
    trigger: Option<(Signal, Machine)>,
    /// The trigger's state as it was told last.
    told: Value,
    auto_save: bool,
    /// Captures in the folder when `auto_save` was set, and those handed to the saver since.
    kept: usize,
    pending: Vec<Pending>,
    recent: Recent,
    clients: BTreeMap<u64, Client>,
    ids: u64,
}

impl Hub {
    /// Nothing is read yet. `saver` gets the captures that are to be saved.
    pub(crate) fn new(store: Store, span: Duration, saver: Sender<Arc<Capture>>) -> Self {
        let state = State {
            info: None,
            ended: false,
            source: json!({ "is": "detached", "why": "nothing is read yet" }),
            history: History::new(0),
            trigger: None,
            told: Value::Null,
            auto_save: false,
            kept: 0,
            pending: Vec::new(),
            recent: Recent::default(),
            clients: BTreeMap::new(),
            ids: 0,
        };
        Self { state: Mutex::new(state), signals: signals(), store, span, saver }
    }

    /// A generation is read from now on.
    pub(crate) fn attached(&self, at: &Whereabouts) {
        let mut state = self.lock();
        self.begin_anew(&mut state);
        let cycles = self.span.as_nanos() as u64 / at.info.period_ns.max(1);
        state.history.restart(cycles);
        state.ended = false;
        state.info = Some(RecordInfo { generation: at.generation, ..at.info.clone() });
        state.source = json!({
            "is": "attached", "instance": at.info.instance, "title": at.info.title, "generation": at.generation,
            "period_ns": at.info.period_ns, "record": at.record.display().to_string(), "held_cycles": cycles,
        });
        let source = state.source.clone();
        state.tell_pages(&source);
    }

    /// Nothing is read any more; `why` is for people.
    pub(crate) fn detached(&self, why: &str) {
        let mut state = self.lock();
        let source = json!({ "is": "detached", "why": why, "alone": why == SAVED_ALONE });
        if state.source != source {
            self.begin_anew(&mut state);
            state.source = source;
            let source = state.source.clone();
            state.tell_pages(&source);
        }
    }

    /// What was under way ends with the generation, and its last seconds become a capture.
    fn begin_anew(&self, state: &mut State) {
        let newest = state.history.newest_cycle();
        let read = state.info.as_ref().filter(|_| !state.ended).map(|info| info.period_ns);
        if let Some(period_ns) = read {
            state.ended = true;
            state.pending.push(Pending::ended(newest, period_ns));
        }
        let cut = state.trigger.as_mut().and_then(|(_, machine)| machine.restart(newest));
        state.pending.extend(cut.map(Pending::triggered));
        self.finish(state, u64::MAX);
    }

    /// Takes what came over the bus.
    pub(crate) fn take(&self, came: &Block, lost: &[Lost]) {
        let mut state = self.lock();
        let windows = state.watch(came);
        state.pending.extend(windows.into_iter().map(Pending::triggered));
        state.history.take(came, lost);
        state.send(came, lost);
        let newest = state.history.newest_cycle();
        self.finish(&mut state, newest);
        state.tell_trigger();
    }

    /// A client comes.
    pub(crate) fn join(&self, mailbox: Arc<Mailbox>, view: View) -> Option<u64> {
        let mut state = self.lock();
        if state.clients.len() >= clients::MOST {
            return None;
        }
        state.ids += 1;
        let id = state.ids;
        if let View::Page(_) = view {
            mailbox.tell(&self.hello(&state));
            mailbox.tell(&state.source);
            mailbox.tell(&state.trigger_told());
        }
        state.clients.insert(id, Client::new(mailbox, view));
        Some(id)
    }

    /// It goes.
    pub(crate) fn leave(&self, id: u64) {
        self.lock().clients.remove(&id);
    }

    /// What a Foxglove viewer asks for.
    pub(crate) fn set_view(&self, id: u64, view: View) {
        if let Some(client) = self.lock().clients.get_mut(&id) {
            client.view = view;
        }
    }

    /// Tells all pages something.
    pub(crate) fn tell_pages(&self, told: &Value) {
        self.lock().tell_pages(told);
    }

    /// The list of saved captures, for pages.
    pub(crate) fn captures(&self) -> Value {
        let folder = self.store.folder().display().to_string();
        json!({ "is": "captures", "folder": folder, "limit": self.store.limit, "list": self.store.list(), "open": self.store.first() })
    }

    fn hello(&self, state: &State) -> Value {
        json!({
            "is": "hello", "version": env!("CARGO_PKG_VERSION"), "signals": self.signals,
            "history_s": self.span.as_secs_f64(), "auto_save": state.auto_save,
        })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Shows the trigger its signal's samples; the windows that are complete.
    fn watch(&mut self, came: &Block) -> Vec<Window> {
        let Some((signal, machine)) = &mut self.trigger else { return Vec::new() };
        let mine = came.iter().filter(|stored| stored.topic == signal.topic);
        mine.filter_map(|stored| machine.step(stored.cycle, signal.field.value(stored.bytes))).collect()
    }

    fn trigger_told(&self) -> Value {
        let (settings, state) = match &self.trigger {
            Some((_, machine)) => (json!(machine.settings()), json!(machine.state())),
            None => (Value::Null, json!({ "state": "off" })),
        };
        json!({ "is": "trigger", "settings": settings, "at": state, "auto_save": self.auto_save })
    }

    /// Tells how the trigger is, where that is news.
    fn tell_trigger(&mut self) {
        let told = self.trigger_told();
        if told != self.told {
            self.tell_pages(&told);
            self.told = told;
        }
    }

    fn tell_pages(&self, told: &Value) {
        for client in self.clients.values().filter(|client| matches!(client.view, View::Page(_))) {
            client.mailbox.tell(told);
        }
    }

    /// Sends to each client what it wants of what came.
    fn send(&self, came: &Block, lost: &[Lost]) {
        let rows: BTreeMap<_, Vec<Stored<'_>>> = came.iter().fold(BTreeMap::new(), |mut rows, stored| {
            rows.entry(stored.topic).or_insert_with(Vec::new).push(stored);
            rows
        });
        let offset_ns = self.info.as_ref().and_then(|info| info.unix_offset_ns).unwrap_or(0);
        for client in self.clients.values() {
            client.send(&rows, lost, offset_ns);
        }
    }
}
