//! The dashboard server: power, brakes and protective stops, a line for a line.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// The port of the dashboard server.
const PORT: u16 = 29999;

/// How long a connection and an answer may take.
const PATIENCE: Duration = Duration::from_secs(1);

/// A connection with the dashboard server.
#[derive(Debug)]
pub(crate) struct Dashboard {
    lines: BufReader<TcpStream>,
}

impl Dashboard {
    /// Connects and reads the greeting.
    ///
    /// # Errors
    /// No connection or no answer.
    pub(crate) fn connect(address: &str) -> io::Result<Self> {
        let address = (address, PORT).to_socket_addrs()?.next();
        let address = address.ok_or(io::ErrorKind::AddrNotAvailable)?;
        let stream = TcpStream::connect_timeout(&address, PATIENCE)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        let mut dashboard = Self {
            lines: BufReader::new(stream),
        };
        dashboard.line()?;
        Ok(dashboard)
    }

    /// Sends a command; returns the answer.
    ///
    /// # Errors
    /// The connection is lost, or there is no answer.
    pub(crate) fn ask(&mut self, command: &str) -> io::Result<String> {
        let stream = self.lines.get_mut();
        stream.write_all(format!("{command}\n").as_bytes())?;
        self.line()
    }

    fn line(&mut self) -> io::Result<String> {
        let mut line = String::new();
        if self.lines.read_line(&mut line)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(line.trim().to_owned())
    }
}
