//! Executing plans.
//!
//! One loop executes plans of every kind: it asks for a [`Step`], has the step's motion executed and
//! then commits its effects on the world together with the state of the plan, in one transaction.
//! The [`Controller`] gives it the steps of kitting plans: their interpreter is a pure function from
//! a state and a world to a step. [`crate::interp::pull`] gives it those of PDDL plans.

mod agents;
mod assignment;
mod batch;
mod controller;
mod eval;
mod execution;
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
pub use controller::{Cell, Controller, RunOptions};
pub(crate) use eval::matches;
pub use execution::Policy;
pub(crate) use execution::{Execution, NextStep, Run, Steps, place_arm};
pub use factotum::{Delivery, Factotum, FactotumStatus, SimulatedFactotum, Stock};
pub use motion::{Motion, MotionFailure, Situation};
pub use preparation::{parameters, prepare};
pub use program::Program;
pub use report::{Event, PlanRunReport, RunOutcome};
pub(crate) use robot::Robot;
pub use robot::RobotOptions;
pub use simulated::SimulatedMotion;
pub use state::{Act, Counters, Outcome, State, Step};
pub use value::{PoseValue, Value};
