use std::io::{self, Write};

use clap::Args;
use measure::timing;
use serde::Serialize;

use super::Problems;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// Jerk-limited time laws along random joint paths: planning times and certificates
///
/// The paths are splines through random waypoints. The time of a path is the shortest of several
/// passes, so that stalls of the machine do not count.
#[derive(Args, Debug)]
pub(crate) struct Timing {
    #[command(flatten)]
    problems: Problems,
}

#[derive(Serialize)]
struct TimingReport {
    schema: u32,
    seed: u64,
    count: u32,
    rows: Vec<TimingLine>,
}

#[derive(Serialize)]
struct TimingLine {
    joints: usize,
    waypoints: usize,
    failed: usize,
    uncertified: usize,
    mean_ms: f64,
    p99_ms: f64,
    mean_motion_s: f64,
    duration_over_bound: f64,
    fit_error_rad: f64,
}

impl Timing {
    /// Measures and prints; a path without a certified time law fails.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let Problems { seed, count, json } = self.problems;
        let report = TimingReport {
            schema: 1,
            seed,
            count,
            rows: timing::bench(seed, count as usize)
                .iter()
                .map(row)
                .collect(),
        };
        if json {
            output::json(&report)?;
        } else {
            table(&report)?;
        }
        let sound = report
            .rows
            .iter()
            .all(|row| row.failed == 0 && row.uncertified == 0);
        Ok(if sound { Exit::Done } else { Exit::Refused })
    }
}

fn row(row: &timing::TimingRow) -> TimingLine {
    TimingLine {
        joints: row.joints,
        waypoints: row.waypoints,
        failed: row.failed,
        uncertified: row.uncertified,
        mean_ms: row.mean_ms,
        p99_ms: row.p99_ms,
        mean_motion_s: row.motion_s,
        duration_over_bound: row.optimality,
        fit_error_rad: row.fit_error,
    }
}

fn table(report: &TimingReport) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "{:>6} {:>9} {:>7} {:>11} {:>9} {:>9} {:>9} {:>11} {:>9}",
        "joints",
        "waypoints",
        "failed",
        "uncertified",
        "mean ms",
        "p99 ms",
        "motion s",
        "time/bound",
        "fit rad"
    )?;
    for row in &report.rows {
        writeln!(
            out,
            "{:6} {:9} {:7} {:11} {:9.3} {:9.3} {:9.4} {:11.4} {:9.1e}",
            row.joints,
            row.waypoints,
            row.failed,
            row.uncertified,
            row.mean_ms,
            row.p99_ms,
            row.mean_motion_s,
            row.duration_over_bound,
            row.fit_error_rad
        )?;
    }
    writeln!(
        out,
        "{} paths a row, seed {}; bound: no motion under the velocity and acceleration limits is faster",
        report.count, report.seed
    )
}
