//! The fastest time law along a path through waypoints.

use nalgebra::SVector;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use planner::kernels::Kernels;
use planner::with_dof;
use pyo3::prelude::*;
use serde_json::json;
use trajectory::{
    Boundary, JointLimits, Path, SplinePath, TimeCertificate, TimingError, TimingOptions,
    ToolLimits,
};

use crate::arrays::{Numbers, joints, put, rows};
use crate::error::{Raise, argument};
use crate::wait;

/// A path with its time law.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Timed(Box<dyn Law>);

/// A timed path with a joint count that is known at run time only.
trait Law: Send + Sync {
    fn dof(&self) -> usize;
    fn certificate(&self) -> &TimeCertificate;
    /// Position, velocity, acceleration and jerk at each time, all positions first.
    fn sample(&self, times: &[f64]) -> Vec<f64>;
    /// The path parameter and its rate at each time.
    fn parameter(&self, times: &[f64]) -> Vec<f64>;
    /// Joints of the path at each parameter.
    fn path(&self, parameters: &[f64]) -> Vec<f64>;
}

struct TimedPath<const N: usize> {
    path: SplinePath<N>,
    timed: trajectory::Timed<N>,
}

impl<const N: usize> Law for TimedPath<N> {
    fn dof(&self) -> usize {
        N
    }

    fn certificate(&self) -> &TimeCertificate {
        &self.timed.certificate
    }

    fn sample(&self, times: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; 4 * times.len() * N];
        for (k, time) in times.iter().enumerate() {
            put(
                &self.timed.trajectory.sample(*time),
                k,
                times.len(),
                &mut out,
            );
        }
        out
    }

    fn parameter(&self, times: &[f64]) -> Vec<f64> {
        let at = |time: &f64| {
            let law = self.timed.law.sample(*time);
            [law.position[0], law.velocity[0]]
        };
        times.iter().flat_map(at).collect()
    }

    fn path(&self, parameters: &[f64]) -> Vec<f64> {
        let at = |u: &f64| self.path.joint_at(*u).q[0];
        let points = parameters.iter().map(at);
        points.flat_map(|point| point.as_slice().to_vec()).collect()
    }
}

#[pymethods]
impl Timed {
    /// Number of joints.
    #[getter]
    fn dof(&self) -> usize {
        self.0.dof()
    }

    /// How long it lasts, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.certificate().duration
    }

    /// What is known for certain, as JSON.
    fn certificate(&self) -> String {
        let found = self.0.certificate();
        let peaks = found.peaks.iter().map(|peak| {
            json!({"limit": peak.limit.to_string(), "ratio": peak.ratio, "time_s": peak.time})
        });
        json!({
            "duration_s": found.duration,
            "lower_bound_s": found.lower_bound,
            "holds": found.holds(),
            "fit_error_rad": found.fit_error,
            "peaks": peaks.collect::<Vec<_>>(),
        })
        .to_string()
    }

    /// Position, velocity, acceleration, jerk at times (k,): (4, k, dof).
    fn sample<'py>(
        &self,
        py: Python<'py>,
        times: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (times, count) = rows(&times, "times", 1)?;
        let samples = wait::short(py, "sampling", || self.0.sample(times))?;
        samples.into_pyarray(py).reshape([4, count, self.0.dof()])
    }

    /// Path parameter and its rate at times (k,): (k, 2).
    fn parameter<'py>(
        &self,
        py: Python<'py>,
        times: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (times, count) = rows(&times, "times", 1)?;
        let numbers = wait::short(py, "sampling", || self.0.parameter(times))?;
        numbers.into_pyarray(py).reshape([count, 2])
    }

    /// Joints of the path at parameters (k,): (k, dof).
    fn path<'py>(
        &self,
        py: Python<'py>,
        parameters: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (parameters, count) = rows(&parameters, "parameters", 1)?;
        let numbers = wait::short(py, "sampling", || self.0.path(parameters))?;
        numbers.into_pyarray(py).reshape([count, self.0.dof()])
    }
}

/// How a path is timed.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Choices {
    start_rate: f64,
    start_acceleration: f64,
    rate_cap: Option<f64>,
    fit: f64,
    gap: f64,
}

impl Choices {
    fn options(&self) -> TimingOptions {
        let start = if self.start_rate == 0.0 {
            Boundary::Rest
        } else {
            Boundary::Moving {
                rate: self.start_rate,
                acceleration: self.start_acceleration,
            }
        };
        TimingOptions {
            start,
            rate_cap: self.rate_cap,
            fit: self.fit,
            gap: self.gap,
            ..TimingOptions::default()
        }
    }
}

/// The fastest motion along the natural cubic spline through waypoints (n, dof) at knots (n,) within
/// limits (3, dof) of velocity, acceleration and jerk.
#[pyfunction]
#[pyo3(name = "time_path")]
pub(crate) fn time_path(
    py: Python<'_>,
    waypoints: Numbers<'_>,
    knots: Numbers<'_>,
    limits: Numbers<'_>,
    choices: Choices,
) -> PyResult<Timed> {
    let (bounds, dof) = rows(&limits, "limits", 3)?;
    let (points, count) = rows(&waypoints, "waypoints", joints(dof)?)?;
    let (knots, also) = rows(&knots, "knots", 1)?;
    if count != also || count < 2 {
        return Err(argument(format!(
            "expected two or more waypoints and a knot for each, got {count} and {also}"
        )));
    }
    let (points, knots, bounds) = (points.to_vec(), knots.to_vec(), bounds.to_vec());
    let law = wait::long(
        py,
        "timing a path",
        move || with_dof!(dof, N => law::<N>(&points, knots, &bounds, &choices.options())),
    )?;
    match law {
        Ok(Some(law)) => Ok(Timed(law)),
        Ok(None) => Err(argument("knots: expected numbers that begin at 0 and grow")),
        Err(error) => Err(Raise::from(error).into()),
    }
}

/// `None` where the knots cannot be used.
fn law<const N: usize>(
    points: &[f64],
    knots: Vec<f64>,
    bounds: &[f64],
    options: &TimingOptions,
) -> Result<Option<Box<dyn Law>>, TimingError> {
    let row = |row: usize| SVector::from_column_slice(&bounds[N * row..N * (row + 1)]);
    let limits = JointLimits::<N> {
        velocity: row(0),
        acceleration: row(1),
        jerk: row(2),
        ..JointLimits::uniform(1.0, 1.0, 1.0)
    };
    let points: Vec<SVector<f64, N>> = points
        .chunks_exact(N)
        .map(SVector::from_column_slice)
        .collect();
    if let Some(bad) = points
        .iter()
        .position(|point| point.iter().any(|q| !q.is_finite()))
    {
        return Err(TimingError::NotFinite { u: knots[bad] });
    }
    let Some(path) = SplinePath::through(knots, &points) else {
        return Ok(None);
    };
    let time = Kernels::<N>::get().time_path;
    let timed = time(&path, &limits, &ToolLimits::UNLIMITED, options)?;
    Ok(Some(Box::new(TimedPath { path, timed })))
}
