//! A fault at any moment leaves the time before it.

use std::fs;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::canter::{canter, command};
use crate::{PATIENCE, PROGRAM, arm, engine, send, wait_for};
use system_tests::killed::Killed;
use system_tests::signal;
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

/// How long the engine is stopped: longer than the watchdogs of engine and driver.
const STOPPED: Duration = Duration::from_millis(600);

/// Runs the program, stops the engine for longer than the watchdogs at `after_ms`, and reads the file
/// that the fault names: seconds of it before the fault.
fn fault_after(name: &str, after_ms: u64) -> f64 {
    let arm = arm(name);
    let folder = tempfile::tempdir().unwrap();
    let faults = format!("--faults={}", folder.path().display());
    let engine = engine(&arm, &[faults]);
    let _program = send(&arm, PROGRAM);
    wait_for(&arm, |now| now["idle"] == false);
    std::thread::sleep(Duration::from_millis(after_ms));
    signal::send(&engine.0, libc::SIGSTOP);
    std::thread::sleep(STOPPED);
    signal::send(&engine.0, libc::SIGCONT);
    let end = Instant::now() + PATIENCE;
    let named = named_file(&arm, end);
    assert!(named.starts_with(folder.path()), "{}", named.display());
    while !named.exists() {
        assert!(Instant::now() < end, "{} is not finished", named.display());
        std::thread::sleep(Duration::from_millis(50));
    }
    let recorded = recorder::read(&named).unwrap();
    assert_eq!(recorded.head.reason, "fault");
    assert!(recorded.cut.is_none() && !recorded.damaged);
    assert_eq!(recorded.programs.len(), 1);
    let is_fault = |note: &&recorder::RecordedNote| note.json.contains("\"faulted\"");
    let fault = recorded.notes.iter().find(is_fault).unwrap();
    let note: serde_json::Value = serde_json::from_str(&fault.json).unwrap();
    let tick = note["tick"].as_u64().unwrap();
    let before = recorded
        .samples
        .iter()
        .filter(|sample| sample.tick <= tick)
        .count();
    let seconds = before as f64 * 1e-3;
    // All that the session had before it was stopped, but for periods that a loaded machine skips.
    let lived = tick.min(60_000) as f64 * 1e-3 - STOPPED.as_secs_f64();
    assert!(seconds > 0.5 * lived, "{seconds} s of {lived} s");
    let ran = canter(["replay", "--info", &named.display().to_string()]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stdout.contains("1 programs"), "{}", ran.stdout);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(replayed(&named, recorded.samples[0].tick), "ur5e");
    seconds
}

/// Opens a file in replay, as a page does, and waits for its first period; gives the robot.
fn replayed(file: &Path, first: u64) -> String {
    let mut replay = command(["replay", &file.display().to_string(), "--port", "0"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(replay.stderr.take().unwrap());
    let _replay = Killed(replay);
    let mut line = String::new();
    while !line.contains("http://") {
        line.clear();
        assert!(stderr.read_line(&mut line).unwrap() > 0, "no address");
    }
    let (_, address) = line.trim().split_once("http://").unwrap();
    let (host, token) = address.split_once("/#").unwrap();
    let mut request = format!("ws://{host}/live").into_client_request().unwrap();
    let protocols = format!("canter, token.{token}").parse().unwrap();
    let headers = request.headers_mut();
    headers.insert("Sec-WebSocket-Protocol", protocols);
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let (mut socket, _) = tungstenite::client(request, stream).unwrap();
    let wish = r#"{"number":1,"do":"seek","at":0}"#;
    socket.send(Message::Text(wish.into())).unwrap();
    let mut robot = None;
    loop {
        match socket.read().unwrap() {
            Message::Text(text) => {
                let message: serde_json::Value = serde_json::from_str(text.as_str()).unwrap();
                let name = message["robot"]["name"].as_str();
                robot = robot.or(name.map(str::to_owned));
            }
            Message::Binary(bytes) if bytes[16..24] == first.to_le_bytes() => {
                return robot.expect("the robot comes first");
            }
            _ => {}
        }
    }
}

/// The file that the fault's message names.
fn named_file(arm: &str, end: Instant) -> PathBuf {
    loop {
        let ran = canter(["status", "--json", "--arm", arm]);
        let now: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        let fault = now["fault"].as_str();
        if let Some(fault) = fault.filter(|fault| fault.contains(".mcap")) {
            return fault.rsplit(' ').next().map(PathBuf::from).unwrap();
        }
        assert!(Instant::now() < end, "no fault with a file: {now}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A fault writes the time before it to a file that its message names.
pub(crate) fn a_fault_leaves_the_minute_before_it() {
    for (number, after_ms) in [(0, 1200), (1, 3437)] {
        fault_after(&format!("fault{number}"), after_ms);
    }
}

/// The same at twenty moments of the program.
pub(crate) fn twenty_faults_leave_the_minute_before_them() {
    for number in 0..20_u64 {
        let after_ms = 200 + number * 7919 % 6400;
        let seconds = fault_after(&format!("faults{number}"), after_ms);
        println!(
            "fault {number}, {after_ms} ms after the program: {seconds:.3} s before it are there"
        );
    }
}
