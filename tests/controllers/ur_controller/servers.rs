//! The servers of the controller: RTDE, dashboard, primary interface.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{sleep, spawn};
use std::time::Duration;

use super::functions::Library;
use super::interpreter::Running;
use super::state::{
    IDLE, Listener, NORMAL, PAUSED, PLAYING, POWER_OFF, PROTECTIVE, RUNNING, State,
};
use super::syntax::{SyntaxError, read};

/// Serves each client of `address:port` with `serve`, in a thread of its own.
pub(crate) fn listen(
    (address, port): (&str, u16),
    state: &Arc<Mutex<State>>,
    ends: &Arc<AtomicBool>,
    serve: fn(TcpStream, &Arc<Mutex<State>>),
) {
    let listener = TcpListener::bind((address, port)).unwrap();
    listener.set_nonblocking(true).unwrap();
    let (state, ends) = (Arc::clone(state), Arc::clone(ends));
    spawn(move || {
        while !ends.load(Ordering::Relaxed) {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false).unwrap();
                    stream.set_nodelay(true).unwrap();
                    let state = Arc::clone(&state);
                    spawn(move || serve(stream, &state));
                }
                Err(_) => sleep(Duration::from_millis(2)),
            }
        }
    });
}

fn package(kind: u8, payload: &[u8]) -> Vec<u8> {
    let size = payload.len() as u16 + 3;
    let mut bytes = size.to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend(payload);
    bytes
}

/// A client of RTDE.
pub(crate) fn rtde(mut stream: TcpStream, state: &Arc<Mutex<State>>) {
    let mut fields: Vec<String> = Vec::new();
    let mut every = 1;
    loop {
        let mut head = [0; 3];
        if stream.read_exact(&mut head).is_err() {
            return;
        }
        let size = usize::from(u16::from_be_bytes([head[0], head[1]]));
        let mut payload = vec![0; size.saturating_sub(3)];
        if stream.read_exact(&mut payload).is_err() {
            return;
        }
        let mut state = state.lock().unwrap();
        let answer = match head[2] {
            b'V' => vec![u8::from(payload == [0, 2])],
            b'v' => {
                let version = state.setting.version;
                version.iter().flat_map(|n| n.to_be_bytes()).collect()
            }
            b'O' => {
                let (rate, names) = payload.split_first_chunk::<8>().unwrap();
                let rate = f64::from_be_bytes(*rate);
                every = (state.setting.rate / rate).round().max(1.0) as u64;
                let names = String::from_utf8_lossy(names);
                let named = names.split(',').filter(|name| !name.is_empty());
                fields = named.map(str::to_owned).collect();
                let kinds = fields.iter().map(|name| {
                    let found = state.field(name);
                    found.map_or("NOT_FOUND", |(kind, _)| kind)
                });
                let kinds = kinds.collect::<Vec<_>>().join(",");
                [&[1], kinds.as_bytes()].concat()
            }
            b'S' => vec![1],
            b'P' => {
                state.listeners.clear();
                vec![1]
            }
            _ => continue,
        };
        if stream.write_all(&package(head[2], &answer)).is_err() {
            return;
        }
        if head[2] == b'S' {
            let out = stream.try_clone().unwrap();
            out.set_nonblocking(false).unwrap();
            out.set_write_timeout(Some(Duration::from_millis(1)))
                .unwrap();
            state.listeners.push(Listener {
                stream: out,
                fields: fields.clone(),
                every,
            });
        }
    }
}

/// Sends the states of a cycle. What a client has no room for is left out.
pub(crate) fn send_states(state: &mut State) {
    let cycles = state.cycles;
    let mut listeners = std::mem::take(&mut state.listeners);
    listeners.retain_mut(|listener| {
        if !cycles.is_multiple_of(listener.every) {
            return true;
        }
        let mut payload = vec![1];
        for name in &listener.fields {
            payload.extend(
                state
                    .field(name)
                    .map(|(_, bytes)| bytes)
                    .unwrap_or_default(),
            );
        }
        match listener.stream.write_all(&package(b'U', &payload)) {
            Ok(()) => true,
            Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
        }
    });
    state.listeners = listeners;
}

