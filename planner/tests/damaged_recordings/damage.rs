//! One kind of damage: its effect, and the rule that it breaks.

use crcl::Command;
use planner::recorded::{RecordedSample, Rule};

use crate::scene::Scene;

/// What a damage leaves: the program and the recording that is held against it.
pub(crate) struct Damaged {
    pub(crate) commands: Vec<Command>,
    pub(crate) rows: Vec<RecordedSample>,
}

/// A kind of damage.
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    /// It breaks one of these: which one depends on the limits of the robot.
    pub(crate) rules: &'static [Rule],
    pub(crate) make: Make,
}

/// How it is made.
pub(crate) enum Make {
    /// By changing the rows of the good recording.
    Rows(fn(&mut Vec<RecordedSample>)),
    /// By changing the rows of the good recording of a run.
    Run(fn(&mut Vec<RecordedSample>)),
    /// By recording another program than the one that it is held against. First the one that is
    /// recorded, then the one that it claims to be.
    Program(fn(&Scene) -> [Vec<Command>; 2]),
}

/// A kind that changes rows.
pub(crate) const fn rows(
    name: &'static str,
    rules: &'static [Rule],
    make: fn(&mut Vec<RecordedSample>),
) -> Kind {
    Kind {
        name,
        rules,
        make: Make::Rows(make),
    }
}

/// A kind that records another program.
pub(crate) const fn program(
    name: &'static str,
    rules: &'static [Rule],
    make: fn(&Scene) -> [Vec<Command>; 2],
) -> Kind {
    Kind {
        name,
        rules,
        make: Make::Program(make),
    }
}

/// A kind that changes rows of a run.
pub(crate) const fn run(
    name: &'static str,
    rules: &'static [Rule],
    make: fn(&mut Vec<RecordedSample>),
) -> Kind {
    Kind {
        name,
        rules,
        make: Make::Run(make),
    }
}
