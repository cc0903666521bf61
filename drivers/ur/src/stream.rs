//! The connection that carries the setpoints: eight big-endian numbers of 32 bits in each message.

use std::io::{self, Read, Write};
use std::net::TcpStream;

use crate::JOINTS;

/// Numbers in a message: the time until the next one (ms), six joint angles (µrad), what to do.
const NUMBERS: usize = JOINTS + 2;

/// What the program shall do.
const SERVO: i32 = 1;
const STOP: i32 = -2;

/// Angles are sent in these parts of a radian.
const UNIT: f64 = 1e6;

/// As the program on the robot: what it goes on without setpoints fades by this factor in a cycle.
const FADE: f64 = 0.98;

/// The connection with the program on the robot, and where that program is.
#[derive(Debug)]
pub(crate) struct Stream {
    stream: TcpStream,
    /// The last setpoint, and the step from the one before it (rad).
    wanted: [f64; JOINTS],
    step: [f64; JOINTS],
}

impl Stream {
    /// A program that holds the joints at `at` (rad).
    pub(crate) fn new(stream: TcpStream, at: [f64; JOINTS]) -> Self {
        Self {
            stream,
            wanted: at,
            step: [0.0; JOINTS],
        }
    }

    /// Sends joint angles (rad) and the time until the next ones (s).
    ///
    /// # Errors
    /// The program does not read any more.
    pub(crate) fn send(&mut self, joints: &[f64; JOINTS], timeout: f64) -> io::Result<()> {
        let mut numbers = [SERVO; NUMBERS];
        numbers[0] = (timeout * 1e3).round() as i32;
        for (number, angle) in numbers[1..].iter_mut().zip(joints) {
            *number = (angle * UNIT).round() as i32;
        }
        for (joint, angle) in joints.iter().enumerate() {
            self.step[joint] = angle - self.wanted[joint];
        }
        self.wanted = *joints;
        self.write(&numbers)
    }

    /// Where the program has gone by itself in a cycle without a setpoint (rad), and its speed
    /// (rad a cycle).
    pub(crate) fn gone_on(&self) -> ([f64; JOINTS], [f64; JOINTS]) {
        let at = core::array::from_fn(|joint| self.wanted[joint] + self.step[joint]);
        (at, self.step.map(|step| step * FADE))
    }

    /// Confirms where the program has gone by itself: what follows goes on from there.
    ///
    /// # Errors
    /// As [`Stream::send`].
    pub(crate) fn confirm(&mut self, timeout: f64) -> io::Result<()> {
        let (at, speed) = self.gone_on();
        let sent = self.send(&at, timeout);
        self.step = speed;
        sent
    }

    /// Ends the program.
    pub(crate) fn end(&mut self) {
        let mut numbers = [0; NUMBERS];
        numbers[NUMBERS - 1] = STOP;
        // A program that has gone need not be ended.
        let _ = self.write(&numbers);
    }

    /// Whether the program has closed the connection.
    pub(crate) fn is_closed(&mut self) -> bool {
        let mut bytes = [0; 64];
        match self.stream.read(&mut bytes) {
            Ok(count) => count == 0,
            Err(error) => error.kind() != io::ErrorKind::WouldBlock,
        }
    }

    fn write(&mut self, numbers: &[i32; NUMBERS]) -> io::Result<()> {
        let mut bytes = [0; NUMBERS * 4];
        for (four, number) in bytes.chunks_exact_mut(4).zip(numbers) {
            four.copy_from_slice(&number.to_be_bytes());
        }
        let written = self.stream.write(&bytes)?;
        // Part of a message means that the program has not read for a long time.
        if written == bytes.len() {
            Ok(())
        } else {
            Err(io::ErrorKind::WriteZero.into())
        }
    }
}