/// A client of the dashboard server.
pub(crate) fn dashboard(mut stream: TcpStream, state: &Arc<Mutex<State>>) {
    let greeting = "Connected: Universal Robots Dashboard Server\n";
    if stream.write_all(greeting.as_bytes()).is_err() {
        return;
    }
    let lines = BufReader::new(stream.try_clone().unwrap()).lines();
    for line in lines.map_while(Result::ok) {
        let (answer, ended) = command(line.trim(), &mut state.lock().unwrap());
        drop(ended);
        if stream.write_all(format!("{answer}\n").as_bytes()).is_err() {
            return;
        }
    }
}

/// Carries out a command; returns the answer and a program that has ended.
fn command(line: &str, state: &mut State) -> (String, Option<Running>) {
    let time = state.time();
    let answer = match line {
        "is in remote control" if state.setting.version[0] >= 5 => state.setting.remote.to_string(),
        "robotmode" => format!("Robotmode: {}", state.robot_mode),
        "power on" => {
            if state.robot_mode == POWER_OFF {
                state.next_mode = Some((time + 0.1, 4));
            }
            "Powering on".to_owned()
        }
        "brake release" => {
            if state.robot_mode == IDLE {
                state.next_mode = Some((time + 0.2, RUNNING));
            }
            "Brake releasing".to_owned()
        }
        "close safety popup" => "closing safety popup".to_owned(),
        "unlock protective stop" => {
            if state.safety_mode == PROTECTIVE
                && time - state.protective_since < state.setting.unlock
            {
                "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of \
                 protective stop before unlocking"
                    .to_owned()
            } else {
                state.safety_mode = NORMAL;
                "Protective stop releasing".to_owned()
            }
        }
        "stop" => {
            let ended = state.stop_program();
            return ("Stopped".to_owned(), ended);
        }
        "pause" => {
            if state.runtime == PLAYING {
                state.runtime = PAUSED;
                state.motion.doing = super::motion::Doing::Stop(10.0);
            }
            "Pausing program".to_owned()
        }
        _ => format!("could not understand: '{line}'"),
    };
    (answer, None)
}

/// A client of the primary interface: programs come, messages go.
pub(crate) fn primary(mut stream: TcpStream, state: &Arc<Mutex<State>>) {
    let out = stream.try_clone().unwrap();
    out.set_write_timeout(Some(Duration::from_millis(1)))
        .unwrap();
    state.lock().unwrap().primaries.push(out);
    let (mut text, mut block) = (String::new(), [0; 4096]);
    loop {
        let Ok(count @ 1..) = stream.read(&mut block) else {
            return;
        };
        text.push_str(&String::from_utf8_lossy(&block[..count]));
        let programs = match read(&text) {
            Err(SyntaxError::Unfinished) => continue,
            Err(SyntaxError::Wrong(line, what)) => {
                state.lock().unwrap().exception(line, &what);
                Vec::new()
            }
            Ok(programs) => programs,
        };
        text.clear();
        for program in programs {
            let functions = Arc::new(Library(Arc::clone(state)));
            let running = Running::new(program.body, functions);
            let ended = {
                let mut state = state.lock().unwrap();
                let may = state.robot_mode == RUNNING && state.safety_mode == NORMAL;
                if program.secondary {
                    state.beside.push(running);
                    None
                } else if may && (state.setting.remote || state.setting.version[0] < 5) {
                    let ended = state.stop_program();
                    state.program = Some(running);
                    state.runtime = PLAYING;
                    ended
                } else {
                    // A real one is silent about a program that it does not take.
                    Some(running)
                }
            };
            drop(ended);
        }
    }
}
