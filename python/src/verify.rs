//! Recorded motions, checked against their programs.

use nalgebra::Vector3;
use planner::recorded::{RecordedSample, RunColumns, verify_program};
use pyo3::prelude::*;

use crate::arrays::{Numbers, pose_of_seven, rows};
use crate::error::argument;
use crate::program::{Given, json};
use crate::robot::Robot;
use crate::wait;

/// The columns of a recorded motion, `n` rows.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Columns<'py> {
    t: Numbers<'py>,
    command: Vec<usize>,
    q: Numbers<'py>,
    dq: Numbers<'py>,
    ddq: Numbers<'py>,
    pose: Numbers<'py>,
    run: Option<(Numbers<'py>, Numbers<'py>, Numbers<'py>)>,
}

impl Columns<'_> {
    /// The rows, each with every column.
    fn rows(&self, dof: usize) -> PyResult<Vec<RecordedSample>> {
        let count = self.command.len();
        let column = |array: &Numbers<'_>, name: &str, width: usize| {
            let (numbers, found) = rows(array, name, width)?;
            if found == count {
                Ok(numbers.to_vec())
            } else {
                Err(argument(format!(
                    "{name}: expected {count} rows, one for each command, got {found}"
                )))
            }
        };
        let t = column(&self.t, "t", 1)?;
        let (q, dq) = (column(&self.q, "q", dof)?, column(&self.dq, "dq", dof)?);
        let ddq = column(&self.ddq, "ddq", dof)?;
        let pose = column(&self.pose, "pose", 7)?;
        let run = match &self.run {
            Some((path, joints, point)) => Some((
                column(path, "path_time", 1)?,
                column(joints, "measured_q", dof)?,
                column(point, "measured_point", 3)?,
            )),
            None => None,
        };
        let part = |numbers: &[f64], k: usize, width: usize| numbers[width * k..][..width].to_vec();
        let row = |k: usize| RecordedSample {
            t_s: t[k],
            command: self.command[k],
            joints: part(&q, k, dof),
            rates: part(&dq, k, dof),
            accelerations: part(&ddq, k, dof),
            pose: pose_of_seven(&pose[7 * k..7 * k + 7]),
            run: run.as_ref().map(|(path, joints, point)| RunColumns {
                path_time_s: path[k],
                measured: part(joints, k, dof),
                measured_point: Vector3::from_row_slice(&point[3 * k..3 * k + 3]),
            }),
        };
        Ok((0..count).map(row).collect())
    }
}

/// Checks a recorded motion against its program; the verdict as JSON.
#[pyfunction]
pub(crate) fn verify(
    py: Python<'_>,
    robot: &Robot,
    program: (String, String, String),
    columns: Columns<'_>,
) -> PyResult<String> {
    let (name, text, length) = program;
    let given = Given { name, text, length };
    let commands = given.program(py)?;
    let length = given.length()?;
    let samples = columns.rows(robot.robot.dof())?;
    let arm = robot.robot.clone();
    wait::long(py, "checking a motion", move || {
        json(&verify_program(&arm, &commands, length, &samples))
    })
}
