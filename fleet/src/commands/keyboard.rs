//! The keys of a terminal in raw mode.
//!
//! Read byte by byte: the reader of crossterm 0.29 turns in circles when its terminal is closed.

use std::io::Read;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use crate::answers::spawn;
use crate::failure::Failure;

/// A key that means something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// q, escape, Ctrl-C, or the terminal is closed.
    End,
    /// So many rows down, or up where it is negative.
    Rows(i16),
}

/// The keys of standard input.
pub(super) struct Keyboard(Receiver<Key>);

impl Keyboard {
    /// Reads in a thread, which ends with the terminal or with the process.
    ///
    /// # Errors
    /// There is no thread.
    pub(super) fn open() -> Result<Self, Failure> {
        let (tell, keys) = channel();
        spawn("keyboard", move || {
            let mut bytes = [0; 64];
            loop {
                let count = std::io::stdin().lock().read(&mut bytes).unwrap_or(0);
                let ends = count == 0;
                let pressed = if ends {
                    vec![Key::End]
                } else {
                    read(&bytes[..count])
                };
                let told = pressed.into_iter().all(|key| tell.send(key).is_ok());
                if ends || !told {
                    return;
                }
            }
        })?;
        Ok(Self(keys))
    }

    /// The next key within this time.
    pub(super) fn next(&self, within: Duration) -> Option<Key> {
        match self.0.recv_timeout(within) {
            Ok(key) => Some(key),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Key::End),
        }
    }
}

/// The keys among these bytes, which came together.
fn read(bytes: &[u8]) -> Vec<Key> {
    let mut rest = bytes;
    let mut keys = Vec::new();
    while let [first, more @ ..] = rest {
        let (key, left) = match (first, more) {
            (b'q' | 3, left) => (Some(Key::End), left),
            (b'j', left) => (Some(Key::Rows(1)), left),
            (b'k', left) => (Some(Key::Rows(-1)), left),
            (27, []) => (Some(Key::End), more),
            (27, [b'[' | b'O', b'A', left @ ..]) => (Some(Key::Rows(-1)), left),
            (27, [b'[' | b'O', b'B', left @ ..]) => (Some(Key::Rows(1)), left),
            (27, [b'[', b'5', b'~', left @ ..]) => (Some(Key::Rows(-20)), left),
            (27, [b'[', b'6', b'~', left @ ..]) => (Some(Key::Rows(20)), left),
            // Another order of the terminal: up to its letter.
            (27, [b'[', left @ ..]) => {
                let end = left.iter().position(u8::is_ascii_alphabetic);
                (
                    None,
                    left.get(end.map_or(left.len(), |end| end + 1)..)
                        .unwrap_or(&[]),
                )
            }
            (_, left) => (None, left),
        };
        keys.extend(key);
        rest = left;
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_read() {
        assert_eq!(read(b"q"), [Key::End]);
        assert_eq!(read(b"\x03"), [Key::End]);
        assert_eq!(read(b"\x1b"), [Key::End]);
        let moves = [Key::Rows(1), Key::Rows(-1), Key::Rows(20), Key::Rows(-20)];
        assert_eq!(read(b"\x1b[B\x1bOA\x1b[6~\x1b[5~"), moves);
        assert_eq!(read(b"jxk\x1b[1;5Cq"), [moves[0], moves[1], Key::End]);
        assert_eq!(read(b"\x1b[12"), []);
        assert_eq!(read("äß".as_bytes()), []);
    }
}
