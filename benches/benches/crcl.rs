//! The CRCL server beside a moving arm. The goals: GetStatus answered within 1 ms at p99, and a servo
//! period that eight connections at 1 kHz leave as it was.
//!
//! The peer is an echo over TCP that answers each request with as many bytes, by the same clients in
//! the same run. `cargo build --release`, then
//! `cargo bench -p benches --no-default-features --features crcl --bench crcl`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench prints, and may stop"
)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

use ipc::{Arm, Domain};

/// How long the servo period is watched, alone and beside clients.
const WATCH: Duration = Duration::from_secs(8);

/// How many clients ask, and how often each.
const CLIENTS: usize = 8;
const PERIOD: Duration = Duration::from_millis(1);

const XSI: &str = "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"";

/// A process that ends with the benchmark.
struct Peer(Child);

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The command `canter`: named, or built beside this benchmark.
fn canter() -> PathBuf {
    let named = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    let built = || {
        let me = std::env::current_exe().unwrap();
        me.ancestors().nth(2).unwrap().join("canter")
    };
    let path = named.map_or_else(built, PathBuf::from);
    assert!(
        path.is_file(),
        "{} is missing: cargo build --release",
        path.display()
    );
    path
}

/// Starts `canter`; gives the line of its standard error that has this text in it.
fn start(words: &[&str], text: &str) -> (Peer, String) {
    let mut child = Command::new(canter())
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let peer = Peer(child);
    loop {
        let mut line = String::new();
        assert!(stderr.read_line(&mut line).unwrap() > 0, "{words:?} ended");
        if line.contains(text) {
            spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
            return (peer, line);
        }
    }
}

/// A client of the server.
struct Client(TcpStream);

impl Client {
    fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_nodelay(true).unwrap();
        Self(stream)
    }

    fn send(&mut self, kind: &str, id: usize, inside: &str) {
        let text = format!(
            "<CRCLCommandInstance><CRCLCommand xsi:type=\"{kind}Type\" {XSI}><CommandID>{id}\
             </CommandID>{inside}</CRCLCommand></CRCLCommandInstance>"
        );
        self.0.write_all(text.as_bytes()).unwrap();
    }

    /// The next status: the server writes each in one piece, and the loopback keeps it whole.
    fn answer(&mut self) -> String {
        let mut text = Vec::new();
        let mut buffer = [0; 8192];
        while !text.ends_with(b"</CRCLStatus>") {
            let count = self.0.read(&mut buffer).unwrap();
            assert!(count > 0, "the server has gone");
            text.extend_from_slice(&buffer[..count]);
        }
        String::from_utf8(text).unwrap()
    }

    fn status(&mut self) -> String {
        self.send("GetStatus", 0, "");
        self.answer()
    }

    /// Waits until a command is done.
    fn done(&mut self, kind: &str, id: usize, inside: &str) -> String {
        self.send(kind, id, inside);
        loop {
            let status = self.status();
            assert!(!status.contains("CRCL_Error"), "{status}");
            if status.contains(&format!("<CommandID>{id}<")) && status.contains("CRCL_Done") {
                return status;
            }
            sleep(Duration::from_millis(20));
        }
    }
}

/// Moves the arm up and down until it is told to end.
fn mover(address: SocketAddr, ends: Arc<AtomicBool>) -> JoinHandle<()> {
    let mut client = Client::connect(address);
    client.done("InitCanon", 1, "");
    let status = client.status();
    let pose = &status[status.find("<Pose>").unwrap() + 6..status.find("</Pose>").unwrap()];
    let (from, to) = (pose.find("<Z>").unwrap() + 3, pose.find("</Z>").unwrap());
    let z: f64 = pose[from..to].parse().unwrap();
    let places = [z - 60.0, z].map(|z| format!("{}{z}{}", &pose[..from], &pose[to..]));
    spawn(move || {
        let mut id = 2;
        while !ends.load(Ordering::Acquire) {
            let place = &places[id % 2];
            let inside =
                format!("<MoveStraight>true</MoveStraight><EndPosition>{place}</EndPosition>");
            client.done("MoveTo", id, &inside);
            id += 1;
        }
    })
}

/// Times from request to answer of clients that ask once a period (ns), all together, in order.
fn poll(ask: impl Fn() -> Box<dyn FnMut() + Send>, ends: &Arc<AtomicBool>) -> Vec<u64> {
    let client = || {
        let (mut ask, ends) = (ask(), Arc::clone(ends));
        spawn(move || {
            let mut times = Vec::new();
            let mut next = Instant::now();
            while !ends.load(Ordering::Acquire) {
                let begin = Instant::now();
                ask();
                times.push(u64::try_from(begin.elapsed().as_nanos()).unwrap());
                next = (next + PERIOD).max(Instant::now());
                sleep(next - Instant::now());
            }
            times
        })
    };
    let threads: Vec<_> = (0..CLIENTS).map(|_| client()).collect();
    let mut all: Vec<u64> = threads
        .into_iter()
        .flat_map(|thread| thread.join().unwrap())
        .collect();
    all.sort_unstable();
    all
}

fn quantile(sorted: &[u64], share: f64) -> f64 {
    let index = (sorted.len() as f64 * share) as usize;
    sorted[index.min(sorted.len() - 1)] as f64 / 1e3
}

