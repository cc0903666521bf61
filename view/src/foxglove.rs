//! Live data for Foxglove, Lichtblick and PlotJuggler: they look on, and can do nothing else.
//!
//! # Source
//! Foxglove WebSocket protocol, subprotocols `foxglove.sdk.v1` and `foxglove.websocket.v1`: server
//! information, advertisement, subscription and message data.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use recorder::{LiveChannel, live_channels, live_messages, live_text, topic};
use serde::Deserialize;
use serde_json::json;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use crate::source::Board;

/// Where viewers connect.
pub(crate) const PATH: &str = "/foxglove";

/// The subprotocols that are spoken, the best one first.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// How often a viewer gets what is new.
const BEAT: Duration = Duration::from_millis(16);

/// How long a viewer may take none of what is sent.
const STALLED: Duration = Duration::from_secs(5);

/// The longest message of a viewer (bytes).
const LONGEST: usize = 64 << 10;

/// Periods between two messages of the slow topics.
const SLOW: u64 = 10;

/// The subprotocol to answer with, of those that a viewer offers.
pub(crate) fn protocol(offered: Option<&str>) -> Option<&'static str> {
    let offered = offered.unwrap_or_default();
    let speaks = |known: &&str| offered.split(',').any(|word| word.trim() == *known);
    PROTOCOLS.into_iter().find(speaks)
}

/// What a viewer asks for. Whatever else it sends is nothing to us: it may only look.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Wish {
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

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: usize,
}

/// Talks with one viewer until it goes.
pub(crate) fn run(stream: TcpStream, board: &Board, ends: &AtomicBool) {
    // Both can only fail on a connection that is broken: then the first read tells.
    let _ = stream.set_read_timeout(Some(BEAT));
    let _ = stream.set_write_timeout(Some(STALLED));
    let _ = stream.set_nodelay(true);
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    board.periods.enter();
    let mut viewer = Viewer {
        socket: WebSocket::from_raw_socket(stream, Role::Server, Some(config)),
        channels: live_channels(),
        wanted: BTreeMap::new(),
        described: false,
        seen: board.periods.after(0).0,
    };
    let mut sent = Instant::now();
    let mut alive = viewer.greet();
    while alive && !ends.load(Ordering::Acquire) {
        alive = viewer.read();
        if alive && sent.elapsed() >= BEAT {
            sent = Instant::now();
            alive = viewer.describe(board) && viewer.tell(board);
        }
    }
    board.periods.leave();
    // A viewer that has gone reads no farewell.
    let _ = viewer.socket.close(None);
    let _ = viewer.socket.flush();
}

struct Viewer {
    socket: WebSocket<TcpStream>,
    channels: Vec<LiveChannel>,
    /// The viewer's number of each topic that it wants.
    wanted: BTreeMap<&'static str, u32>,
    /// Whether the viewer got the robot that it asked for.
    described: bool,
    seen: u64,
}

impl Viewer {
    /// Says who serves and what there is; whether the viewer took it.
    fn greet(&mut self) -> bool {
        let channel = |(id, channel): (usize, &LiveChannel)| {
            json!({
                "id": id, "topic": channel.topic, "encoding": "cdr", "schemaName": channel.schema,
                "schema": channel.definition, "schemaEncoding": "ros2msg",
            })
        };
        let channels: Vec<_> = self.channels.iter().enumerate().map(channel).collect();
        let hello = json!({
            "op": "serverInfo", "name": "Canter", "capabilities": [], "supportedEncodings": [],
            "metadata": {"version": env!("CARGO_PKG_VERSION")},
        });
        let offer = json!({"op": "advertise", "channels": channels});
        [hello, offer].iter().all(|text| {
            let text = Message::Text(text.to_string().into());
            self.socket.send(text).is_ok()
        })
    }

    /// Reads what came, waiting a moment for it; says whether the viewer is still there.
    fn read(&mut self) -> bool {
        match self.socket.read() {
            Ok(Message::Text(text)) => {
                if let Ok(wish) = serde_json::from_str(text.as_str()) {
                    self.take(wish);
                }
                true
            }
            Ok(Message::Close(_)) => false,
            Ok(_) => true,
            Err(Error::Io(cause)) => {
                matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
            }
            Err(_) => false,
        }
    }

    fn take(&mut self, wish: Wish) {
        match wish {
            Wish::Subscribe { subscriptions } => {
                for subscription in subscriptions {
                    if let Some(channel) = self.channels.get(subscription.channel_id) {
                        self.wanted.insert(channel.topic, subscription.id);
                        self.described &= channel.topic != topic::URDF_TOPIC;
                    }
                }
            }
            Wish::Unsubscribe { subscription_ids } => {
                self.wanted.retain(|_, id| !subscription_ids.contains(id));
            }
            Wish::Other => {}
        }
    }

    /// Sends the robot to whoever has asked for it, as soon as it is known; says whether the viewer
    /// took it.
    fn describe(&mut self, board: &Board) -> bool {
        let id = self.wanted.get(topic::URDF_TOPIC).copied();
        let (Some(id), Some(head), false) = (id, board.periods.head(), self.described) else {
            return true;
        };
        self.described = true;
        self.send(id, head.begin_ns, &live_text(&head.urdf))
    }

    /// Sends the periods that are new; says whether the viewer took them.
    fn tell(&mut self, board: &Board) -> bool {
        let (seen, batches) = board.periods.after(self.seen);
        self.seen = seen;
        for batch in batches {
            let (head, samples) = batch.as_ref();
            for sample in samples {
                let time = head.time_of(sample.tick);
                for (topic, data) in live_messages(head, sample, sample.tick % SLOW == 0) {
                    let Some(id) = self.wanted.get(topic).copied() else {
                        continue;
                    };
                    if !self.send(id, time, &data) {
                        return false;
                    }
                }
            }
        }
        // One system call for all of them.
        self.socket.flush().is_ok()
    }

    /// Sends a message: opcode 1, number of the subscription, time (ns), data.
    fn send(&mut self, id: u32, time_ns: u64, data: &[u8]) -> bool {
        let mut bytes = Vec::with_capacity(13 + data.len());
        bytes.push(1);
        bytes.extend_from_slice(&id.to_le_bytes());
        bytes.extend_from_slice(&time_ns.to_le_bytes());
        bytes.extend_from_slice(data);
        self.socket.write(Message::Binary(bytes.into())).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_protocol_that_both_speak_is_chosen() {
        let offered = "foxglove.websocket.v1, foxglove.sdk.v1";
        assert_eq!(protocol(Some(offered)), Some("foxglove.sdk.v1"));
        assert_eq!(
            protocol(Some("foxglove.websocket.v1")),
            Some("foxglove.websocket.v1")
        );
        assert_eq!((protocol(Some("chat")), protocol(None)), (None, None));
    }

    #[test]
    fn a_viewer_that_wants_to_publish_is_not_heard() {
        let publish = "{\"op\":\"advertise\",\"channels\":[{\"id\":1,\"topic\":\"/cmd\"}]}";
        assert!(matches!(serde_json::from_str(publish), Ok(Wish::Other)));
        let wish = "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":7,\"channelId\":2}]}";
        let Ok(Wish::Subscribe { subscriptions }) = serde_json::from_str(wish) else {
            panic!("no subscription");
        };
        assert_eq!((subscriptions[0].id, subscriptions[0].channel_id), (7, 2));
    }
}
