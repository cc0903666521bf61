use std::io::{self, Write};

use clap::Args;
use measure::{Ends, otg};
use serde::Serialize;

use super::Problems;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// State-to-state trajectories of random problems: planning times and validity
///
/// Start and target are drawn as in Ruckig's own benchmark. The time of a problem is the shortest
/// of several passes, so that stalls of the machine do not count.
#[derive(Args, Debug)]
pub(crate) struct Otg {
    #[command(flatten)]
    problems: Problems,
}

#[derive(Serialize)]
struct OtgReport {
    schema: u32,
    seed: u64,
    count: u32,
    rows: Vec<OtgLine>,
}

#[derive(Serialize)]
struct OtgLine {
    joints: usize,
    ends: &'static str,
    failed: usize,
    mean_us: f64,
    median_us: f64,
    p99_us: f64,
    max_us: f64,
    mean_motion_s: f64,
    worst_error: f64,
}

impl Otg {
    /// Measures and prints; a problem that cannot be planned, or a move that is not valid, fails.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let Problems { seed, count, json } = self.problems;
        let rows = otg::bench(seed, count as usize);
        let report = OtgReport {
            schema: 1,
            seed,
            count,
            rows: rows.iter().map(row).collect(),
        };
        if json {
            output::json(&report)?;
        } else {
            table(&report)?;
        }
        let sound = report
            .rows
            .iter()
            .all(|row| row.failed == 0 && row.worst_error <= 1e-9);
        Ok(if sound { Exit::Done } else { Exit::Refused })
    }
}

fn row(row: &otg::OtgRow) -> OtgLine {
    OtgLine {
        joints: row.joints,
        ends: match row.ends {
            Ends::Moving => "moving",
            Ends::Stopping => "stopping",
            Ends::Resting => "resting",
        },
        failed: row.failed,
        mean_us: row.mean_us,
        median_us: row.median_us,
        p99_us: row.p99_us,
        max_us: row.max_us,
        mean_motion_s: row.move_s,
        worst_error: row.worst,
    }
}

fn table(report: &OtgReport) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "{:>6}  {:9} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "joints", "ends", "failed", "mean us", "median us", "p99 us", "max us", "motion s", "error"
    )?;
    for row in &report.rows {
        writeln!(
            out,
            "{:6}  {:9} {:7} {:9.3} {:9.3} {:9.3} {:9.3} {:9.4} {:9.1e}",
            row.joints,
            row.ends,
            row.failed,
            row.mean_us,
            row.median_us,
            row.p99_us,
            row.max_us,
            row.mean_motion_s,
            row.worst_error
        )?;
    }
    writeln!(
        out,
        "{} problems a row, seed {}; error: worst of the audit, in parts of the limits",
        report.count, report.seed
    )
}
