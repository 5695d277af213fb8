//! What each client wants, and is sent.

use crate::block::Stored;
use crate::foxglove;
use crate::frame::{Purpose, append};
use crate::history::{History, Lost};
use crate::mailbox::Mailbox;
use crate::signal::Field;
use recording::Topic;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Clients at the same time.
pub(super) const MOST: usize = 16;

/// What a client looks at.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum View {
    /// Our page: fields by topic.
    Page(BTreeMap<Topic, Vec<Field>>),
    /// A Foxglove viewer: its subscription's number by topic.
    Foxglove(BTreeMap<Topic, u32>),
}

/// A client.
pub(super) struct Client {
    pub(super) mailbox: Arc<Mailbox>,
    pub(super) view: View,
}

impl Client {
    pub(super) fn new(mailbox: Arc<Mailbox>, view: View) -> Self {
        Self { mailbox, view }
    }

    /// Sends what it wants of what came.
    pub(super) fn send(&self, rows: &BTreeMap<Topic, Vec<Stored<'_>>>, lost: &[Lost], offset_ns: u64) {
        match &self.view {
            View::Page(shown) => {
                lost.iter()
                    .filter(|lost| shown.contains_key(&lost.gap.topic))
                    .for_each(|lost| self.tell_lost(lost));
                self.send_live(shown, rows);
            }
            View::Foxglove(subscribed) => {
                for (topic, number) in subscribed {
                    for row in rows.get(topic).into_iter().flatten() {
                        self.mailbox.send(foxglove::data(*number, row, offset_ns), 1);
                    }
                }
            }
        }
    }

    fn tell_lost(&self, lost: &Lost) {
        self.mailbox.tell(&told(lost));
    }

    fn send_live(&self, shown: &BTreeMap<Topic, Vec<Field>>, rows: &BTreeMap<Topic, Vec<Stored<'_>>>) {
        let (mut out, mut count) = (Vec::new(), 0);
        for (topic, fields) in shown {
            let Some(rows) = rows.get(topic) else { continue };
            let newest_ns = rows.iter().map(Stored::published_ns).max().unwrap_or(0);
            append(&mut out, Purpose::Live, newest_ns as f64 / 1e3, *topic, rows, fields);
            count += rows.len() as u64;
        }
        if count > 0 {
            self.mailbox.send(out, count);
        }
    }

    /// Sends the past of what it looks at.
    pub(super) fn send_past(&self, history: &History) {
        let View::Page(shown) = &self.view else { return };
        for (topic, fields) in shown {
            let rows: Vec<_> = history.iter().filter(|stored| stored.topic == *topic).collect();
            let mut out = Vec::new();
            append(&mut out, Purpose::Past, 0.0, *topic, &rows, fields);
            self.mailbox.send(out, rows.len() as u64);
        }
        history
            .lost()
            .filter(|lost| shown.contains_key(&lost.gap.topic))
            .for_each(|lost| self.tell_lost(lost));
    }
}

fn told(lost: &Lost) -> Value {
    json!({
        "is": "gap", "topic": lost.gap.topic as u32, "before_cycle": lost.before_cycle, "lost": lost.gap.missed,
    })
}
