//! PDDL plans: plan files, domains and problems, actions as canonical commands.

mod actions;
mod domain;
mod plan_file;
mod sexpr;
mod simulate;

pub use actions::ActionTable;
pub use domain::{Domain, Problem, read_domain, read_problem};
pub use plan_file::{PlanStep, read_plan};
pub use sexpr::PddlError;
pub use simulate::{Failure, simulate};
