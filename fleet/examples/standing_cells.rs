//! Many cells whose arms stand still, in one process: what a fleet sees of them, without servo and
//! driver. For measuring a fleet that is larger than the machine could move.
//!
//! `standing_cells FOLDER STATUS CELL...` serves CELL/arm in the domain FOLDER/CELL, with the reports of
//! the file STATUS (JSON, as `canter status --json` prints it). It ends with its input.
#![allow(clippy::print_stdout, reason = "it says when it serves")]

use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ipc::{Answer, ClientServer, ControlServer, Domain, StatusWriter, Verb};
use serde_json::{Value, json};

/// As an engine does.
const TURN: Duration = Duration::from_millis(5);
const REPORT: Duration = Duration::from_millis(100);

type Failure = Box<dyn std::error::Error>;

/// What an engine has for clients.
struct Cell {
    name: String,
    server: ClientServer,
    reports: StatusWriter,
    /// Held, so that nobody else serves the arm; nothing is asked of it here.
    _control: ControlServer,
}

impl Cell {
    fn open(folder: &Path, name: &str) -> Result<Self, Failure> {
        let arm = Domain::open(&folder.join(name))?.arm(&format!("{name}/arm"))?;
        Ok(Self {
            name: name.to_owned(),
            server: ClientServer::open(&arm)?,
            reports: StatusWriter::open(&arm)?,
            _control: ControlServer::open(&arm)?,
        })
    }

    fn serve(&self, status: &Value) -> Result<(), Failure> {
        let session = format!("standing-{}", self.name);
        self.server.serve(|request| match request.ask {
            Verb::Status => Answer::accept(json!({
                "session": session, "last_note": 0, "status": status,
            })),
            Verb::Notes { .. } => Answer::accept(json!({"session": session, "notes": []})),
            _ => Answer::refuse("this arm stands still: it is there to be counted"),
        })?;
        Ok(())
    }
}

fn main() -> Result<(), Failure> {
    let mut words = std::env::args().skip(1);
    let (Some(folder), Some(file)) = (words.next(), words.next()) else {
        return Err("expected FOLDER STATUS CELL...".into());
    };
    let status: Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    let folder = Path::new(&folder);
    let cells: Vec<Cell> = words
        .map(|name| Cell::open(folder, &name))
        .collect::<Result<_, _>>()?;
    println!("{} cells stand", cells.len());
    let ends = Arc::new(AtomicBool::new(false));
    let over = Arc::clone(&ends);
    thread::spawn(move || {
        // Its input ends with who started it.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        over.store(true, Ordering::Release);
    });
    // Not all at the same time.
    let start = Instant::now();
    let mut reported: Vec<Instant> = (0..cells.len())
        .map(|number| start + REPORT * u32::try_from(number).unwrap_or(0) / 100)
        .collect();
    while !ends.load(Ordering::Acquire) {
        for (cell, at) in cells.iter().zip(&mut reported) {
            cell.serve(&status)?;
            if Instant::now() >= *at {
                *at += REPORT;
                cell.reports.write(&status)?;
            }
        }
        thread::sleep(TURN);
    }
    Ok(())
}