fn print(name: &str, times: &mut [u64]) {
    times.sort_unstable();
    let at = |share| quantile(times, share);
    println!(
        "{name}: p50 {:.1} us, p99 {:.1} us, p99.9 {:.1} us, {} in all",
        at(0.5),
        at(0.99),
        at(0.999),
        times.len()
    );
}

/// What the servo thread has done since its engine started: wake-up and work of a period (p50, p99,
/// longest; ns), and how many periods were left out.
#[derive(Clone, Copy, Debug)]
struct Periods {
    wake_up: [u64; 3],
    work: [u64; 3],
    left_out: u64,
}

impl Periods {
    /// As the engine of an arm counts them.
    fn of(arm: &Arm) -> Self {
        let client = ipc::Client::open(arm, "bench crcl").unwrap();
        let answer = client
            .ask(ipc::Verb::Status, Duration::from_secs(2))
            .unwrap();
        let status = &answer.body["status"];
        let spread = |name: &str| {
            ["p50", "p99", "longest"].map(|at| status["timing"][name][at].as_u64().unwrap())
        };
        Self {
            wake_up: spread("wake_up"),
            work: spread("work"),
            left_out: status["cycles"]["skipped"].as_u64().unwrap(),
        }
    }

    fn print(&self, name: &str) {
        for (part, [p50, p99, longest]) in [("wake-up", self.wake_up), ("work", self.work)] {
            let us = |ns: u64| ns as f64 / 1e3;
            println!(
                "{part} {name}: p50 {:.1} us, p99 {:.1} us, longest {:.1} us",
                us(p50),
                us(p99),
                us(longest)
            );
        }
        println!("periods left out {name}: {}", self.left_out);
    }
}

/// An engine with a CRCL server, and an arm that moves.
struct Scene {
    arm: Arm,
    address: SocketAddr,
    ends: Arc<AtomicBool>,
    mover: Option<JoinHandle<()>>,
    _processes: [Peer; 2],
}

impl Scene {
    fn new(name: &str) -> Self {
        let name = format!("bench-{}/{name}", std::process::id());
        let domain = Domain::choose(None, |name| std::env::var_os(name)).unwrap();
        let arm = domain.arm(&name).unwrap();
        let words = ["engine", "--robot", "ur5e", "--arm", &name];
        let (engine, _) = start(&words, "engine of ur5e");
        let listen = ["serve", "crcl", "--arm", &name, "--listen", "127.0.0.1:0"];
        let (server, line) = start(&listen, "serving CRCL at");
        let address = line.trim().rsplit(' ').next().unwrap().parse().unwrap();
        let ends = Arc::new(AtomicBool::new(false));
        Self {
            arm,
            address,
            mover: Some(mover(address, Arc::clone(&ends))),
            ends,
            _processes: [server, engine],
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        if let Some(mover) = self.mover.take() {
            mover.join().unwrap();
        }
    }
}

/// Answers whatever comes with so many bytes.
fn echo(bytes: usize) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            stream.set_nodelay(true).unwrap();
            spawn(move || {
                let (mut buffer, answer) = ([0; 4096], vec![b'x'; bytes]);
                while stream.read(&mut buffer).is_ok_and(|count| count > 0)
                    && stream.write_all(&answer).is_ok()
                {}
            });
        }
    });
    address
}

/// Asks from eight clients for a while; gives the times.
fn polled(ask: impl Fn() -> Box<dyn FnMut() + Send> + Send + 'static, time: Duration) -> Vec<u64> {
    let ends = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&ends);
    let clients = spawn(move || poll(ask, &stop));
    sleep(time);
    ends.store(true, Ordering::Release);
    clients.join().unwrap()
}

fn main() {
    let alone = Scene::new("alone");
    sleep(WATCH);
    let before = Periods::of(&alone.arm);
    before.print("alone");
    drop(alone);

    let scene = Scene::new("beside");
    let address = scene.address;
    let ask = move || -> Box<dyn FnMut() + Send> {
        let mut client = Client::connect(address);
        Box::new(move || drop(client.status()))
    };
    let mut answers = polled(ask, WATCH);
    let beside = Periods::of(&scene.arm);
    beside.print("beside eight clients at 1 kHz");
    print("GetStatus while the arm moves", &mut answers);

    let size = Client::connect(address).status().len();
    let echo = echo(size);
    let ask = move || -> Box<dyn FnMut() + Send> {
        let mut stream = TcpStream::connect(echo).unwrap();
        stream.set_nodelay(true).unwrap();
        let mut buffer = vec![0; size];
        Box::new(move || {
            stream.write_all(&[b'x'; 228]).unwrap();
            stream.read_exact(&mut buffer).unwrap();
        })
    };
    let mut echoes = polled(ask, WATCH / 2);
    print("echo of as many bytes", &mut echoes);
    drop(scene);
    for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
        let ratio = quantile(&answers, share) / quantile(&echoes, share);
        println!("ratio echo-{name} {ratio:.3}");
    }
    for (name, at) in [("p50", 0), ("p99", 1)] {
        let wake_up = beside.wake_up[at] as f64 / before.wake_up[at] as f64;
        let work = beside.work[at] as f64 / before.work[at] as f64;
        println!("ratio wake-up-alone-{name} {wake_up:.3}");
        println!("ratio work-alone-{name} {work:.3}");
    }
}
