//! As much of HTTP as a page needs: the head of a request, and answers with fixed texts.

use std::io::{self, Read, Write};
use std::net::TcpStream;

use crate::Visitor;

/// The longest head of a request (bytes).
const LONGEST: usize = 16 << 10;

/// A request whose head was read.
#[derive(Debug)]
pub(crate) struct Incoming {
    /// Who asks for what.
    pub(crate) visitor: Visitor,
    /// The key of a WebSocket's handshake.
    pub(crate) key: Option<String>,
    /// Whether the connection shall stay open.
    pub(crate) stays: bool,
}

/// Reads the head of the next request; none where the connection ends. What comes behind a head is
/// not read: a page sends nothing behind it before it is answered.
///
/// # Errors
/// A request that is no HTTP, or a connection that breaks.
pub(crate) fn read(stream: &mut TcpStream) -> io::Result<Option<Incoming>> {
    let mut bytes = Vec::new();
    let mut buffer = [0; 2048];
    loop {
        let mut headers = [httparse::EMPTY_HEADER; 64];
        let mut request = httparse::Request::new(&mut headers);
        let parsed = request.parse(&bytes).map_err(|_| broken("no HTTP"))?;
        if parsed.is_complete() {
            return Ok(Some(incoming(&request)));
        }
        if bytes.len() >= LONGEST {
            return Err(broken("a head that is too long"));
        }
        match stream.read(&mut buffer)? {
            0 if bytes.is_empty() => return Ok(None),
            0 => return Err(broken("a head without end")),
            count => bytes.extend_from_slice(buffer.get(..count).unwrap_or_default()),
        }
    }
}

fn broken(found: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, found)
}

fn incoming(request: &httparse::Request<'_, '_>) -> Incoming {
    // Two headers of one name are as bad as a wrong one: the first is not better than the second.
    let header = |name: &str| -> Option<String> {
        let mut found = request
            .headers
            .iter()
            .filter(|header| header.name.eq_ignore_ascii_case(name));
        let first = found.next()?;
        let value = if found.next().is_some() {
            "two of them"
        } else {
            std::str::from_utf8(first.value).unwrap_or("not text")
        };
        Some(value.trim().to_owned())
    };
    let has = |name: &str, word: &str| {
        header(name).is_some_and(|value| {
            let mut words = value.split(',');
            words.any(|found| found.trim().eq_ignore_ascii_case(word))
        })
    };
    let target = request.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    Incoming {
        visitor: Visitor {
            method: request.method.unwrap_or_default().to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            host: header("host"),
            origin: header("origin"),
            fetch_site: header("sec-fetch-site"),
            protocols: header("sec-websocket-protocol"),
            authorization: header("authorization"),
            upgrades: has("upgrade", "websocket"),
        },
        key: header("sec-websocket-key"),
        // A body would be read as the next request.
        stays: !has("connection", "close") && header("content-length").is_none(),
    }
}

/// What the page may do: nothing but what comes from here.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: \
    blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Answers with a text of this type.
///
/// # Errors
/// The connection breaks.
pub(crate) fn answer(
    stream: &mut TcpStream,
    (status, kind): (u16, &str),
    body: &[u8],
    stays: bool,
) -> io::Result<()> {
    let reason = match status {
        200 => "OK",
        401 => "Unauthorized",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        _ => "Bad Request",
    };
    let connection = if stays { "keep-alive" } else { "close" };
    let head = format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\
         Connection: {connection}\r\nCache-Control: no-store\r\nContent-Security-Policy: {POLICY}\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n\
         Cross-Origin-Embedder-Policy: require-corp\r\nX-Content-Type-Options: nosniff\r\n\
         X-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()
}

/// Answers a WebSocket's handshake; `protocol` is what will be spoken.
///
/// # Errors
/// The connection breaks.
pub(crate) fn upgrade(stream: &mut TcpStream, key: &str, protocol: &str) -> io::Result<()> {
    let accept = tungstenite::handshake::derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\nSec-WebSocket-Protocol: {protocol}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.flush()
}
