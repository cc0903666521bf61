//! Smooth motions through poses.

use nalgebra::Isometry3;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use serde_json::json;
use trajectory::smooth::{self as planned, Method, Peak, SmoothOptions, SmoothPlan};
use trajectory::{ToolCurve, ToolLimits};

use crate::arrays::{self, Numbers, matrix, not_a_pose, rows};
use crate::error::{Raise, argument};
use crate::wait;

/// A certified smooth motion of a tool.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Smooth(SmoothPlan);

/// Poses, and linear and angular derivatives.
type Samples<'py> = (
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
);

#[pymethods]
impl Smooth {
    /// How long it lasts, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    /// How long it would last with a stop at each pose, s.
    #[getter]
    fn exact_stop(&self) -> f64 {
        self.0.exact_stop()
    }

    /// How it was planned: still, exact-stop, spline or fit.
    #[getter]
    fn method(&self) -> &'static str {
        match self.0.method() {
            Method::Still => "still",
            Method::ExactStop => "exact-stop",
            Method::Spline => "spline",
            Method::Fit => "fit",
            _ => "other",
        }
    }

    /// What holds for all times, as JSON.
    fn certificate(&self) -> String {
        let found = self.0.certificate();
        let peak = |peak: &Peak| json!({"ratio": peak.ratio, "time_s": peak.time});
        let active = found.active.iter().map(|span| {
            json!({"limit": span.limit.to_string(), "start_s": span.start, "end_s": span.end})
        });
        json!({
            "holds": found.holds(),
            "in_order": found.in_order,
            "duration_s": found.duration,
            "lower_bound_s": found.lower_bound,
            "corridor": peak(&found.corridor),
            "jump": peak(&found.jump),
            "speed": peak(&found.speed),
            "acceleration": peak(&found.acceleration),
            "jerk": peak(&found.jerk),
            "angular_speed": peak(&found.angular_speed),
            "angular_acceleration": peak(&found.angular_acceleration),
            "angular_jerk": peak(&found.angular_jerk),
            "active": active.collect::<Vec<_>>(),
        })
        .to_string()
    }

    /// Each intermediate pose (m, 5): deviation, tolerance (m), angle, its tolerance (rad), time (s).
    fn crossings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let crossings = self.0.crossings();
        let numbers: Vec<f64> = crossings
            .iter()
            .flat_map(|crossing| {
                [
                    crossing.deviation,
                    crossing.tolerance,
                    crossing.angle,
                    crossing.angular_tolerance,
                    crossing.time,
                ]
            })
            .collect();
        numbers.into_pyarray(py).reshape([crossings.len(), 5])
    }

    /// At times (k,): poses (k, 4, 4), linear and angular velocity, acceleration, jerk (k, 3, 3).
    fn sample<'py>(&self, py: Python<'py>, times: Numbers<'_>) -> PyResult<Samples<'py>> {
        let (times, count) = rows(&times, "times", 1)?;
        let (poses, linear, angular) = wait::short(py, "sampling", || {
            let mut poses = vec![0.0; 16 * count];
            let (mut linear, mut angular) = (Vec::new(), Vec::new());
            for (time, out) in times.iter().zip(poses.chunks_exact_mut(16)) {
                let point = self.0.at(time.max(0.0));
                matrix(&point.pose, out);
                point.linear.iter().for_each(|v| linear.extend(v.iter()));
                point.angular.iter().for_each(|v| angular.extend(v.iter()));
            }
            (poses, linear, angular)
        })?;
        Ok((
            poses.into_pyarray(py).reshape([count, 4, 4])?,
            linear.into_pyarray(py).reshape([count, 3, 3])?,
            angular.into_pyarray(py).reshape([count, 3, 3])?,
        ))
    }
}

/// How a motion is planned.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Choices {
    tolerance: f64,
    /// Speed, acceleration, jerk and the angular ones.
    limits: [f64; 6],
    corridor: Option<f64>,
    angular_tolerance: Option<f64>,
}

impl Choices {
    fn options(&self) -> SmoothOptions {
        let limits = self.limits;
        let mut options = SmoothOptions::new(
            self.tolerance,
            ToolLimits {
                speed: limits[0],
                acceleration: limits[1],
                jerk: limits[2],
                angular_speed: limits[3],
                angular_acceleration: limits[4],
                angular_jerk: limits[5],
            },
        );
        options.corridor = self.corridor;
        options.angular_tolerance = self.angular_tolerance;
        options
    }
}

/// Plans a smooth motion through poses (n, 4, 4).
#[pyfunction]
#[pyo3(name = "smooth")]
pub(crate) fn smooth(py: Python<'_>, poses: Numbers<'_>, choices: Choices) -> PyResult<Smooth> {
    let (numbers, count) = rows(&poses, "poses", 16)?;
    if count == 0 {
        return Err(argument("expected the start pose at least, got no pose"));
    }
    let read = numbers.chunks_exact(16).enumerate();
    let poses = read
        .map(|(row, numbers)| arrays::pose(numbers).ok_or_else(|| not_a_pose(row)))
        .collect::<PyResult<Vec<Isometry3<f64>>>>()?;
    let options = choices.options();
    let plan = wait::long(py, "a smooth motion", move || {
        planned::plan(&poses, &options)
    })?;
    Ok(Smooth(plan.map_err(Raise::from)?))
}
