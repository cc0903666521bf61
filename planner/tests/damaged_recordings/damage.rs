//! One kind of damage: what it does, and the rule that it breaks.

use crcl::Command;
use planner::recorded::{Row, Rule};

use crate::scene::Scene;

/// What a damage leaves: the program and the recording that is held against it.
pub struct Damaged {
    pub commands: Vec<Command>,
    pub rows: Vec<Row>,
}

/// A kind of damage.
pub struct Kind {
    pub name: &'static str,
    /// It breaks one of these: which one depends on the limits of the robot.
    pub rules: &'static [Rule],
    pub make: Make,
}

/// How it is made.
pub enum Make {
    /// By changing the rows of the good recording.
    Rows(fn(&mut Vec<Row>)),
    /// By changing the rows of the good recording of a run.
    Run(fn(&mut Vec<Row>)),
    /// By recording another program than the one that it is held against. First the one that is
    /// recorded, then the one that it claims to be.
    Program(fn(&Scene) -> [Vec<Command>; 2]),
}

/// A kind that changes rows.
pub const fn rows(name: &'static str, rules: &'static [Rule], make: fn(&mut Vec<Row>)) -> Kind {
    Kind {
        name,
        rules,
        make: Make::Rows(make),
    }
}

/// A kind that records another program.
pub const fn program(
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
pub const fn run(name: &'static str, rules: &'static [Rule], make: fn(&mut Vec<Row>)) -> Kind {
    Kind {
        name,
        rules,
        make: Make::Run(make),
    }
}
