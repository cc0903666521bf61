//! The interface of section VII of the language's specification: a controller pulls a plan, one
//! step at a time.

mod controller;
pub mod ffi;
mod pddl;

pub use controller::{Pull, PulledRun, pull};
pub use pddl::PddlInterpreter;

use crcl::Command;

use crate::run::Tool;
use crate::world::Change;

/// Results of the five functions: 0 for success, otherwise positive.
///
/// # Source
/// T. Kramer, "Canonical Robot Commands", draft of May 24, 2012, section VII; the numbers are
/// chosen here, because the draft only says "positive".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Code {
    /// All is well.
    Ok = 0,
    /// There are no more steps; EndCanon(0) was sent. Only from `execute`.
    EndOfPlan = 1,
    /// `init` was not called, or `exit` was.
    NotInitialised = 2,
    /// No plan is open.
    NoPlanOpen = 3,
    /// A plan is open already.
    PlanAlreadyOpen = 4,
    /// The plan's file cannot be read.
    CannotReadFile = 5,
    /// The plan cannot be understood; the last error says line and column.
    ParseError = 6,
    /// The type of plan is not supported.
    UnsupportedPlanType = 7,
    /// Unknown action, or a wrong number of objects.
    UnknownAction = 8,
    /// A symbolic pose is not in the database.
    NoSuchPose = 9,
    /// A precondition is false in the world.
    PreconditionFalse = 10,
    /// The controller did not take a command.
    SinkFull = 11,
    /// Anything else, such as the database.
    Internal = 12,
}

/// Takes the canonical commands of a step.
pub trait CommandSink {
    /// Takes one command; false when there is no room.
    fn command(&mut self, command: Command) -> bool;

    /// After the last command the tool on the arm is this. A sink that needs only commands may
    /// ignore it.
    fn tool(&mut self, _tool: Option<Tool>) {}

    /// The effects on the world when all commands of the step have been executed. The controller
    /// commits them then, or drops them when a command fails.
    fn effects(&mut self, _changes: Vec<Change>) {}
}

/// A plan interpreter: the controller calls it, and it only reads the database.
///
/// Life cycle: `init`, then any number of plans (`open_plan`, `execute` until it is not 0,
/// `close_plan`), then `exit`. `execute` binds symbolic poses when it is called, so the controller
/// calls it when all commands of the step before have been executed and their effects committed.
pub trait PlanInterpreter {
    /// InterpInit: gets ready.
    fn init(&mut self) -> Code;

    /// InterpOpenPlan: reads a whole plan and sends InitCanon.
    fn open_plan(&mut self, file_name: &str, plan_type: &str, sink: &mut dyn CommandSink) -> Code;

    /// InterpExecute: interprets the next step and sends its commands. At the end it sends
    /// EndCanon(0) and returns [`Code::EndOfPlan`]; on an error it sends EndCanon(code).
    fn execute(&mut self, sink: &mut dyn CommandSink) -> Code;

    /// InterpClosePlan: closes the plan.
    fn close_plan(&mut self) -> Code;

    /// InterpExit: stops.
    fn exit(&mut self) -> Code;

    /// The message of the last error; empty if there was none.
    fn last_error(&self) -> &str;
}
