//! Ten pages at once: what they cost, and that each gets all periods.

use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ipc::Observer;
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

use crate::scene::Scene;

/// How many pages there are.
const PAGES: usize = 10;

/// What a page got: periods, those that did not get there, and those that the engine left out.
#[derive(Clone, Copy, Debug, Default)]
struct Got {
    rows: u64,
    lost: u64,
    skipped: u64,
}

/// A page that reads blocks until it is told to end.
fn page(scene: &Scene, ends: &Arc<AtomicBool>) -> JoinHandle<Got> {
    let (port, ends) = (scene.port(), Arc::clone(ends));
    let token = scene.watch.rsplit('#').next().unwrap().to_owned();
    std::thread::spawn(move || {
        let address = format!("ws://127.0.0.1:{port}/live");
        let mut request = address.into_client_request().unwrap();
        let protocols = format!("canter, token.{token}").parse().unwrap();
        request
            .headers_mut()
            .insert("Sec-WebSocket-Protocol", protocols);
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(30)))
            .unwrap();
        let (mut socket, _) = tungstenite::client(request, stream).unwrap();
        let mut got = Got::default();
        let mut next = None;
        while !ends.load(Ordering::Relaxed) {
            let Message::Binary(bytes) = socket.read().unwrap() else {
                continue;
            };
            let rows = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
            let tick = u64::from_le_bytes(bytes[16..24].try_into().unwrap());
            let sequence = u64::from_le_bytes(bytes[24..32].try_into().unwrap());
            let (tick_wanted, sequence_wanted) = next.unwrap_or((tick, sequence));
            assert!(
                tick >= tick_wanted && sequence >= sequence_wanted,
                "time goes back"
            );
            let lost = sequence - sequence_wanted;
            got.lost += lost;
            got.skipped += tick - tick_wanted - lost;
            got.rows += u64::from(rows);
            next = Some((tick + u64::from(rows), sequence + u64::from(rows)));
        }
        got
    })
}

/// Processor time (s) and memory (kB) of a process.
fn cost(process: u32) -> (f64, u64) {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .collect();
    let ticks: u64 = fields[11..13]
        .iter()
        .map(|field| field.parse::<u64>().unwrap())
        .sum();
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS"))
        .unwrap();
    let memory = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    (ticks as f64 / 100.0, memory)
}

/// A thread that notes how late each setpoint was published after the beginning of its period (us),
/// until it is told to end.
fn lateness(scene: &Scene, ends: &Arc<AtomicBool>) -> JoinHandle<Vec<u64>> {
    let (arm, ends) = (system_tests::domain::arm(&scene.arm), Arc::clone(ends));
    std::thread::spawn(move || {
        let observer = Observer::open(&arm).unwrap();
        let mut late = Vec::new();
        while !ends.load(Ordering::Relaxed) {
            while let Some(setpoint) = observer.next_setpoint() {
                late.push(setpoint.published_ns.saturating_sub(setpoint.tick_ns) / 1000);
            }
            std::thread::sleep(Duration::from_millis(4));
        }
        late.sort_unstable();
        late
    })
}

/// Runs `pages` pages for a time, and prints what they cost; gives the growth of memory (kB).
fn run(scene: &Scene, pages: usize, seconds: u64) -> i64 {
    let ends = Arc::new(AtomicBool::new(false));
    let threads: Vec<JoinHandle<Got>> = (0..pages).map(|_| page(scene, &ends)).collect();
    let periods = lateness(scene, &ends);
    // What is set up with the first blocks is no growth.
    std::thread::sleep(Duration::from_secs(2));
    let (begun, before, cycles) = (Instant::now(), cost(scene.view_process()), scene.status());
    let mut said = Instant::now();
    while begun.elapsed() < Duration::from_secs(seconds) {
        std::thread::sleep(Duration::from_millis(100));
        if said.elapsed() > Duration::from_secs(60) {
            said = Instant::now();
            println!(
                "  {:.0} s: {} kB",
                begun.elapsed().as_secs_f64(),
                cost(scene.view_process()).1
            );
        }
    }
    let (after, later) = (cost(scene.view_process()), scene.status());
    let wall = begun.elapsed().as_secs_f64();
    ends.store(true, Ordering::Relaxed);
    let got: Vec<Got> = threads
        .into_iter()
        .map(|thread| thread.join().unwrap())
        .collect();
    let count = |status: &serde_json::Value, name: &str| status["cycles"][name].as_u64().unwrap();
    let lost = got.iter().map(|got| got.lost).max().unwrap_or(0);
    let late = periods.join().unwrap();
    let share = |part: f64| late[((late.len() - 1) as f64 * part) as usize];
    println!(
        "{pages} pages, {wall:.0} s: server {:.2} % of a core, {} kB; engine skipped {} of {} periods; \
         published after p50 {} p99 {} p99.9 {} max {} us; the worst page lacks {lost}",
        100.0 * (after.0 - before.0) / wall,
        after.1,
        count(&later, "skipped") - count(&cycles, "skipped"),
        count(&later, "ticks") - count(&cycles, "ticks"),
        share(0.5),
        share(0.99),
        share(0.999),
        share(1.0),
    );
    // Whatever the machine does, no page lacks what another one got in the same time.
    let rates: Vec<f64> = got
        .iter()
        .map(|got| got.rows as f64 / (got.rows + got.lost + got.skipped) as f64)
        .collect();
    let least = rates.iter().copied().fold(1.0, f64::min);
    let most = rates.iter().copied().fold(0.0, f64::max);
    assert!(pages == 0 || most - least < 0.05, "{rates:?}");
    after.1 as i64 - before.1 as i64
}

/// Ten pages get the same periods, and the server's memory does not grow with time.
pub(crate) fn ten_pages_at_once() {
    let scene = Scene::start("crowd");
    run(&scene, 0, 3);
    run(&scene, 1, 4);
    let growth = run(&scene, PAGES, 6);
    assert!(growth < 4096, "{growth} kB more");
}

/// The same for half an hour, or for `CANTER_CROWD_S` seconds.
pub(crate) fn ten_pages_for_half_an_hour() {
    let scene = Scene::start("crowd");
    let asked = std::env::var("CANTER_CROWD_S").ok();
    let seconds = asked.map_or(1800, |text| text.parse().unwrap());
    run(&scene, 0, seconds.min(60));
    run(&scene, 1, seconds.min(60));
    let growth = run(&scene, PAGES, seconds);
    assert!(growth < 4096, "{growth} kB more");
}
