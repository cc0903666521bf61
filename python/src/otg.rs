//! State-to-state motions.

use nalgebra::SVector;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyArrayMethods};
use planner::kernels::Kernels;
use planner::with_dof;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trajectory::otg::{self as planned, Interface, OtgError, Synchronisation};

use crate::arrays::{Numbers, joints, put, rows};
use crate::error::{Field, Raise, argument};
use crate::problem::Problem;
use crate::wait;

/// Durations (k,) and coefficients (k, dof, 6) of pieces.
type Pieces<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray3<f64>>);

/// Motions that one thread plans at a time.
const BATCH: usize = 64;

/// Rows of a state: position, velocity, acceleration of start and target.
const STATES: usize = 6;

/// Rows of limits: positions from, to; velocities from, to; accelerations from, to; jerk.
const LIMITS: usize = 7;

/// A planned motion from state to state.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Motion(Box<dyn Planned>);

/// A motion with a joint count that is known at run time only.
trait Planned: Send + Sync {
    fn dof(&self) -> usize;
    fn duration(&self) -> f64;
    fn is_straight(&self) -> bool;
    fn arrivals(&self) -> Vec<f64>;
    /// Position, velocity, acceleration and jerk at each time, all positions first.
    fn sample(&self, times: &[f64]) -> Vec<f64>;
    /// Durations and coefficients (6 per joint, joint by joint) of the polynomial pieces.
    fn pieces(&self) -> (Vec<f64>, Vec<f64>);
}

impl<const N: usize> Planned for planned::Motion<N> {
    fn dof(&self) -> usize {
        N
    }

    fn duration(&self) -> f64 {
        planned::Motion::duration(self)
    }

    fn is_straight(&self) -> bool {
        planned::Motion::is_straight(self)
    }

    fn arrivals(&self) -> Vec<f64> {
        (0..N).filter_map(|joint| self.arrival(joint)).collect()
    }

    fn sample(&self, times: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; 4 * times.len() * N];
        for (k, time) in times.iter().enumerate() {
            put(
                &planned::Motion::sample(self, *time),
                k,
                times.len(),
                &mut out,
            );
        }
        out
    }

    fn pieces(&self) -> (Vec<f64>, Vec<f64>) {
        let pieces = planned::Motion::pieces(self);
        let durations = pieces.iter().map(|piece| piece.duration).collect();
        let mut numbers = Vec::with_capacity(6 * N * pieces.len());
        for piece in &pieces {
            for joint in 0..N {
                numbers.extend(piece.coefficients.iter().map(|power| power[joint]));
            }
        }
        (durations, numbers)
    }
}

#[pymethods]
impl Motion {
    /// Number of joints.
    #[getter]
    fn dof(&self) -> usize {
        self.0.dof()
    }

    /// How long it lasts, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    /// Whether it is a straight line in joint space.
    #[getter]
    fn is_straight(&self) -> bool {
        self.0.is_straight()
    }

    /// When each joint arrives, s: (dof,).
    #[getter]
    fn arrivals<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.arrivals().into_pyarray(py)
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

    /// Durations (k,) and coefficients (k, dof, 6) of its pieces, lowest power first.
    fn pieces<'py>(&self, py: Python<'py>) -> PyResult<Pieces<'py>> {
        let (durations, numbers) = wait::short(py, "pieces", || self.0.pieces())?;
        let count = durations.len();
        let shape = [count, self.0.dof(), 6];
        Ok((
            durations.into_pyarray(py),
            numbers.into_pyarray(py).reshape(shape)?,
        ))
    }
}

/// How a motion is planned; lists have one entry per joint.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Choices {
    synchronisation: String,
    velocity_only: Vec<bool>,
    enabled: Vec<bool>,
    minimum_duration: f64,
    period: Option<f64>,
    /// Of a batch: at which time states are wanted.
    at: Option<f64>,
    /// Of a batch: how many threads; 0 is one for each processor.
    threads: usize,
}

impl Choices {
    fn options<const N: usize>(&self) -> PyResult<planned::Options<N>> {
        let synchronisation = match self.synchronisation.as_str() {
            "time" => Synchronisation::Time,
            "phase" => Synchronisation::Phase,
            "phase-if-possible" => Synchronisation::PhaseIfPossible,
            "none" => Synchronisation::None,
            other => {
                return Err(argument(format!(
                    "synchronisation: expected time, phase, phase-if-possible or none, got {other:?}"
                )));
            }
        };
        if self.velocity_only.len() != N || self.enabled.len() != N {
            return Err(argument(format!("expected options for {N} joints")));
        }
        Ok(planned::Options {
            interface: std::array::from_fn(|i| {
                if self.velocity_only[i] {
                    Interface::Velocity
                } else {
                    Interface::Position
                }
            }),
            synchronisation,
            enabled: std::array::from_fn(|i| self.enabled[i]),
            minimum_duration: self.minimum_duration,
            period: self.period,
        })
    }
}

fn row<const N: usize>(numbers: &[f64], row: usize) -> SVector<f64, N> {
    SVector::from_column_slice(&numbers[N * row..N * (row + 1)])
}

fn limits<const N: usize>(numbers: &[f64]) -> planned::Limits<N> {
    planned::Limits {
        position_min: row(numbers, 0),
        position_max: row(numbers, 1),
        velocity_min: row(numbers, 2),
        velocity_max: row(numbers, 3),
        acceleration_min: row(numbers, 4),
        acceleration_max: row(numbers, 5),
        jerk: row(numbers, 6),
    }
}

