use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};
use std::time::Instant;

use anyhow::{Context, anyhow};
use clap::Args;
use kinematics::{IkFailure, IkReport, Solution, Solver};
use measure::Random;
use nalgebra::{Isometry3, Quaternion, SVector, Translation3, UnitQuaternion};
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::robot::{RobotOption, with_joints};
use crate::table::{self, CsvRow};

/// Inverse kinematics: poses of the flange in the robot's base to joint positions
///
/// Prints CSV, row,status,branch,q1..qN,position_error_m,rotation_error_rad,time_ns. Where a pose
/// cannot be reached, the status says why and the joints are those of the nearest pose.
#[derive(Args, Debug)]
pub(crate) struct Ik {
    #[command(flatten)]
    robot: RobotOption,
    /// CSV file with rows x,y,z,qw,qx,qy,qz in m; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    poses: String,
    /// Start each search at a random joint position made from this number
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Print all solutions of each pose
    #[arg(long, conflicts_with = "seed")]
    all: bool,
}

impl Ik {
    /// Reads poses, prints solutions, sums up on standard error.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let rows = table::read(&self.poses, &["x", "y", "z", "qw", "qx", "qy", "qz"])?;
        let poses = rows
            .iter()
            .map(|row| pose(row).with_context(|| format!("cannot read {}", self.poses)))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|cause| Failure::new(Exit::Unreadable, cause))?;
        with_joints!(robot.dof(), solve(self, &robot, &poses))
    }
}

/// A row as a pose; the length of the quaternion may differ from one by rounding of printed
/// numbers.
fn pose(row: &CsvRow) -> anyhow::Result<Isometry3<f64>> {
    let line = row.line;
    let [x, y, z, w, i, j, k] = row.numbers.as_slice() else {
        return Err(anyhow!("line {line}: expected 7 numbers"));
    };
    let turn = Quaternion::new(*w, *i, *j, *k);
    if (turn.norm() - 1.0).abs() > 1e-3 {
        return Err(anyhow!(
            "line {line}, columns 4 to 7: expected a quaternion qw,qx,qy,qz of length 1, got \
             length {}",
            turn.norm()
        ));
    }
    Ok(Isometry3::from_parts(
        Translation3::new(*x, *y, *z),
        UnitQuaternion::new_normalize(turn),
    ))
}

fn solve<const N: usize>(
    options: &Ik,
    robot: &Robot,
    poses: &[Isometry3<f64>],
) -> Result<Exit, Failure> {
    let chain = robot
        .model
        .chain::<N>()
        .map_err(|error| Failure::new(Exit::Unreadable, error))?;
    let solver = Solver::new(chain);
    let mut random = Random::new(options.seed.unwrap_or(0));
    let mut sheet = Sheet::new(N)?;
    for (row, pose) in poses.iter().enumerate() {
        let start = options.seed.map(|_| joints(&mut random, solver.chain()));
        let begin = Instant::now();
        if options.all {
            let found = solver.solve_all(pose);
            let time = begin.elapsed().as_nanos();
            if !found.is_empty() {
                sheet.total_ns += time;
                found.iter().try_for_each(|solution| {
                    sheet.solution(row, solution, errors(&solver, pose, solution), time)
                })?;
                sheet.count("reached");
                continue;
            }
        }
        let found = match &start {
            Some(seed) => solver.nearest(pose, seed),
            None => solver.solve(pose),
        };
        let time = begin.elapsed().as_nanos();
        sheet.total_ns += time;
        match found {
            Ok(solution) => {
                sheet.solution(row, &solution, errors(&solver, pose, &solution), time)?;
                sheet.count("reached");
            }
            Err(report) => sheet.report(row, &report, time)?,
        }
    }
    sheet.finish(poses.len())?;
    Ok(Exit::Done)
}

/// Distance (m) and angle (rad) of a solution's flange from the pose that was asked for.
fn errors<const N: usize>(
    solver: &Solver<N>,
    pose: &Isometry3<f64>,
    solution: &Solution<N>,
) -> [f64; 2] {
    let reached = solver.chain().forward(&solution.q);
    let apart = reached.translation.vector - pose.translation.vector;
    [apart.norm(), reached.rotation.angle_to(&pose.rotation)]
}

/// Writes the results to standard output.
struct Sheet {
    out: BufWriter<io::StdoutLock<'static>>,
    statuses: BTreeMap<&'static str, usize>,
    total_ns: u128,
}

impl Sheet {
    fn new(joints: usize) -> io::Result<Self> {
        let mut out = BufWriter::new(io::stdout().lock());
        write!(out, "row,status,branch,")?;
        for joint in 1..=joints {
            write!(out, "q{joint},")?;
        }
        writeln!(out, "position_error_m,rotation_error_rad,time_ns")?;
        Ok(Self {
            out,
            statuses: BTreeMap::new(),
            total_ns: 0,
        })
    }

    fn count(&mut self, status: &'static str) {
        *self.statuses.entry(status).or_default() += 1;
    }

    fn solution<const N: usize>(
        &mut self,
        row: usize,
        solution: &Solution<N>,
        errors: [f64; 2],
        time: u128,
    ) -> io::Result<()> {
        let branch = solution
            .branch
            .map_or(String::new(), |branch| branch.to_string());
        write!(self.out, "{row},reached,{branch},")?;
        self.tail(&solution.q, errors, time)
    }

    fn report<const N: usize>(
        &mut self,
        row: usize,
        report: &IkReport<N>,
        time: u128,
    ) -> io::Result<()> {
        let status = match report.failure {
            IkFailure::NotFinite => "not-finite",
            IkFailure::OutOfReach { .. } => "out-of-reach",
            IkFailure::Orientation { .. } => "orientation",
            IkFailure::AtLimit { .. } => "at-limit",
            IkFailure::Singular { .. } => "singular",
            _ => "not-reached",
        };
        self.count(status);
        write!(self.out, "{row},{status},,")?;
        self.tail(
            &report.nearest,
            [report.position_error, report.rotation_error],
            time,
        )
    }

    fn tail<const N: usize>(
        &mut self,
        q: &SVector<f64, N>,
        errors: [f64; 2],
        time: u128,
    ) -> io::Result<()> {
        for value in q.iter().chain(&errors) {
            write!(self.out, "{value},")?;
        }
        writeln!(self.out, "{time}")
    }

    fn finish(mut self, poses: usize) -> io::Result<()> {
        self.out.flush()?;
        let counts: Vec<_> = self
            .statuses
            .iter()
            .map(|(status, count)| format!("{count} {status}"))
            .collect();
        let mean_us = self.total_ns as f64 / 1e3 / poses.max(1) as f64;
        let timing = if self.total_ns > 0 {
            format!("; mean {mean_us:.2} us a pose")
        } else {
            String::new()
        };
        output::note(&format!("{poses} poses: {}{timing}", counts.join(", ")));
        Ok(())
    }
}

/// Random joint positions inside the limits, within half a turn of zero.
fn joints<const N: usize>(random: &mut Random, chain: &kinematics::Chain<N>) -> SVector<f64, N> {
    let pi = std::f64::consts::PI;
    let lower = chain.lower().map(|low| low.max(-pi));
    let upper = chain.upper().map(|high| high.min(pi));
    random.within(&lower, &upper)
}
