//! The part of Foxglove's WebSocket protocol (`foxglove.sdk.v1`) that shows messages: Foxglove, Lichtblick and PlotJuggler speak
//! it. Nothing can be published, called or set over it.
//!
//! Source: Foxglove's `ws-protocol`, docs/spec.md: server info, advertise, subscribe, unsubscribe, message data.

use crate::block::Stored;
use recording::{CDR_HEADER, Topic, schema_of};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Opcode of a message's data.
const MESSAGE_DATA: u8 = 1;

/// What a viewer may ask for; anything else is passed over.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Asked {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    #[serde(other)]
    Other,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u64,
}

/// What the server says of itself, then the channels.
pub(crate) fn greetings() -> [Value; 2] {
    let channels: Vec<_> = Topic::ALL
        .iter()
        .map(|topic| {
            let schema = schema_of(*topic);
            json!({
                "id": *topic as u64 + 1, "topic": topic.path(), "encoding": "cdr", "schemaName": schema.name,
                "schema": schema.text, "schemaEncoding": "ros2msg",
            })
        })
        .collect();
    [
        json!({
            "op": "serverInfo", "name": "stepvalve scope", "capabilities": [], "metadata": {}, "sessionId": session(),
        }),
        json!({ "op": "advertise", "channels": channels }),
    ]
}

/// One for as long as this server runs: a viewer that connects again sees whether it is the same.
fn session() -> &'static str {
    static SESSION: OnceLock<String> = OnceLock::new();
    SESSION.get_or_init(|| realtime::now_ns().to_string())
}

/// What is subscribed to after a request; an answer where it can't be followed.
pub(crate) fn obey(subscribed: &mut BTreeMap<Topic, u32>, text: &str) -> Option<Value> {
    let warning = |message: String| Some(json!({ "op": "status", "level": 1, "message": message }));
    match serde_json::from_str(text) {
        Ok(Asked::Subscribe { subscriptions }) => {
            for Subscription { id, channel_id } in subscriptions {
                let topic = Topic::ALL.iter().find(|topic| **topic as u64 + 1 == channel_id);
                let Some(topic) = topic else { return warning(format!("no channel {channel_id}")) };
                subscribed.insert(*topic, id);
            }
            None
        }
        Ok(Asked::Unsubscribe { subscription_ids }) => {
            subscribed.retain(|_, id| !subscription_ids.contains(id));
            None
        }
        Ok(Asked::Other) => warning("this server only shows: subscribe and unsubscribe".to_owned()),
        Err(error) => warning(format!("not understood: {error}")),
    }
}

/// A message for a subscription.
pub(crate) fn data(subscription: u32, row: &Stored<'_>, offset_ns: u64) -> Vec<u8> {
    let mut out = vec![MESSAGE_DATA];
    out.extend_from_slice(&subscription.to_le_bytes());
    out.extend_from_slice(&row.published_ns().saturating_add(offset_ns).to_le_bytes());
    out.extend_from_slice(&CDR_HEADER);
    out.extend_from_slice(row.bytes);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscriptions_come_and_go() {
        let mut subscribed = BTreeMap::new();
        let channel = Topic::Feedback as u64 + 1;
        let ask = format!(r#"{{"op":"subscribe","subscriptions":[{{"id":5,"channelId":{channel}}}]}}"#);
        assert_eq!(obey(&mut subscribed, &ask), None);
        assert_eq!(subscribed, BTreeMap::from([(Topic::Feedback, 5)]));
        assert_eq!(obey(&mut subscribed, r#"{"op":"unsubscribe","subscriptionIds":[5]}"#), None);
        assert_eq!(subscribed, BTreeMap::new());
    }

    #[test]
    fn what_would_change_something_is_refused() {
        for asked in [
            r#"{"op":"advertise","channels":[{"id":1,"topic":"/set_point"}]}"#,
            r#"{"op":"setParameters","parameters":[]}"#,
            r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":999}]}"#,
            "nonsense",
        ] {
            let mut subscribed = BTreeMap::new();
            assert_eq!(obey(&mut subscribed, asked).unwrap()["op"], "status", "{asked}");
            assert!(subscribed.is_empty());
        }
    }
}