fn state<const N: usize>(numbers: &[f64], first: usize) -> planned::State<N> {
    planned::State {
        position: row(numbers, first),
        velocity: row(numbers, first + 1),
        acceleration: row(numbers, first + 2),
    }
}

/// Plans one motion: states (6, dof), limits (7, dof).
#[pyfunction]
#[pyo3(name = "otg")]
pub(crate) fn otg(
    py: Python<'_>,
    states: Numbers<'_>,
    limits: Numbers<'_>,
    choices: Choices,
) -> PyResult<Motion> {
    let (given, dof) = rows(&states, "states", STATES)?;
    let (bounds, also) = rows(&limits, "limits", LIMITS)?;
    if joints(dof)? != also {
        return Err(argument(format!(
            "limits: expected {dof} joints, got {also}"
        )));
    }
    plan(py, (given, bounds), dof, &choices)
}

/// Plans one motion from the fields of an `InputParameter`; none where [`Problem`] cannot read
/// them, and `otg` has to take them as arrays.
#[pyfunction]
#[pyo3(name = "otg_of")]
pub(crate) fn otg_of(
    py: Python<'_>,
    fields: &Bound<'_, PyDict>,
    dof: usize,
    kind: (String, bool),
    period: Option<f64>,
) -> PyResult<Option<Motion>> {
    let (synchronisation, velocity_only) = kind;
    let Some(problem) = Problem::read(fields, joints(dof)?)? else {
        return Ok(None);
    };
    let choices = Choices {
        synchronisation,
        velocity_only: vec![velocity_only; dof],
        enabled: problem.enabled,
        minimum_duration: problem.minimum_duration,
        period,
        at: None,
        threads: 0,
    };
    plan(py, (&problem.states, &problem.limits), dof, &choices).map(Some)
}

/// Plans one motion: states (6, dof), limits (7, dof).
fn plan(
    py: Python<'_>,
    (states, limits): (&[f64], &[f64]),
    dof: usize,
    choices: &Choices,
) -> PyResult<Motion> {
    with_dof!(dof, N => {
        let options = choices.options::<N>()?;
        let motion = wait::short(py, "a state-to-state motion", || {
            let (start, target) = (state(states, 0), state(states, 3));
            (Kernels::<N>::get().otg)(&start, &target, &self::limits(limits), &options)
        })?;
        Ok(Motion(Box::new(motion.map_err(Raise::from)?)))
    })
}

/// Durations, and the states at one time.
type Durations<'py> = (Bound<'py, PyArray1<f64>>, Option<Bound<'py, PyArray3<f64>>>);

/// Plans many motions within the same limits: states (n, 6, dof), limits (7, dof). Durations (n,),
/// NaN where there is none; with `at`, the states at that time (n, 4, dof).
#[pyfunction]
#[pyo3(name = "otg_batch")]
pub(crate) fn otg_batch<'py>(
    py: Python<'py>,
    states: Numbers<'_>,
    limits: Numbers<'_>,
    choices: Choices,
) -> PyResult<Durations<'py>> {
    let (at, threads) = (choices.at, choices.threads);
    let (bounds, dof) = rows(&limits, "limits", LIMITS)?;
    let (given, count) = rows(&states, "states", STATES * joints(dof)?)?;
    let mut durations = vec![f64::NAN; count];
    let mut found = vec![f64::NAN; if at.is_some() { 4 * dof * count } else { 0 }];
    let first = std::sync::Mutex::new(None::<(usize, OtgError)>);
    with_dof!(dof, N => {
        let (options, bounds) = (choices.options::<N>()?, self::limits::<N>(bounds));
        let plan = Kernels::<N>::get().otg;
        let width = if at.is_some() { 4 * N } else { 0 };
        let mut empty: Vec<&mut [f64]> = Vec::new();
        let blocks = count.div_ceil(BATCH);
        let samples: Box<dyn Iterator<Item = &mut [f64]> + Send> = if width > 0 {
            Box::new(found.chunks_mut(BATCH * width))
        } else {
            empty.resize_with(blocks, Default::default);
            Box::new(empty.into_iter())
        };
        let jobs = durations.chunks_mut(BATCH).zip(samples).enumerate();
        wait::parallel(py, "state-to-state motions", jobs, threads, |(block, job)| {
            let (durations, samples) = job;
            for (k, duration) in durations.iter_mut().enumerate() {
                let number = block * BATCH + k;
                let given = &given[STATES * N * number..STATES * N * (number + 1)];
                match plan(&state(given, 0), &state(given, 3), &bounds, &options) {
                    Ok(motion) => {
                        *duration = motion.duration();
                        if let Some(at) = at {
                            let out = &mut samples[width * k..width * (k + 1)];
                            put(&motion.sample(at), 0, 1, out);
                        }
                    }
                    Err(error) => {
                        if let Ok(mut first) = first.lock()
                            && first.is_none_or(|(other, _)| number < other)
                        {
                            *first = Some((number, error));
                        }
                    }
                }
            }
        })?;
    });
    if let Ok(Some((number, error))) = first.into_inner() {
        return Err(Raise::from(error)
            .with("index", Field::Count(number))
            .into());
    }
    let found = at
        .map(|_| found.into_pyarray(py).reshape([count, 4, dof]))
        .transpose()?;
    Ok((durations.into_pyarray(py), found))
}
