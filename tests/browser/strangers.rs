//! Who has no business here is refused, by what goes over the wire.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use crate::scene::Scene;

/// Sends a request with these headers; the first line of the answer, and all of it.
fn ask(port: u16, target: &str, headers: &[String]) -> (String, String) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    let head = format!("GET {target} HTTP/1.1\r\n{}\r\n\r\n", headers.join("\r\n"));
    stream.write_all(head.as_bytes()).unwrap();
    let mut bytes = Vec::new();
    let mut buffer = [0; 4096];
    // A WebSocket stays open: its head is enough.
    while !bytes.windows(4).any(|four| four == b"\r\n\r\n") {
        match stream.read(&mut buffer) {
            Ok(0) | Err(_) => break,
            Ok(count) => bytes.extend_from_slice(&buffer[..count]),
        }
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    (text.lines().next().unwrap_or_default().to_owned(), text)
}

fn header(name: &str, value: impl std::fmt::Display) -> String {
    format!("{name}: {value}")
}

/// The headers of a WebSocket with a token.
fn socket(host: &str, token: &str) -> Vec<String> {
    vec![
        header("Host", host),
        header("Upgrade", "websocket"),
        header("Connection", "Upgrade"),
        header("Sec-WebSocket-Version", 13),
        header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
        header("Sec-WebSocket-Protocol", format!("canter, token.{token}")),
    ]
}

/// Every guard has a request that only it refuses: with one guard off, this test fails.
pub(crate) fn strangers_are_refused() {
    let scene = Scene::start("strangers");
    let port = scene.port();
    let host = format!("127.0.0.1:{port}");
    let token = scene.hand.rsplit('#').next().unwrap();

    let (status, text) = ask(port, "/", &[header("Host", &host)]);
    assert!(status.contains("200"), "{status}");
    for guard in [
        "default-src 'none'",
        "frame-ancestors 'none'",
        "Cross-Origin-Resource-Policy: same-origin",
        "Cross-Origin-Opener-Policy: same-origin",
        "Cache-Control: no-store",
        "X-Content-Type-Options: nosniff",
    ] {
        assert!(text.contains(guard), "{guard} is missing: {text}");
    }
    assert!(
        !text.contains("Access-Control-Allow") && !text.contains("Set-Cookie"),
        "{text}"
    );
    assert!(!text.contains(token));

    // A name that was bound to our address.
    let (status, _) = ask(port, "/", &[header("Host", format!("evil.example:{port}"))]);
    assert!(status.contains("403"), "{status}");
    // Two of them: which one counts would be anybody's guess.
    let two = [header("Host", &host), header("Host", "evil.example")];
    assert!(ask(port, "/", &two).0.contains("403"));
    // A page of another port of this machine, and what another site has caused.
    let other = [
        header("Host", &host),
        header("Origin", "http://127.0.0.1:1"),
    ];
    assert!(ask(port, "/main.js", &other).0.contains("403"));
    let caused = [
        header("Host", &host),
        header("Sec-Fetch-Site", "cross-site"),
    ];
    assert!(ask(port, "/main.js", &caused).0.contains("403"));

    // The WebSocket: with all it needs, and each time one thing wrong.
    let (status, text) = ask(port, "/live", &socket(&host, token));
    assert!(status.contains("101"), "{status}");
    assert!(text.contains("Sec-WebSocket-Protocol: canter"), "{text}");
    let watch = scene.watch.rsplit('#').next().unwrap();
    assert!(ask(port, "/live", &socket(&host, watch)).0.contains("101"));
    assert!(ask(port, "/live", &socket(&host, "")).0.contains("401"));
    assert!(
        ask(port, "/live", &socket(&host, &"0".repeat(32)))
            .0
            .contains("401")
    );
    assert!(
        ask(
            port,
            "/live",
            &socket(&format!("evil.example:{port}"), token)
        )
        .0
        .contains("403")
    );
    for strange in [
        header("Origin", "http://evil.example"),
        header("Sec-Fetch-Site", "cross-site"),
    ] {
        let mut headers = socket(&host, token);
        headers.push(strange);
        assert!(ask(port, "/live", &headers).0.contains("403"));
    }
    let nowhere = ask(port, "/other", &socket(&host, token)).0;
    assert!(nowhere.contains("400"), "{nowhere}");

    // Only this machine: the port is not open on another address of it.
    let listening = std::fs::read_to_string("/proc/net/tcp").unwrap();
    let ours = format!(":{port:04X} ");
    let bound: Vec<&str> = listening
        .lines()
        .filter_map(|line| line.split_whitespace().nth(1))
        .filter(|place| format!("{place} ").ends_with(&ours))
        .collect();
    assert!(
        !bound.is_empty() && bound.iter().all(|place| place.starts_with("0100007F")),
        "{bound:?}"
    );
}
