//! Executing kitting process plans.
//!
//! The interpreter is a pure function from a state and a world to a [`Step`]; the [`Controller`] has
//! the step's motion executed and then commits its effects on the world together with the state of
//! the plan, in one transaction.

mod batch;
mod controller;
mod eval;
mod factotum;
mod machine;
mod motion;
mod order;
mod program;
mod robot;
mod simulated;
mod value;

pub use batch::{Batch, Errand, Request, Tool, canonical};
pub use controller::{Cell, Controller, Event, Policy, Report, RunOptions, parameters, prepare};
pub(crate) use eval::matches;
pub use factotum::{Delivery, Factotum, FactotumStatus, SimulatedFactotum, Stock};
pub use machine::{Act, Counters, Outcome, State, Step};
pub use motion::{Motion, MotionFailure, Situation};
pub use program::Program;
pub use robot::RobotOptions;
pub(crate) use robot::{Robot, situation};
pub use simulated::SimulatedMotion;
pub use value::{PoseValue, Value};
