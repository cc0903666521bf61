use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use measure::smooth::{self, Measure};
use planner::robot::Robot;
use serde::Serialize;
use trajectory::smooth::SmoothOptions;

use super::pose_lists;
use super::suite::{self, Suite};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::plot::{self, Bar};
use crate::printer::Printer;
use crate::{input, output, robot, viewing};

/// Smooth motions through pose lists: motion time compared with exact stop, planning time,
/// certificate
///
/// Without a robot the controlled point moves freely. With one, each list is placed with its middle
/// at the flange's home position, and planned by the planner that runs programs. The planning time
/// is the shortest of three, so that stalls of the machine do not count.
#[derive(Args, Debug)]
pub(crate) struct Motion {
    /// JSON file with cases: P positions in mm, Q unit quaternions w,x,y,z or null, tol in mm,
    /// V, A, J limits of the tool in mm/s, mm/s2, mm/s3; the first pose is the start. Motion times
    /// to hold against may stand in reference_s, in s by the name of the case
    #[arg(value_name = "FILE.json")]
    file: PathBuf,
    /// Plan for this robot: shipped, or a folder with robot.urdf and robot.toml
    #[arg(short, long, value_name = "R")]
    robot: Option<String>,
    /// Draw motion times beside exact stop as SVG
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Show the lists and their motions in the browser until Ctrl-C: prints the address of a page
    #[arg(long)]
    view: bool,
}

#[derive(Serialize)]
struct MotionReport {
    schema: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    robot: Option<String>,
    cases: Vec<Case>,
}

#[derive(Serialize)]
struct Case {
    name: String,
    poses: usize,
    motion_s: Option<f64>,
    exact_stop_s: Option<f64>,
    /// Motion time of the file's `reference_s`, and the motion over it.
    #[serde(skip_serializing_if = "Option::is_none")]
    reference_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference_ratio: Option<f64>,
    planning_s: f64,
    first_motion_s: f64,
    deviation_ratio: f64,
    corridor_ratio: f64,
    velocity_ratio: f64,
    acceleration_ratio: f64,
    jerk_ratio: f64,
    certified: bool,
    fallbacks: usize,
    reason: Option<String>,
}

impl Motion {
    /// Measures every case and prints them; the exit code says whether all could be planned.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let suite = self.read()?;
        let robot = self.robot.as_deref().map(robot::load).transpose()?;
        let mut cases = Vec::with_capacity(suite.cases.0.len());
        for (name, case) in &suite.cases.0 {
            let row = measure(case, robot.as_ref())?;
            cases.push(named(name, row, suite.reference_s.get(name).copied()));
        }
        let report = MotionReport {
            schema: 1,
            robot: robot.as_ref().map(|robot| robot.name.clone()),
            cases,
        };
        if self.json {
            output::json(&report)?;
        } else {
            table(&report)?;
        }
        if let Some(path) = &self.plot {
            let picture = plot::bars(&self.file.display().to_string(), &bars(&report));
            fs::write(path, picture)
                .with_context(|| format!("cannot write {}", path.display()))
                .map_err(|cause| Failure::new(Exit::Unreadable, cause))?;
        }
        if self.view {
            let source = pose_lists::source(&suite, robot.as_ref())?;
            viewing::serve(printer, (source, None), None, || false)?;
        }
        let sound = report.cases.iter().all(|case| case.certified);
        Ok(if sound { Exit::Done } else { Exit::Refused })
    }

    fn read(&self) -> Result<Suite, Failure> {
        let unreadable = |cause: anyhow::Error| Failure::new(Exit::Unreadable, cause);
        let context = || format!("cannot read {}", self.file.display());
        let text = input::text(&self.file)?;
        serde_json::from_str(&text)
            .with_context(context)
            .map_err(unreadable)
    }
}

/// How often a case is planned; the result is the same each time.
const PASSES: usize = 3;

/// Plans and measures one case; an error of the case becomes its reason.
fn measure(case: &serde_json::Value, robot: Option<&Robot>) -> Result<Measure, Failure> {
    let trial = match suite::trial(case) {
        Ok(trial) => trial,
        Err(reason) => return Ok(Measure::unplanned(0, reason)),
    };
    let once = || match robot {
        None => {
            let options = SmoothOptions::new(trial.tolerance, trial.limits);
            Ok(smooth::measure(&trial.poses, &options))
        }
        Some(robot) => trial
            .measure(robot)
            .map_err(|error| Failure::new(Exit::Unreadable, error)),
    };
    let mut best = once()?;
    for _ in 1..PASSES {
        let row = once()?;
        if row.planning < best.planning {
            best = row;
        }
    }
    Ok(best)
}

fn named(name: &str, row: Measure, reference: Option<f64>) -> Case {
    let over = row
        .motion
        .zip(reference)
        .map(|(motion, reference)| motion / reference);
    Case {
        reference_s: reference,
        reference_ratio: over,
        name: name.to_owned(),
        poses: row.poses,
        motion_s: row.motion,
        exact_stop_s: row.exact_stop,
        planning_s: row.planning,
        first_motion_s: row.first,
        deviation_ratio: row.deviation_ratio,
        corridor_ratio: row.corridor_ratio,
        velocity_ratio: row.velocity_ratio,
        acceleration_ratio: row.acceleration_ratio,
        jerk_ratio: row.jerk_ratio,
        certified: row.certified,
        fallbacks: row.fallbacks,
        reason: row.reason,
    }
}

fn table(report: &MotionReport) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let width = report.cases.iter().map(|case| case.name.chars().count());
    let width = width.max().unwrap_or(0).max(4);
    writeln!(
        out,
        "{:width$} {:>6} {:>9} {:>9} {:>6} {:>9} {:>6} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8}  certified",
        "case",
        "poses",
        "motion s",
        "stop s",
        "ratio",
        "ref. s",
        "ratio",
        "plan ms",
        "deviation",
        "corridor",
        "velocity",
        "accel.",
        "jerk"
    )?;
    for case in &report.cases {
        let (Some(motion), Some(stop)) = (case.motion_s, case.exact_stop_s.or(case.motion_s))
        else {
            let reason = case.reason.as_deref().unwrap_or("no reason");
            writeln!(
                out,
                "{:width$} {:6} no motion: {reason}",
                case.name, case.poses
            )?;
            continue;
        };
        let certified = match (case.certified, case.fallbacks) {
            (true, 0) => "yes".to_owned(),
            (true, count) => format!("yes, {count} fallbacks"),
            (false, _) => "NO".to_owned(),
        };
        writeln!(
            out,
            "{:width$} {:6} {motion:9.4} {stop:9.4} {:6.3} {:>9} {:>6} {:9.2} {:9.4} {:8.4} {:8.4} {:8.4} {:8.4}  {certified}",
            case.name,
            case.poses,
            motion / stop,
            or_dash(case.reference_s, 4),
            or_dash(case.reference_ratio, 3),
            case.planning_s * 1e3,
            case.deviation_ratio,
            case.corridor_ratio,
            case.velocity_ratio,
            case.acceleration_ratio,
            case.jerk_ratio,
        )?;
    }
    Ok(())
}

/// A number with so many decimals, or a dash.
fn or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

fn bars(report: &MotionReport) -> Vec<Bar> {
    let bar = |case: &Case| Bar {
        name: case.name.clone(),
        value: case.motion_s,
        reference: case.exact_stop_s,
    };
    report.cases.iter().map(bar).collect()
}
