//! The connection with the controller that brings its states.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream, ToSocketAddrs};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::UrOptions;
use crate::rtde::{self, Cycle, LONGEST, Version, kind};
use crate::snapshot::Modes;

/// The port of RTDE.
const PORT: u16 = 30004;

/// How long a connection and an answer of the set-up may take.
const PATIENCE: Duration = Duration::from_secs(2);

/// How long a read waits for the next state.
const READ: Duration = Duration::from_millis(20);

/// The oldest software of each series that is served, and how many states a second it sends.
const OLDEST: [(Version, f64); 2] = [
    (
        Version {
            major: 3,
            minor: 7,
            bugfix: 0,
        },
        125.0,
    ),
    (
        Version {
            major: 5,
            minor: 1,
            bugfix: 0,
        },
        500.0,
    ),
];

/// States that are kept of one read: more than a stall of a tenth of a second brings.
const MOST: usize = 64;

/// Why there is no connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Refusal {
    pub(crate) reason: String,
    /// Another try will not help.
    pub(crate) for_good: bool,
}

impl Refusal {
    pub(crate) fn lost(reason: &str) -> Self {
        Self {
            reason: reason.to_owned(),
            for_good: false,
        }
    }
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Self {
        Self::lost(&error.to_string())
    }
}

/// A connection that is set up.
pub(crate) struct Link {
    stream: TcpStream,
    bytes: Box<[u8]>,
    filled: usize,
    recipe: u8,
    period: f64,
    cycles: [Cycle; MOST],
    count: usize,
}

impl Link {
    /// Connects, and asks for the states.
    ///
    /// # Errors
    /// No answer, another protocol, software that is too old, or a field that it lacks.
    pub(crate) fn connect(options: &UrOptions, modes: &Modes) -> Result<Self, Refusal> {
        let address = (options.address.as_str(), PORT)
            .to_socket_addrs()?
            .next()
            .ok_or_else(|| Refusal::lost("the address has no number"))?;
        let stream = TcpStream::connect_timeout(&address, PATIENCE)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(READ))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        if let IpAddr::V4(local) = stream.local_addr()?.ip() {
            modes.local.store(local.to_bits(), Ordering::Relaxed);
        }
        let mut link = Self {
            stream,
            bytes: vec![0; 8 * LONGEST].into_boxed_slice(),
            filled: 0,
            recipe: 0,
            period: 0.0,
            cycles: [Cycle::default(); MOST],
            count: 0,
        };
        link.set_up(options, modes)?;
        Ok(link)
    }

    fn set_up(&mut self, options: &UrOptions, modes: &Modes) -> Result<(), Refusal> {
        let refuse = |reason: String| Refusal {
            reason,
            for_good: true,
        };
        let answer = self.ask(kind::PROTOCOL, &2_u16.to_be_bytes())?;
        if answer.first() != Some(&1) {
            return Err(refuse("the controller has no RTDE of version 2".to_owned()));
        }
        let answer = self.ask(kind::VERSION, &[])?;
        let version = rtde::version(&answer)
            .ok_or_else(|| refuse("the controller does not tell its version".to_owned()))?;
        modes.set_version(version);
        let rate = rate(version).map_err(refuse)?;
        let rate = options.rate.unwrap_or(rate);
        let mut wanted = rate.to_be_bytes().to_vec();
        wanted.extend_from_slice(rtde::names().as_bytes());
        let answer = self.ask(kind::OUTPUTS, &wanted)?;
        self.recipe = rtde::recipe(&answer).map_err(refuse)?;
        self.period = 1.0 / rate;
        let answer = self.ask(kind::START, &[])?;
        if answer.first() != Some(&1) {
            return Err(Refusal::lost("the controller does not start its states"));
        }
        Ok(())
    }

    /// Sends a request and waits for its answer.
    fn ask(&mut self, wanted: u8, payload: &[u8]) -> Result<Vec<u8>, Refusal> {
        self.stream.write_all(&rtde::package(wanted, payload))?;
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            while let Some((found, payload, length)) = self.first()? {
                let payload = payload.to_vec();
                self.drop_front(length);
                if found == wanted {
                    return Ok(payload);
                }
            }
            self.fill()?;
        }
        let name = char::from(wanted);
        Err(Refusal::lost(&format!("no answer to the request {name}")))
    }

    fn first(&self) -> Result<Option<rtde::Package<'_>>, Refusal> {
        rtde::first(&self.bytes[..self.filled]).map_err(|reason| Refusal::lost(&reason))
    }

    fn drop_front(&mut self, length: usize) {
        self.bytes.copy_within(length..self.filled, 0);
        self.filled -= length;
    }

    /// Reads what has come, or waits a while for it.
    fn fill(&mut self) -> Result<(), Refusal> {
        let room = &mut self.bytes[self.filled..];
        if room.is_empty() {
            return Ok(());
        }
        match self.stream.read(room) {
            Ok(0) => Err(Refusal::lost("the controller has closed the connection")),
            Ok(count) => {
                self.filled += count;
                Ok(())
            }
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock
                | io::ErrorKind::TimedOut
                | io::ErrorKind::Interrupted => Ok(()),
                _ => Err(error.into()),
            },
        }
    }

    /// Waits for the next states; returns how many have come.
    ///
    /// # Errors
    /// The connection is lost.
    pub(crate) fn read(&mut self) -> Result<usize, Refusal> {
        self.count = 0;
        self.fill()?;
        let mut from = 0;
        while let Some((found, payload, length)) =
            rtde::first(&self.bytes[from..self.filled]).map_err(|reason| Refusal::lost(&reason))?
        {
            if found == kind::DATA
                && let Some(cycle) = rtde::cycle(payload, self.recipe)
            {
                if self.count == MOST {
                    self.cycles.copy_within(1.., 0);
                    self.count -= 1;
                }
                self.cycles[self.count] = cycle;
                self.count += 1;
            }
            from += length;
        }
        self.drop_front(from);
        Ok(self.count)
    }

    /// One of the states that have come.
    pub(crate) fn cycle(&self, index: usize) -> Option<Cycle> {
        self.cycles[..self.count].get(index).copied()
    }

    /// Time between two states (s).
    pub(crate) fn period(&self) -> f64 {
        self.period
    }
}

/// How many states a second the software sends.
fn rate(version: Version) -> Result<f64, String> {
    let Version {
        major,
        minor,
        bugfix,
    } = version;
    let found = OLDEST.iter().find(|(oldest, _)| oldest.major == major);
    match found {
        Some((oldest, rate)) if version >= *oldest => Ok(*rate),
        _ => Err(format!(
            "software {major}.{minor}.{bugfix}; expected 3.7 or newer (CB3), or 5.1 or newer (e-Series)"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_software_that_is_known_is_served() {
        let of = |major, minor| {
            rate(Version {
                major,
                minor,
                bugfix: 9,
            })
        };
        assert_eq!(of(3, 7), Ok(125.0));
        assert_eq!(of(5, 21), Ok(500.0));
        for (major, minor) in [(3, 6), (5, 0), (4, 9), (10, 7), (0, 0)] {
            assert!(of(major, minor).is_err(), "{major}.{minor}");
        }
    }
}
