//! Executing kitting process plans.
//!
//! The interpreter is a pure function from a state and a world to a [`Step`]; the [`Controller`] has
//! the step's motion executed and then commits its effects on the world together with the state of
//! the plan, in one transaction.

mod agents;
mod assignment;
mod batch;
mod controller;
mod eval;
mod factotum;
mod instance;
mod machine;
mod motion;
mod order;
mod preparation;
mod program;
mod report;
mod robot;
mod simulated;
mod state;
mod value;

pub use batch::{Batch, Errand, Request, Tool, canonical};
pub use controller::{Cell, Controller, Policy, RunOptions};
pub(crate) use eval::matches;
pub use factotum::{Delivery, Factotum, FactotumStatus, SimulatedFactotum, Stock};
pub use motion::{Motion, MotionFailure, Situation};
pub use preparation::{parameters, prepare};
pub use program::Program;
pub use report::{Event, PlanRunReport};
pub use robot::RobotOptions;
pub(crate) use robot::{Robot, situation};
pub use simulated::SimulatedMotion;
pub use state::{Act, Counters, Outcome, State, Step};
pub use value::{PoseValue, Value};
