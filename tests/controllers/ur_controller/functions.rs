//! The functions of URScript that the controller offers.

use std::io::Read;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::interpreter::{Arguments, Functions, Halt, Value};
use super::motion::{Doing, JOINTS, Servo};
use super::state::State;

/// The functions, over the state of the controller.
pub(crate) struct Library(pub(crate) Arc<Mutex<State>>);

impl Functions for Library {
    fn call(
        &self,
        name: &str,
        arguments: &Arguments,
        wait: &mut dyn FnMut() -> Result<(), Halt>,
    ) -> Result<Value, Halt> {
        let state = || self.0.lock().unwrap();
        match name {
            "get_steptime" => Ok(Value::Number(1.0 / state().setting.rate)),
            "get_target_joint_positions" => Ok(Value::List(state().motion.q.to_vec())),
            "get_actual_joint_positions" => Ok(Value::List(state().motion.actual.to_vec())),
            "textmsg" => {
                let text = arguments.text(0)?.to_owned();
                state().said.push(text);
                Ok(Value::Nothing)
            }
            "sync" => wait().map(|()| Value::Nothing),
            "servoj" => self.servoj(arguments, wait),
            "stopj" => {
                state().motion.doing = Doing::Stop(arguments.number(0)?);
                while state().motion.qd.iter().any(|speed| *speed != 0.0) {
                    wait()?;
                }
                Ok(Value::Nothing)
            }
            "socket_open" => self.open(arguments),
            "socket_read_binary_integer" => self.read(arguments, wait),
            "socket_close" => {
                state().sockets.remove(arguments.text(0)?);
                Ok(Value::Nothing)
            }
            _ => self.set(name, arguments),
        }
    }
}

impl Library {
    /// Follows a target until the time of the call is over, in the program's own time.
    fn servoj(
        &self,
        arguments: &Arguments,
        wait: &mut dyn FnMut() -> Result<(), Halt>,
    ) -> Result<Value, Halt> {
        let target = <[f64; JOINTS]>::try_from(arguments.list(0)?)
            .map_err(|_| Halt::Exception(arguments.line, "servoj needs six joints".into()))?;
        let servo = Servo {
            target,
            lookahead: arguments.named_number("lookahead_time")?,
            gain: arguments.named_number("gain")?,
        };
        let time = arguments.named_number("t")?;
        let known = (0.03..=0.2).contains(&servo.lookahead)
            && (100.0..=2000.0).contains(&servo.gain)
            && time > 0.0;
        if !known {
            let text = "servoj: an argument is out of its range".to_owned();
            return Err(Halt::Exception(arguments.line, text));
        }
        {
            let mut state = self.0.lock().unwrap();
            state.motion.doing = Doing::Servo(servo);
            state.motion.left = time;
            state.servos += 1;
        }
        loop {
            wait()?;
            if self.0.lock().unwrap().motion.left <= 1e-9 {
                return Ok(Value::Nothing);
            }
        }
    }

    fn open(&self, arguments: &Arguments) -> Result<Value, Halt> {
        let (host, port) = (arguments.text(0)?, arguments.number(1)? as u16);
        let address = (host, port).to_socket_addrs().ok();
        let address = address.and_then(|mut found| found.next());
        let stream =
            address.and_then(|to| TcpStream::connect_timeout(&to, Duration::from_secs(1)).ok());
        let opened = stream.is_some();
        if let Some(stream) = stream {
            stream.set_nonblocking(true).unwrap();
            let name = arguments.text(2)?.to_owned();
            let mut state = self.0.lock().unwrap();
            state.sockets.insert(name, (stream, Vec::new()));
        }
        Ok(Value::Truth(opened))
    }

    /// How many numbers came, and the numbers; none when the time is over or the socket is closed.
    fn read(
        &self,
        arguments: &Arguments,
        wait: &mut dyn FnMut() -> Result<(), Halt>,
    ) -> Result<Value, Halt> {
        let count = arguments.number(0)? as usize;
        let (name, patience) = (arguments.text(1)?, arguments.number(2)?);
        let start = Instant::now();
        loop {
            let mut closed = true;
            let mut state = self.0.lock().unwrap();
            if let Some((stream, bytes)) = state.sockets.get_mut(name) {
                let mut block = [0; 4096];
                closed = match stream.read(&mut block) {
                    Ok(read) => {
                        bytes.extend(&block[..read]);
                        read == 0
                    }
                    Err(error) => error.kind() != std::io::ErrorKind::WouldBlock,
                };
                if bytes.len() >= 4 * count {
                    let taken: Vec<u8> = bytes.drain(..4 * count).collect();
                    let numbers = taken.chunks_exact(4).map(|four| {
                        let four = <[u8; 4]>::try_from(four).unwrap();
                        f64::from(i32::from_be_bytes(four))
                    });
                    let list = [count as f64].into_iter().chain(numbers).collect();
                    state.setpoints += 1;
                    return Ok(Value::List(list));
                }
            }
            if closed || start.elapsed().as_secs_f64() > patience {
                return Ok(Value::List(vec![0.0; count + 1]));
            }
            drop(state);
            wait()?;
        }
    }

    /// Outputs, payload and tool centre point.
    fn set(&self, name: &str, arguments: &Arguments) -> Result<Value, Halt> {
        let mut state = self.0.lock().unwrap();
        let first = match name {
            "set_standard_digital_out" => Some(0),
            "set_configurable_digital_out" => Some(8),
            "set_tool_digital_out" => Some(16),
            _ => None,
        };
        if let Some(first) = first {
            let bit = 1_u64 << (first + arguments.number(0)? as u64);
            state.outputs = match arguments.truth(1)? {
                true => state.outputs | bit,
                false => state.outputs & !bit,
            };
            return Ok(Value::Nothing);
        }
        match name {
            "set_payload" | "set_target_payload" => {
                arguments.list(1)?;
                state.payload = arguments.number(0)?;
            }
            "set_tcp" => state.tool = arguments.list(0)?.to_vec(),
            _ => {
                let text = format!("no function {name}");
                return Err(Halt::Exception(arguments.line, text));
            }
        }
        Ok(Value::Nothing)
    }
}
