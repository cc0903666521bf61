//! A connection to the view that can be made to stand still, as a bad network does.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// Passes everything on between a port of its own and that of a view.
pub(crate) struct Relay {
    port: u16,
    stands: Arc<AtomicBool>,
}

impl Relay {
    pub(crate) fn to(view: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let stands = Arc::new(AtomicBool::new(false));
        let stops = Arc::clone(&stands);
        thread::spawn(move || {
            for near in listener.incoming() {
                let near = near.unwrap();
                let Ok(far) = TcpStream::connect(("127.0.0.1", view)) else {
                    return;
                };
                let (back, there) = (far.try_clone().unwrap(), near.try_clone().unwrap());
                let (up, down) = (Arc::clone(&stops), Arc::clone(&stops));
                // The view serves its own port only: the relay says that it is meant.
                let ports = [port, view].map(|port| format!("127.0.0.1:{port}"));
                thread::spawn(move || pass(near, far, &up, Some(ports)));
                thread::spawn(move || pass(back, there, &down, None));
            }
        });
        Self { port, stands }
    }

    /// The address of the view through this relay.
    pub(crate) fn address(&self, direct: &str) -> String {
        let (_, token) = direct.split_once('#').unwrap();
        format!("http://127.0.0.1:{}/#{token}", self.port)
    }

    /// From now on nothing is passed on, or everything again.
    pub(crate) fn stand(&self, stands: bool) {
        self.stands.store(stands, Ordering::Release);
    }
}

fn pass(mut from: TcpStream, mut to: TcpStream, stands: &AtomicBool, ports: Option<[String; 2]>) {
    let mut buffer = [0; 16_384];
    let mut is_http = ports.is_some();
    while let Ok(count) = from.read(&mut buffer) {
        while stands.load(Ordering::Acquire) {
            thread::sleep(Duration::from_millis(1));
        }
        let mut bytes = buffer[..count].to_vec();
        if let Some([ours, theirs]) = ports.as_ref().filter(|_| is_http) {
            let text = String::from_utf8_lossy(&bytes).replace(ours, theirs);
            is_http = !text.to_ascii_lowercase().contains("upgrade: websocket");
            bytes = text.into_bytes();
        }
        if count == 0 || to.write_all(&bytes).is_err() {
            break;
        }
    }
    // The other side has gone: so has this one.
    let _ = to.shutdown(std::net::Shutdown::Both);
}
