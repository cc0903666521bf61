//! Ten pages at once: what they cost, and that each gets all periods.

use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

use crate::scene::Scene;

/// How many pages there are.
const PAGES: usize = 10;

/// Ticks that a page got: first, last, and how many.
type Got = (u64, u64, u64);

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
        let (mut first, mut next, mut count) = (None, 0, 0);
        while !ends.load(Ordering::Relaxed) {
            let Message::Binary(bytes) = socket.read().unwrap() else {
                continue;
            };
            let rows = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
            let tick = u64::from_le_bytes(bytes[16..24].try_into().unwrap());
            assert!(tick >= next, "time goes back");
            first.get_or_insert(tick);
            next = tick + u64::from(rows);
            count += u64::from(rows);
        }
        (first.unwrap_or(0), next, count)
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

/// Runs `pages` pages for a time, and prints what they cost; gives the growth of memory (kB).
fn run(scene: &Scene, pages: usize, seconds: u64) -> i64 {
    let ends = Arc::new(AtomicBool::new(false));
    let threads: Vec<JoinHandle<Got>> = (0..pages).map(|_| page(scene, &ends)).collect();
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
    let lost: u64 = got
        .iter()
        .map(|(first, next, count)| next - first - count)
        .max()
        .unwrap_or(0);
    println!(
        "{pages} pages, {wall:.0} s: server {:.2} % of a core, {} kB; engine skipped {} of {} periods; \
         the worst page lacks {lost}",
        100.0 * (after.0 - before.0) / wall,
        after.1,
        count(&later, "skipped") - count(&cycles, "skipped"),
        count(&later, "ticks") - count(&cycles, "ticks"),
    );
    // Whatever the machine does, no page lacks what another one got in the same time.
    let rates: Vec<f64> = got
        .iter()
        .map(|(first, next, count)| *count as f64 / (next - first) as f64)
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

/// The same for ten minutes.
pub(crate) fn ten_pages_for_ten_minutes() {
    let scene = Scene::start("crowd");
    run(&scene, 0, 60);
    run(&scene, 1, 60);
    let growth = run(&scene, PAGES, 600);
    assert!(growth < 4096, "{growth} kB more");
}
