//! The other side: sends commands to any CRCL server and waits for each.

use std::net::{TcpStream, ToSocketAddrs};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crcl::xml::{
    CommandState, Instance, Instruction, ProgramPlace, Status, XmlCommand, read_status,
    write_instance,
};
use thiserror::Error;

use crate::framing::{Frame, Frames};
use crate::tls::{Stream, TlsClient};

/// How long a server may take to answer.
const ANSWER: Duration = Duration::from_secs(10);

/// How often it is asked how far it is.
const POLL: Duration = Duration::from_millis(20);

/// Why a program was not executed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ClientError {
    /// No connection, or one that broke.
    #[error("{server}: {cause}")]
    Connection {
        /// The server.
        server: String,
        /// What the operating system said.
        cause: std::io::Error,
    },
    /// The server closed the connection.
    #[error("{server} has closed the connection")]
    Closed {
        /// The server.
        server: String,
    },
    /// What came is no status.
    #[error("{server} sent what is no status: {cause}")]
    Status {
        /// The server.
        server: String,
        /// What is wrong with it.
        cause: String,
    },
    /// A command failed.
    #[error("command {index}, {name}: {why}")]
    Failed {
        /// Number of the command in the program, from 0.
        index: usize,
        /// Its name.
        name: &'static str,
        /// The server's sentence.
        why: String,
    },
    /// A command took too long.
    #[error("command {index}, {name}, was not done within {seconds} s")]
    Late {
        /// Number of the command in the program, from 0.
        index: usize,
        /// Its name.
        name: &'static str,
        /// How long was waited.
        seconds: u64,
    },
}

/// How far a program is.
#[derive(Clone, Debug)]
pub struct Progress<'a> {
    /// Number of the command in the program, from 0.
    pub index: usize,
    /// The command that was done.
    pub instruction: &'a Instruction,
    /// The status that said so.
    pub status: Status,
}

/// A connection to a CRCL server.
#[derive(Debug)]
pub struct Client {
    server: String,
    stream: Box<dyn Stream>,
    frames: Frames,
    next: i64,
}

impl Client {
    /// Connects to `HOST:PORT`.
    ///
    /// # Errors
    /// [`ClientError::Connection`].
    pub fn connect(server: &str) -> Result<Self, ClientError> {
        Self::through(server, None)
    }

    /// Connects to `HOST:PORT` with TLS.
    ///
    /// # Errors
    /// [`ClientError::Connection`].
    pub fn connect_tls(server: &str, tls: &TlsClient) -> Result<Self, ClientError> {
        Self::through(server, Some(tls))
    }

    fn through(server: &str, tls: Option<&TlsClient>) -> Result<Self, ClientError> {
        let failed = |cause| ClientError::Connection {
            server: server.to_owned(),
            cause,
        };
        let address = server.to_socket_addrs().map_err(failed)?.next();
        let none = || std::io::Error::new(std::io::ErrorKind::NotFound, "it has no address");
        let address = address.ok_or_else(|| failed(none()))?;
        let stream = TcpStream::connect_timeout(&address, ANSWER).map_err(failed)?;
        stream.set_nodelay(true).map_err(failed)?;
        stream.set_read_timeout(Some(ANSWER)).map_err(failed)?;
        stream.set_write_timeout(Some(ANSWER)).map_err(failed)?;
        let host = server.rsplit_once(':').map_or(server, |(host, _)| host);
        let host = host.trim_start_matches('[').trim_end_matches(']');
        let stream = match tls {
            Some(tls) => tls.wrap(host, stream).map_err(failed)?,
            None => Box::new(stream),
        };
        Ok(Self {
            server: server.to_owned(),
            stream,
            frames: Frames::new(&["CRCLStatus"]),
            next: 1,
        })
    }

    /// Sends a program command by command, each when the one before it is done. `limit` is how
    /// long one command may take; GetStatus in the program is left out.
    ///
    /// # Errors
    /// [`ClientError`]: the first command that fails ends it.
    pub fn run(
        &mut self,
        program: &[Instruction],
        file: &str,
        limit: Duration,
        mut tell: impl FnMut(Progress),
    ) -> Result<(), ClientError> {
        let length = i32::try_from(program.len().saturating_sub(1)).ok();
        for (index, instruction) in program.iter().enumerate() {
            if instruction.command == XmlCommand::GetStatus {
                continue;
            }
            let place = ProgramPlace {
                file: Some(file.to_owned()),
                index: i32::try_from(index).ok(),
                length,
            };
            let status = self.execute(index, instruction, place, limit)?;
            tell(Progress {
                index,
                instruction,
                status,
            });
        }
        Ok(())
    }

    fn execute(
        &mut self,
        index: usize,
        instruction: &Instruction,
        place: ProgramPlace,
        limit: Duration,
    ) -> Result<Status, ClientError> {
        let id = self.next;
        self.next += 1;
        let name = instruction.command.name();
        self.send(&Instance {
            name: None,
            instruction: Instruction {
                id,
                ..instruction.clone()
            },
            place,
        })?;
        let end = Instant::now() + limit;
        loop {
            let status = self.status()?;
            if status.command.command == id {
                match status.command.state {
                    CommandState::Done => return Ok(status),
                    CommandState::Error => {
                        let why = status.command.description.unwrap_or_default();
                        return Err(ClientError::Failed { index, name, why });
                    }
                    CommandState::Working | CommandState::Ready => {}
                }
            }
            if Instant::now() >= end {
                let seconds = limit.as_secs();
                return Err(ClientError::Late {
                    index,
                    name,
                    seconds,
                });
            }
            sleep(POLL);
        }
    }

    /// Asks for a status and waits for it.
    ///
    /// # Errors
    /// [`ClientError`] when none comes.
    pub fn status(&mut self) -> Result<Status, ClientError> {
        self.send(&Instance::new(Instruction::new(0, XmlCommand::GetStatus)))?;
        let mut buffer = [0; 4096];
        loop {
            if let Some(frame) = self.frames.next() {
                match frame {
                    Frame::Document(bytes) => return self.read(&bytes),
                    Frame::Garbage(_) => continue,
                    Frame::TooLong => {
                        return Err(ClientError::Status {
                            server: self.server.clone(),
                            cause: "it is too long".to_owned(),
                        });
                    }
                }
            }
            let read = self.stream.read(&mut buffer);
            let count = read.map_err(|cause| self.failed(cause))?;
            if count == 0 {
                return Err(ClientError::Closed {
                    server: self.server.clone(),
                });
            }
            self.frames.push(buffer.get(..count).unwrap_or_default());
        }
    }

    fn read(&self, bytes: &[u8]) -> Result<Status, ClientError> {
        let text = String::from_utf8_lossy(bytes);
        read_status(&text).map_err(|findings| ClientError::Status {
            server: self.server.clone(),
            cause: findings
                .first()
                .map_or_else(String::new, |finding| finding.message.clone()),
        })
    }

    fn send(&mut self, instance: &Instance) -> Result<(), ClientError> {
        let text = write_instance(instance);
        let sent = self.stream.write_all(text.as_bytes());
        let sent = sent.and_then(|()| self.stream.flush());
        sent.map_err(|cause| self.failed(cause))
    }

    fn failed(&self, cause: std::io::Error) -> ClientError {
        ClientError::Connection {
            server: self.server.clone(),
            cause,
        }
    }
}
