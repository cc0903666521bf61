//! The WebSocket of one page.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use serde_json::json;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, Utf8Bytes, WebSocket};

use crate::Access;
use crate::freshness::Freshness;
use crate::request::{Service, Wisher};
use crate::source::{Board, Seen};

/// How often a page gets what is new.
const BEAT: Duration = Duration::from_millis(16);

/// How long a page may take none of what is sent: it has gone or stands still.
const STALLED: Duration = Duration::from_secs(2);

/// The longest message of a page (bytes).
const LONGEST: usize = 5 << 20;

/// Talks with one page until it goes.
pub(crate) fn run(
    stream: TcpStream,
    (page, access): (u64, Access),
    (board, service): (&Board, &Service),
    ends: &AtomicBool,
) {
    // Both can only fail on a connection that is broken: then the first read tells.
    let _ = stream.set_read_timeout(Some(BEAT));
    let _ = stream.set_write_timeout(Some(STALLED));
    let _ = stream.set_nodelay(true);
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    let (later, done) = channel();
    let wisher = Wisher {
        page,
        access,
        later,
        freshness: Freshness::new(),
    };
    let mut seen = Seen::from_now(board);
    let may_move = access == Access::Hand;
    let hello = json!({
        "is": "hello", "page": page, "may_move": may_move && service.engine.is_some(),
        "replay": service.player.is_some(), "version": env!("CARGO_PKG_VERSION"),
    });
    let mut talk = Talk {
        socket: &mut socket,
        hand: u64::MAX,
    };
    let mut alive = talk.text(&hello.to_string());
    let mut sent = Instant::now();
    while alive && !ends.load(Ordering::Acquire) {
        alive = talk.read(&wisher, service);
        if alive && sent.elapsed() >= BEAT {
            sent = Instant::now();
            while let Ok(text) = done.try_recv() {
                alive &= talk.text(&text);
            }
            alive = alive && talk.tell_hand(service) && talk.tell_news(board, &mut seen);
        }
    }
    service.release(page);
    // A page that has gone reads no farewell.
    let _ = socket.close(None);
    let _ = socket.flush();
}

/// One side of the talk.
struct Talk<'a> {
    socket: &'a mut WebSocket<TcpStream>,
    /// Who had the hand when the page was told last.
    hand: u64,
}

impl Talk<'_> {
    /// Reads what came, waiting a moment for it; says whether the page is still there.
    fn read(&mut self, wisher: &Wisher, service: &Service) -> bool {
        match self.socket.read() {
            Ok(Message::Text(text)) => {
                let answer = service.fulfil(wisher, text.as_str());
                self.text(&answer.to_string())
            }
            Ok(Message::Close(_)) => false,
            Ok(_) => true,
            Err(Error::Io(cause)) => {
                matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
            }
            Err(_) => false,
        }
    }

    /// Sends a text; says whether the page took it.
    fn text(&mut self, text: &str) -> bool {
        self.socket
            .send(Message::Text(Utf8Bytes::from(text)))
            .is_ok()
    }

    fn tell_hand(&mut self, service: &Service) -> bool {
        let page = service.hand.page();
        if page == self.hand {
            return true;
        }
        self.hand = page;
        self.text(&json!({"is": "hand", "page": page}).to_string())
    }

    fn tell_news(&mut self, board: &Board, seen: &mut Seen) -> bool {
        for text in board.fresh(seen) {
            if !self.text(&text) {
                return false;
            }
        }
        let (count, blocks) = board.blocks.after(seen.blocks);
        seen.blocks = count;
        blocks.iter().all(|block: &Arc<Vec<u8>>| {
            let bytes = block.as_ref().clone();
            self.socket.send(Message::Binary(bytes.into())).is_ok()
        })
    }
}
