//! Planned programs as arrays.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use planner::dry_run::{self, FailurePolicy, PlanOptions, plan_program};
use pyo3::prelude::*;

use crate::arrays::{Numbers, rows, seven};
use crate::error::{Field, Raise, argument};
use crate::program::{Given, json};
use crate::robot::Robot;
use crate::wait;

/// A planned program.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Plan(dry_run::Plan);

/// Times, commands, joints with three derivatives, poses.
type Samples<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
    Vec<Bound<'py, PyArray2<f64>>>,
    Bound<'py, PyArray2<f64>>,
);

#[pymethods]
impl Plan {
    /// How long the program takes, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration_s
    }

    /// Commands with certificates, and refusals, as JSON.
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        wait::short(py, "a report", || json(&self.0))
    }

    /// States every `period` s: t (n,), command (n,), q, dq, ddq, dddq (n, dof), pose (n, 7).
    fn samples<'py>(&self, py: Python<'py>, period: f64) -> PyResult<Samples<'py>> {
        if !(period > 0.0 && period.is_finite()) {
            return Err(argument(format!(
                "period: expected a positive number of s, got {period}"
            )));
        }
        if self.0.duration_s / period > 1e8 {
            return Err(argument(format!(
                "period: {period} s makes more than 1e8 samples of {} s",
                self.0.duration_s
            )));
        }
        let (mut t, mut command, mut pose) = (Vec::new(), Vec::new(), Vec::new());
        let mut orders: [Vec<f64>; 4] = Default::default();
        let mut last = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        wait::short(py, "sampling", || {
            for sample in self.0.samples(period) {
                t.push(sample.t_s);
                command.push(sample.command as i64);
                for (list, values) in
                    orders
                        .iter_mut()
                        .zip([&sample.q, &sample.dq, &sample.ddq, &sample.dddq])
                {
                    list.extend_from_slice(values);
                }
                let mut row = seven(&sample.workstation_from_tool);
                // The sign of a quaternion stays, as in the files of `canter plan --samples`.
                let along: f64 = (3..7).map(|k| row[k] * last[k]).sum();
                if along < 0.0 {
                    (3..7).for_each(|k| row[k] = -row[k]);
                }
                pose.extend(row);
                last = row;
            }
        })?;
        let count = t.len();
        let orders = orders
            .into_iter()
            .map(|list| list.into_pyarray(py).reshape([count, self.0.dof]))
            .collect::<PyResult<Vec<_>>>()?;
        Ok((
            t.into_pyarray(py),
            command.into_pyarray(py),
            orders,
            pose.into_pyarray(py).reshape([count, 7])?,
        ))
    }
}

/// The time of a clock that never jumps (s).
fn seconds() -> f64 {
    scheduling::now_ns() as f64 * 1e-9
}

/// How a program is planned.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Choices<'py> {
    /// Servo rate, Hz.
    rate: f64,
    /// Joints at the start (dof,); the robot's home position unless given.
    start: Option<Numbers<'py>>,
    /// Whether planning goes on after a command that is refused.
    skip: bool,
}

impl Choices<'_> {
    fn options(&self, given: &Given, dof: usize) -> PyResult<PlanOptions> {
        if !(1.0..=100_000.0).contains(&self.rate) {
            return Err(argument(format!(
                "rate: expected 1 to 100000 Hz, got {}",
                self.rate
            )));
        }
        let start = self.start.as_ref().map(|start| rows(start, "start", dof));
        let start = start.transpose()?.map(|(start, _)| start.to_vec());
        if let Some(bad) = start.iter().flatten().find(|q| !q.is_finite()) {
            return Err(argument(format!(
                "start: expected finite numbers, got {bad}"
            )));
        }
        Ok(PlanOptions {
            rate_hz: self.rate,
            default_length: given.length()?,
            on_refusal: if self.skip {
                FailurePolicy::Skip
            } else {
                FailurePolicy::Abort
            },
            start,
            clock: seconds,
        })
    }
}

/// Plans a program. A command that is refused is a `PlanError`, unless `skip`.
#[pyfunction]
pub(crate) fn plan(
    py: Python<'_>,
    robot: &Robot,
    program: (String, String, String),
    choices: Choices<'_>,
) -> PyResult<Plan> {
    let (name, text, length) = program;
    let given = Given { name, text, length };
    let (options, skip) = (choices.options(&given, robot.robot.dof())?, choices.skip);
    let commands = given.program(py)?;
    let arm = robot.robot.clone();
    let planned = wait::long(py, "planning", move || {
        plan_program(&arm, &commands, &options)
    })?;
    let planned = planned.map_err(Raise::from)?;
    match planned.refusals.first() {
        Some(refusal) if !skip => {
            let text = format!(
                "{}:{}:{}: {} refused: {}",
                given.name, refusal.line, refusal.column, refusal.name, refusal.error
            );
            let help = refusal.error.help.clone().unwrap_or_default();
            Err(Raise::new("PlanError", text)
                .with("line", Field::Count(refusal.line))
                .with("column", Field::Count(refusal.column))
                .with("command", Field::Text(refusal.name.to_owned()))
                .with("index", Field::Count(refusal.index))
                .with("reason", Field::Text(refusal.error.class.to_string()))
                .with("help", Field::Text(help))
                .into())
        }
        _ => Ok(Plan(planned)),
    }
}
