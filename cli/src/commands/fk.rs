use std::io::{self, BufWriter, Write};

use clap::Args;
use nalgebra::SVector;
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::{RobotOption, with_joints};
use crate::table::{self, CsvRow};

/// Forward kinematics: joint positions to poses of the flange in the robot's base
///
/// Prints CSV, x_m,y_m,z_m,qw,qx,qy,qz, one row for each row of joint positions.
#[derive(Args, Debug)]
pub(crate) struct Fk {
    #[command(flatten)]
    robot: RobotOption,
    /// CSV file with rows q1..qN in rad (m for sliding joints); `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    joints: String,
}

impl Fk {
    /// Reads rows, prints poses.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let names: Vec<_> = (1..=robot.dof()).map(|joint| format!("q{joint}")).collect();
        let names: Vec<_> = names.iter().map(String::as_str).collect();
        let rows = table::read(&self.joints, &names)?;
        with_joints!(robot.dof(), poses(&robot, &rows))
    }
}

fn poses<const N: usize>(robot: &Robot, rows: &[CsvRow]) -> Result<Exit, Failure> {
    let chain = robot
        .model
        .chain::<N>()
        .map_err(|error| Failure::new(Exit::Unreadable, error))?;
    let mut out = BufWriter::new(io::stdout().lock());
    writeln!(out, "x_m,y_m,z_m,qw,qx,qy,qz")?;
    for row in rows {
        let pose = chain.forward(&SVector::from_column_slice(&row.numbers));
        let (p, r) = (pose.translation, pose.rotation);
        writeln!(
            out,
            "{},{},{},{},{},{},{}",
            p.x, p.y, p.z, r.w, r.i, r.j, r.k
        )?;
    }
    out.flush()?;
    Ok(Exit::Done)
}
