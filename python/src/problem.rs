//! A state-to-state problem of Python, read field by field without arrays in between.
//!
//! One motion is planned in some microseconds; to make an array of each field takes longer. What is
//! not simply a list, tuple or array of as many numbers as there are joints is not read here: the
//! Python layer then takes its way through arrays, which says what is wrong.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyTuple};

/// Most joints that are planned.
const JOINTS: usize = 8;

/// One number for each joint.
type Row = [f64; JOINTS];

/// States and limits as [`crate::otg`] takes them: rows of numbers, joint after joint.
pub(crate) struct Problem {
    /// Position, velocity, acceleration of start and target.
    pub(crate) states: Vec<f64>,
    /// Positions from, to; velocities from, to; accelerations from, to; jerk.
    pub(crate) limits: Vec<f64>,
    /// Which joints take part.
    pub(crate) enabled: Vec<bool>,
    /// Shortest duration (s).
    pub(crate) minimum_duration: f64,
}

impl Problem {
    /// Reads the fields of an `InputParameter`; none where a field is of another kind.
    pub(crate) fn read(fields: &Bound<'_, PyDict>, dof: usize) -> PyResult<Option<Self>> {
        let py = fields.py();
        let Some(states) = states(fields, dof)? else {
            return Ok(None);
        };
        let Some(limits) = limits(fields, dof)? else {
            return Ok(None);
        };
        let enabled = fields.get_item(intern!(py, "enabled"))?;
        let shortest = fields.get_item(intern!(py, "minimum_duration"))?;
        let enabled = enabled.and_then(|field| flags(&field, dof));
        let shortest = shortest.and_then(|field| match field.is_none() {
            true => Some(0.0),
            false => number(&field),
        });
        Ok(enabled
            .zip(shortest)
            .map(|(enabled, minimum_duration)| Self {
                states,
                limits,
                enabled,
                minimum_duration,
            }))
    }
}

/// Position, velocity, acceleration of start and target.
fn states(fields: &Bound<'_, PyDict>, dof: usize) -> PyResult<Option<Vec<f64>>> {
    let py = fields.py();
    let mut all = Vec::with_capacity(6 * dof);
    for name in [
        intern!(py, "current_position"),
        intern!(py, "current_velocity"),
        intern!(py, "current_acceleration"),
        intern!(py, "target_position"),
        intern!(py, "target_velocity"),
        intern!(py, "target_acceleration"),
    ] {
        let field = fields.get_item(name)?;
        let Some(row) = field.and_then(|field| numbers(&field, dof)) else {
            return Ok(None);
        };
        all.extend_from_slice(&row[..dof]);
    }
    Ok(Some(all))
}

/// Positions, velocities and accelerations from, to; jerk.
fn limits(fields: &Bound<'_, PyDict>, dof: usize) -> PyResult<Option<Vec<f64>>> {
    let py = fields.py();
    let mut all = Vec::with_capacity(7 * dof);
    let mut missing = Vec::with_capacity(7);
    for (name, default) in [
        (intern!(py, "min_position"), f64::NEG_INFINITY),
        (intern!(py, "max_position"), f64::INFINITY),
        (intern!(py, "min_velocity"), f64::NEG_INFINITY),
        (intern!(py, "max_velocity"), f64::INFINITY),
        (intern!(py, "min_acceleration"), f64::NEG_INFINITY),
        (intern!(py, "max_acceleration"), f64::INFINITY),
        (intern!(py, "max_jerk"), f64::INFINITY),
    ] {
        let field = fields.get_item(name)?.filter(|field| !field.is_none());
        missing.push(field.is_none());
        let row = field.map_or(Some([default; JOINTS]), |field| numbers(&field, dof));
        let Some(row) = row else {
            return Ok(None);
        };
        all.extend_from_slice(&row[..dof]);
    }
    mirror(&mut all, dof, &missing);
    Ok(Some(all))
}

/// Lowest velocities and accelerations that are not given are the highest with another sign.
fn mirror(limits: &mut [f64], dof: usize, missing: &[bool]) {
    for lowest in [2, 4].into_iter().filter(|row| missing[*row]) {
        for joint in 0..dof {
            limits[lowest * dof + joint] = -limits[(lowest + 1) * dof + joint];
        }
    }
}

/// A float or an integer.
fn number(value: &Bound<'_, PyAny>) -> Option<f64> {
    if let Ok(float) = value.cast_exact::<PyFloat>() {
        return Some(float.value());
    }
    let whole = value.cast_exact::<PyInt>().ok()?;
    whole.extract().ok()
}

/// As many numbers as there are joints.
fn numbers(field: &Bound<'_, PyAny>, dof: usize) -> Option<Row> {
    let mut row = [0.0; JOINTS];
    if let Ok(list) = field.cast_exact::<PyList>() {
        (list.len() == dof).then_some(())?;
        for (to, value) in row.iter_mut().zip(list.iter()) {
            *to = number(&value)?;
        }
        return Some(row);
    }
    if let Ok(tuple) = field.cast_exact::<PyTuple>() {
        (tuple.len() == dof).then_some(())?;
        for (to, value) in row.iter_mut().zip(tuple.iter()) {
            *to = number(&value)?;
        }
        return Some(row);
    }
    let array = field.cast::<PyArray1<f64>>().ok()?.try_readonly().ok()?;
    let array = array.as_array();
    (array.len() == dof).then_some(())?;
    for (to, value) in row.iter_mut().zip(array) {
        *to = *value;
    }
    Some(row)
}

/// As many yes or no as there are joints.
fn flags(field: &Bound<'_, PyAny>, dof: usize) -> Option<Vec<bool>> {
    let list = field.cast_exact::<PyList>().ok()?;
    (list.len() == dof).then_some(())?;
    list.iter()
        .map(|value| value.cast_exact::<PyBool>().map(|yes| yes.is_true()).ok())
        .collect()
}
