//! A robot and its kinematics.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{self, Numbers, not_a_pose, rows};
use crate::error::{Field, Raise, argument, unreached};
use crate::kinematic::{self, Kinematics, Missed, Point};
use crate::wait;

/// Poses that one thread takes at a time.
const BATCH: usize = 256;

/// A robot: its description and limits, and its kinematics.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Robot {
    pub(crate) robot: Arc<planner::robot::Robot>,
    kinematics: Box<dyn Kinematics>,
}

/// One list per kind of limit.
type JointLimits = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);

/// Joints, which rows are solved, distance and angle of those that are not.
type Solved<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray2<f64>>,
);

impl Robot {
    fn new(robot: planner::robot::Robot) -> PyResult<Self> {
        let kinematics = kinematic::of(&robot).map_err(Raise::from)?;
        Ok(Self {
            robot: Arc::new(robot),
            kinematics,
        })
    }
}

fn point(name: &str) -> PyResult<Point> {
    match name {
        "tool" => Ok(Point::Tool),
        "flange" => Ok(Point::Flange),
        other => Err(argument(format!(
            "point: expected \"tool\" or \"flange\", got {other:?}"
        ))),
    }
}

/// How many poses are solved.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct BatchChoices {
    /// Of which point of the arm the poses are: tool or flange.
    point: String,
    /// How many threads; 0 is one for each processor.
    threads: usize,
}

#[pymethods]
impl Robot {
    /// A shipped robot by its name, or one from its folder.
    #[staticmethod]
    fn load(py: Python<'_>, name_or_folder: String) -> PyResult<Self> {
        let loaded = wait::short(py, "loading a robot", || {
            planner::robot::load(&name_or_folder)
        })?;
        Self::new(loaded.map_err(Raise::from)?)
    }

    /// A robot from the texts of its files; without a robot.toml with Canter's defaults.
    #[staticmethod]
    #[pyo3(signature = (name, urdf, toml=None, tip=None))]
    fn parse(
        py: Python<'_>,
        name: String,
        urdf: String,
        toml: Option<String>,
        tip: Option<String>,
    ) -> PyResult<Self> {
        let read = wait::short(py, "reading a robot", || match &toml {
            Some(toml) => planner::robot::parse(&name, &urdf, toml),
            None => planner::robot::from_urdf(&name, &urdf, tip.as_deref()),
        })?;
        Self::new(read.map_err(Raise::from)?)
    }

    /// Makes a robot folder from a URDF file.
    #[staticmethod]
    #[pyo3(signature = (urdf_file, folder, tip=None))]
    fn import_urdf(
        py: Python<'_>,
        urdf_file: PathBuf,
        folder: PathBuf,
        tip: Option<String>,
    ) -> PyResult<Self> {
        let made = wait::short(py, "importing a robot", || {
            planner::robot::import(&urdf_file, &folder, tip.as_deref())
        })?;
        Self::new(made.map_err(Raise::from)?)
    }

