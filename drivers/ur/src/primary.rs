//! The primary interface: takes programs, and tells errors.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use ipc::bytes_of;

use crate::snapshot::Alarm;

/// The port of the primary interface.
const PORT: u16 = 30001;

/// How long a connection and the sending of a program may take.
const PATIENCE: Duration = Duration::from_secs(1);

/// The longest package (bytes).
const LONGEST: usize = 1 << 16;

/// The kind of a package that is a message, and the kinds of messages that say why a program ended.
const MESSAGE: u8 = 20;
const ERROR_CODE: u8 = 6;
const EXCEPTION: u8 = 10;

/// The levels of an error that ends a program: warning, violation, fault.
const LEVELS: [i32; 3] = [2, 3, 4];

/// A connection with the primary interface.
#[derive(Debug)]
pub(crate) struct Primary {
    stream: TcpStream,
    bytes: Vec<u8>,
}

impl Primary {
    /// Connects.
    ///
    /// # Errors
    /// No connection.
    pub(crate) fn connect(address: &str) -> io::Result<Self> {
        let address = (address, PORT).to_socket_addrs()?.next();
        let address = address.ok_or(io::ErrorKind::AddrNotAvailable)?;
        let stream = TcpStream::connect_timeout(&address, PATIENCE)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        // Reading waits for nothing.
        stream.set_read_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self {
            stream,
            bytes: Vec::new(),
        })
    }

    /// Sends a program.
    ///
    /// # Errors
    /// The connection is lost.
    pub(crate) fn send(&mut self, program: &str) -> io::Result<()> {
        self.stream.write_all(program.as_bytes())
    }

    /// Reads what has come; returns the errors in it.
    ///
    /// # Errors
    /// The connection is lost.
    pub(crate) fn alarms(&mut self) -> io::Result<Vec<Alarm>> {
        let mut block = [0; 4096];
        match self.stream.read(&mut block) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => self.bytes.extend_from_slice(&block[..count]),
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock
                | io::ErrorKind::TimedOut
                | io::ErrorKind::Interrupted => {}
                _ => return Err(error),
            },
        }
        take_alarms(&mut self.bytes)
    }
}

/// Takes the complete packages from the front of `bytes`; returns the errors in them.
fn take_alarms(bytes: &mut Vec<u8>) -> io::Result<Vec<Alarm>> {
    let mut alarms = Vec::new();
    let mut from = 0;
    while let Some((size, rest)) = bytes[from..].split_first_chunk::<4>() {
        let size = u32::from_be_bytes(*size) as usize;
        if !(5..=LONGEST).contains(&size) {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let Some(package) = rest.get(..size - 4) else {
            break;
        };
        alarms.extend(alarm(package));
        from += size;
    }
    bytes.drain(..from);
    Ok(alarms)
}

/// The error in a package without its size, if it is one.
fn alarm(package: &[u8]) -> Option<Alarm> {
    // Kind, time stamp, source, kind of the message.
    let (head, body) = package.split_first_chunk::<11>()?;
    let (first, rest) = body.split_first_chunk::<4>()?;
    let (second, rest) = rest.split_first_chunk::<4>()?;
    let (first, second) = (i32::from_be_bytes(*first), i32::from_be_bytes(*second));
    let text = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes);
        text.trim_matches(['\0', ' ', '\n']).to_owned()
    };
    match (head[0], head[10]) {
        (MESSAGE, ERROR_CODE) => {
            let (level, rest) = rest.split_first_chunk::<4>()?;
            let said = text(rest.get(8..)?);
            let said = if said.is_empty() {
                "see the log on the pendant".to_owned()
            } else {
                said
            };
            let ends = LEVELS.contains(&i32::from_be_bytes(*level));
            ends.then(|| Alarm {
                code: first,
                argument: second,
                text: bytes_of(&said),
            })
        }
        (MESSAGE, EXCEPTION) => {
            let said = format!("line {first}, column {second}: {}", text(rest));
            Some(Alarm {
                code: 0,
                argument: 0,
                text: bytes_of(&said),
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(message: u8, numbers: &[i32], text: &str) -> Vec<u8> {
        let mut body = vec![MESSAGE];
        body.extend([0; 8]);
        body.extend([253, message]);
        for number in numbers {
            body.extend(number.to_be_bytes());
        }
        body.extend(text.as_bytes());
        let mut bytes = (body.len() as u32 + 4).to_be_bytes().to_vec();
        bytes.extend(body);
        bytes
    }

    #[test]
    fn errors_are_found_between_other_packages() {
        let mut bytes = package(0, &[1, 2], "text");
        bytes.extend([0, 0, 0, 5, 16]);
        bytes.extend(package(ERROR_CODE, &[204, 3, 3, 0, 0], ""));
        bytes.extend(package(ERROR_CODE, &[1, 0, 1, 0, 0], "for information"));
        bytes.extend(package(EXCEPTION, &[7, 2], "compile_error"));
        let cut = bytes.len() - 3;
        let mut first = bytes[..cut].to_vec();
        let alarms = take_alarms(&mut first).unwrap();
        assert_eq!(alarms.len(), 1);
        assert_eq!((alarms[0].code, alarms[0].argument), (204, 3));
        first.extend(&bytes[cut..]);
        let alarms = take_alarms(&mut first).unwrap();
        assert_eq!(alarms.len(), 1);
        let said = ipc::text_of(&alarms[0].text);
        assert_eq!(said, "line 7, column 2: compile_error");
        assert!(first.is_empty());
        assert!(take_alarms(&mut vec![0, 0, 0, 2, 1]).is_err());
    }
}
