//! Makes many kits with a simulated arm and prints the computing time per kit at the start and at
//! the end.
//!
//! `cargo run --release -p plan --example many_kits -- 1000`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example")]

use std::collections::BTreeMap;
use std::time::Instant;

use plan::run::{
    Cell, Controller, Event, RunOptions, SimulatedFactotum, SimulatedMotion, Stock, prepare,
};
use plan::world::{Durability, Reader, Writer, import_toml};

/// Resident memory of this process (kB).
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok())
        .unwrap_or(0)
}

fn main() {
    let kits: usize = std::env::args()
        .nth(1)
        .map_or(1000, |text| text.parse().unwrap());
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/kitting");
    let source = std::fs::read_to_string(folder.join("kit-abc.plan")).unwrap();
    let world = std::fs::read_to_string(folder.join("workstation.toml")).unwrap();
    let world = import_toml(&world).unwrap();
    let path = std::env::temp_dir().join(format!("many_kits_{}.db", std::process::id()));
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    writer.replace(&world).unwrap();
    let stock = Stock::of(&world, &prepare(&source, &world).unwrap().0.plan);
    let mut factotum = SimulatedFactotum::new(stock.clone());
    let mut motion = SimulatedMotion::default();
    let reader = Reader::open(&path).unwrap();
    let cell = Cell {
        writer,
        reader,
        motion: &mut motion,
        factotum: &mut factotum,
    };
    let given = BTreeMap::from([("NumberOfKitsToMake".to_owned(), kits.to_string())]);
    let mut controller =
        Controller::start(cell, &source, &given, &stock, RunOptions::default()).unwrap();
    let began = Instant::now();
    let mut times = vec![0.0];
    let mut memories = vec![memory()];
    let report = controller
        .run(&mut |event| {
            if let Event::Kit(_) = event {
                times.push(began.elapsed().as_secs_f64());
                memories.push(memory());
            }
        })
        .unwrap();
    drop(controller);
    let database = std::fs::metadata(&path).map_or(0, |data| data.len());
    for ending in ["", "-wal", "-shm"] {
        let _ = std::fs::remove_file(format!("{}{ending}", path.display()));
    }
    let window = 100.min(kits);
    let last = times.len() - 1;
    let (first_s, last_s) = (times[window] - times[0], times[last] - times[last - window]);
    println!(
        "{} after {} kits, {} statements",
        report.outcome, report.counters.kits, report.counters.statements
    );
    println!(
        "first {window}: {:.3} ms a kit, last {window}: {:.3} ms a kit, ratio {:.3}",
        first_s * 1e3 / window as f64,
        last_s * 1e3 / window as f64,
        last_s / first_s
    );
    println!(
        "memory after {window} kits {} kB, at the end {} kB; database {} kB",
        memories[window],
        memories[last],
        database / 1024
    );
}
