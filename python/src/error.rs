//! Errors of the libraries as exceptions of `canter.errors`, with their fields.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use ipc::IpcError;
use kinematics::{IkFailure, UrdfError};
use planner::robot::RobotError;
use trajectory::TimingError;
use trajectory::otg::OtgError;
use trajectory::smooth::SmoothError;

/// A value of a field.
#[derive(Clone, Debug)]
pub(crate) enum Field {
    /// A text.
    Text(String),
    /// A number.
    Number(f64),
    /// An index or a count.
    Count(usize),
    /// Any other data, as JSON.
    Json(String),
}

/// An exception that is about to be raised.
#[derive(Clone, Debug)]
pub(crate) struct Raise {
    class: &'static str,
    message: String,
    fields: Vec<(&'static str, Field)>,
}

impl Raise {
    /// An exception of a class of `canter.errors`.
    pub(crate) fn new(class: &'static str, message: impl ToString) -> Self {
        Self {
            class,
            message: message.to_string(),
            fields: Vec::new(),
        }
    }

    /// The same with a field.
    pub(crate) fn with(mut self, name: &'static str, value: Field) -> Self {
        self.fields.push((name, value));
        self
    }

    fn into_exception(self, py: Python<'_>) -> PyResult<PyErr> {
        let class = py.import("canter.errors")?.getattr(self.class)?;
        let fields = PyDict::new(py);
        for (name, value) in self.fields {
            match value {
                Field::Text(text) => fields.set_item(name, text)?,
                Field::Number(number) => fields.set_item(name, number)?,
                Field::Count(count) => fields.set_item(name, count)?,
                Field::Json(text) => {
                    let data = py.import("json")?.call_method1("loads", (text,))?;
                    fields.set_item(name, data)?;
                }
            }
        }
        Ok(PyErr::from_value(
            class.call((self.message,), Some(&fields))?,
        ))
    }
}

impl From<Raise> for PyErr {
    fn from(raise: Raise) -> Self {
        Python::attach(|py| raise.into_exception(py).unwrap_or_else(|error| error))
    }
}

/// An argument that cannot be used.
pub(crate) fn argument(message: impl ToString) -> PyErr {
    PyValueError::new_err(message.to_string())
}

/// A panic of a library: an error of Canter, whatever the arguments were.
pub(crate) fn internal(what: &str) -> PyErr {
    Raise::new(
        "InternalError",
        format!("{what} panicked; this is an error of Canter, please report it with the arguments"),
    )
    .into()
}

impl From<OtgError> for Raise {
    fn from(error: OtgError) -> Self {
        use OtgError as E;
        let raise = Self::new("OtgError", error);
        let at = |raise: Self, joint| raise.with("joint", Field::Count(joint));
        let text = |quantity: &str| Field::Text(quantity.to_owned());
        match error {
            E::NotFinite {
                joint,
                quantity,
                value,
            }
            | E::BadLimit {
                joint,
                quantity,
                value,
                ..
            } => at(raise, joint)
                .with("quantity", text(quantity))
                .with("value", Field::Number(value)),
            E::BadOption { option, value, .. } => raise
                .with("quantity", text(option))
                .with("value", Field::Number(value)),
            E::TargetBeyondLimit {
                joint,
                quantity,
                value,
                limit,
            } => at(raise, joint)
                .with("quantity", text(quantity))
                .with("value", Field::Number(value))
                .with("limit", Field::Number(limit)),
            E::PositionLimit {
                joint,
                value,
                limit,
            } => at(raise, joint)
                .with("quantity", text("position"))
                .with("value", Field::Number(value))
                .with("limit", Field::Number(limit)),
            E::NotStraight {
                joint,
                quantity,
                deviation,
            } => at(raise, joint)
                .with("quantity", text(quantity))
                .with("value", Field::Number(deviation)),
            E::OutOfRange { joint, time } => at(raise, joint)
                .with("quantity", text("duration"))
                .with("value", Field::Number(time)),
            _ => raise,
        }
    }
}

impl From<TimingError> for Raise {
    fn from(error: TimingError) -> Self {
        use TimingError as E;
        let raise = Self::new("TimingError", &error);
        let text = |quantity: &str| Field::Text(quantity.to_owned());
        match error {
            E::BadJointLimit {
                joint,
                quantity,
                value,
            } => raise
                .with("joint", Field::Count(joint))
                .with("quantity", text(quantity))
                .with("value", Field::Number(value)),
            E::BadToolLimit { quantity, value }
            | E::BadOption {
                option: quantity,
                value,
            } => raise
                .with("quantity", text(quantity))
                .with("value", Field::Number(value)),
            E::EmptyPath { end: u } | E::NotFinite { u } => raise.with("u", Field::Number(u)),
            E::Corner {
                u,
                joint,
                order,
                jump,
            } => raise
                .with("u", Field::Number(u))
                .with("joint", Field::Count(joint))
                .with("quantity", Field::Text(format!("derivative {order}")))
                .with("value", Field::Number(jump)),
            E::StartTooFast { ratio, limit } => raise
                .with("quantity", Field::Text(limit))
                .with("value", Field::Number(ratio)),
            _ => raise,
        }
    }
}

impl From<SmoothError> for Raise {
    fn from(error: SmoothError) -> Self {
        use SmoothError as E;
        let raise = Self::new("SmoothError", &error);
        match error {
            E::BadPose { index, value } => raise
                .with("pose", Field::Count(index))
                .with("value", Field::Number(value)),
            E::BadLimit { quantity, value } | E::BadTolerance { quantity, value } => raise
                .with("quantity", Field::Text(quantity.to_owned()))
                .with("value", Field::Number(value)),
            _ => raise,
        }
    }
}

impl From<RobotError> for Raise {
    fn from(error: RobotError) -> Self {
        use RobotError as E;
        let raise = Self::new("RobotError", &error);
        match error {
            E::Read { file, .. } | E::Write { file, .. } | E::TooManyJoints { file, .. } => {
                raise.with("file", Field::Text(file))
            }
            E::Toml {
                file, line, column, ..
            }
            | E::Value {
                file, line, column, ..
            } => raise
                .with("file", Field::Text(file))
                .with("line", Field::Count(line))
                .with("column", Field::Count(column)),
            E::Urdf { file, source } => urdf(raise.with("file", Field::Text(file)), &source),
            _ => raise,
        }
    }
}

/// The place in a URDF, which begins the message where there is one.
fn urdf(raise: Raise, error: &UrdfError) -> Raise {
    let text = error.to_string();
    let mut numbers = text.split(':').map(|part| part.parse::<usize>().ok());
    match (numbers.next().flatten(), numbers.next().flatten()) {
        (Some(line), Some(column)) => raise
            .with("line", Field::Count(line))
            .with("column", Field::Count(column)),
        _ => raise,
    }
}

impl From<IpcError> for Raise {
    fn from(error: IpcError) -> Self {
        let class = match error {
            IpcError::NoAnswer { .. } | IpcError::NoWord { .. } => "NoEngine",
            _ => "ConnectionFailed",
        };
        Self::new(class, error)
    }
}

/// The fields of a pose that is not reached.
pub(crate) fn unreached(raise: Raise, failure: &IkFailure) -> Raise {
    let reason = |name: &str| Field::Text(name.to_owned());
    match *failure {
        IkFailure::NotFinite => raise.with("reason", reason("not finite")),
        IkFailure::OutOfReach { distance } => raise
            .with("reason", reason("out of reach"))
            .with("value", Field::Number(distance)),
        IkFailure::Orientation { angle } => raise
            .with("reason", reason("orientation"))
            .with("value", Field::Number(angle)),
        IkFailure::AtLimit { joint, beyond } => raise
            .with("reason", reason("joint limit"))
            .with("joint", Field::Count(joint))
            .with("value", Field::Number(beyond)),
        IkFailure::Singular { smallest } => raise
            .with("reason", reason("singular"))
            .with("value", Field::Number(smallest)),
        _ => raise,
    }
}