    /// Names of the shipped robots.
    #[staticmethod]
    fn shipped() -> Vec<&'static str> {
        planner::robot::list()
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.name
    }

    /// One line for people.
    #[getter]
    fn description(&self) -> &str {
        &self.robot.description
    }

    /// Number of joints.
    #[getter]
    fn dof(&self) -> usize {
        self.robot.dof()
    }

    /// Text of the URDF.
    #[getter]
    fn urdf(&self) -> &str {
        &self.robot.urdf
    }

    /// Text of robot.toml.
    #[getter]
    fn toml(&self) -> &str {
        &self.robot.toml
    }

    /// Names of the joints, root first.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.robot.joint_names()
    }

    /// Whether each joint slides.
    #[getter]
    fn sliding(&self) -> Vec<bool> {
        self.robot.sliding()
    }

    /// Closed form of the inverse kinematics, or `numeric`.
    #[getter]
    fn family(&self) -> &'static str {
        self.kinematics.family()
    }

    /// A ready position (dof,).
    #[getter]
    fn home<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.robot.home.clone().into_pyarray(py)
    }

    /// Lower, upper, velocity, acceleration, jerk of the joints.
    fn joint_limits(&self) -> JointLimits {
        let joints = &self.robot.joints;
        (
            joints.lower.clone(),
            joints.upper.clone(),
            joints.velocity.clone(),
            joints.acceleration.clone(),
            joints.jerk.clone(),
        )
    }

    /// Speed, acceleration, jerk, and the angular ones, of the controlled point.
    fn tool_limits(&self) -> [f64; 6] {
        let tool = self.robot.motion_limits();
        [
            tool.speed,
            tool.acceleration,
            tool.jerk,
            tool.angular_speed,
            tool.angular_acceleration,
            tool.angular_jerk,
        ]
    }

    /// Values of the free parameter of an arm with seven joints.
    fn parameters<'py>(&self, py: Python<'py>, count: usize) -> Bound<'py, PyArray1<f64>> {
        self.kinematics.parameters(count).into_pyarray(py)
    }

    /// Forward kinematics: (n, dof) to (n, 4, 4).
    fn fk<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'_>,
        of: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let of = point(of)?;
        let (q, count) = rows(&q, "q", self.robot.dof())?;
        let poses = wait::short(py, "forward kinematics", || {
            let mut poses = vec![0.0; 16 * count];
            self.kinematics.forward(of, q, &mut poses);
            poses
        })?;
        poses.into_pyarray(py).reshape([count, 4, 4])
    }

    /// Jacobians: (n, dof) to (n, 6, dof).
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'_>,
        of: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let of = point(of)?;
        let dof = self.robot.dof();
        let (q, count) = rows(&q, "q", dof)?;
        let jacobians = wait::short(py, "the Jacobian", || {
            let mut jacobians = vec![0.0; 6 * dof * count];
            self.kinematics.jacobian(of, q, &mut jacobians);
            jacobians
        })?;
        jacobians.into_pyarray(py).reshape([count, 6, dof])
    }

    /// One solution of one pose.
    #[pyo3(signature = (pose, near, of))]
    fn ik<'py>(
        &self,
        py: Python<'py>,
        pose: Numbers<'_>,
        near: Option<Numbers<'_>>,
        of: &str,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let of = point(of)?;
        let (numbers, count) = rows(&pose, "pose", 16)?;
        let near = near.as_ref();
        let near = near.map(|near| rows(near, "near", self.robot.dof()));
        let near = near.transpose()?.map(|(near, _)| near);
        if count != 1 {
            return Err(argument(format!("expected one pose, got {count}")));
        }
        let target = arrays::pose(numbers).ok_or_else(|| not_a_pose(0))?;
        let mut q = vec![0.0; self.robot.dof()];
        let solved = wait::short(py, "inverse kinematics", || {
            self.kinematics.nearest(of, &target, near, &mut q)
        })?;
        solved.map_err(|missed| refusal(&missed))?;
        Ok(q.into_pyarray(py))
    }

    /// One solution of each of many poses; rows without one are NaN.
    #[pyo3(signature = (poses, near, choices))]
    fn ik_batch<'py>(
        &self,
        py: Python<'py>,
        poses: Numbers<'_>,
        near: Option<Numbers<'_>>,
        choices: BatchChoices,
    ) -> PyResult<Solved<'py>> {
        let (of, threads) = (point(&choices.point)?, choices.threads);
        let dof = self.robot.dof();
        let (poses, count) = rows(&poses, "poses", 16)?;
        let near = near.as_ref();
        let near = near.map(|near| rows(near, "near", dof)).transpose()?;
        if let Some((_, seeds)) = near
            && seeds != 1
            && seeds != count
        {
            return Err(argument(format!(
                "near: expected 1 or {count} rows, got {seeds}"
            )));
        }
        let mut q = vec![f64::NAN; dof * count];
        let mut solved = vec![false; count];
        let mut off = vec![0.0; 2 * count];
        let bad = Mutex::new(None);
        let jobs = q.chunks_mut(BATCH * dof).zip(solved.chunks_mut(BATCH));
        let jobs = jobs.zip(off.chunks_mut(BATCH * 2)).enumerate();
        wait::parallel(py, "inverse kinematics", jobs, threads, |(block, job)| {
            let ((q, solved), off) = job;
            let first = block * BATCH;
            for (k, solved) in solved.iter_mut().enumerate() {
                let row = first + k;
                let Some(pose) = arrays::pose(&poses[16 * row..16 * row + 16]) else {
                    if let Ok(mut bad) = bad.lock() {
                        *bad = Some(bad.map_or(row, |other: usize| other.min(row)));
                    }
                    continue;
                };
                let seed = near.map(|(seeds, count)| {
                    let at = if count == 1 { 0 } else { row };
                    &seeds[dof * at..dof * (at + 1)]
                });
                let out = &mut q[dof * k..dof * (k + 1)];
                match self.kinematics.nearest(of, &pose, seed, out) {
                    Ok(()) => *solved = true,
                    Err(missed) => off[2 * k..2 * k + 2].copy_from_slice(&missed.off),
                }
            }
        })?;
        if let Ok(Some(row)) = bad.into_inner() {
            return Err(not_a_pose(row));
        }
        Ok((
            q.into_pyarray(py).reshape([count, dof])?,
            solved.into_pyarray(py),
            off.into_pyarray(py).reshape([count, 2])?,
        ))
    }

    /// All branches of one pose: (k, dof).
    #[pyo3(signature = (pose, parameter, of))]
    fn ik_all<'py>(
        &self,
        py: Python<'py>,
        pose: Numbers<'_>,
        parameter: Option<f64>,
        of: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let of = point(of)?;
        let dof = self.robot.dof();
        let (numbers, count) = rows(&pose, "pose", 16)?;
        if count != 1 {
            return Err(argument(format!("expected one pose, got {count}")));
        }
        let target = arrays::pose(numbers).ok_or_else(|| not_a_pose(0))?;
        let found = wait::short(py, "inverse kinematics", || {
            self.kinematics.branches(of, &target, parameter)
        })?;
        let count = found.len() / dof;
        found.into_pyarray(py).reshape([count, dof])
    }
}

/// A pose that is not reached as an exception.
fn refusal(missed: &Missed) -> PyErr {
    let text = format!(
        "{}; the nearest pose found is off by {:.6} m and {:.6} rad",
        missed.failure, missed.off[0], missed.off[1]
    );
    let nearest = serde_json::Value::from(missed.nearest.clone()).to_string();
    let raise = Raise::new("IkError", text)
        .with("position_error", Field::Number(missed.off[0]))
        .with("rotation_error", Field::Number(missed.off[1]))
        .with("nearest", Field::Json(nearest));
    unreached(raise, &missed.failure).into()
}
