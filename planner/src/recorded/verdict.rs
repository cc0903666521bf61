//! What the samples prove, as data.

use serde::Serialize;

use super::finding::Finding;

/// How an intermediate pose was passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PassFound {
    /// Which pose of the command, counted from 1.
    pub index: usize,
    /// Distance at the closest approach that keeps the order, m.
    pub deviation_m: f64,
    /// Tolerance in force, m; rounding for the last pose.
    pub tolerance_m: f64,
    /// When, s.
    pub time_s: f64,
    /// Whether it is within, in order.
    pub within: bool,
}

/// What the samples prove about one command.
#[derive(Clone, Debug, Serialize)]
pub struct CommandVerdict {
    /// Number of the command in the program, from 0.
    pub index: usize,
    /// Line of the program, from 1.
    pub line: usize,
    /// Name of the command.
    pub name: &'static str,
    /// Number of samples of it.
    pub samples: usize,
    /// For a move: its poses, the last included.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<PassFound>,
    /// For a straight move: largest distance from the line, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_m: Option<f64>,
    /// Largest ratio to a limit of joint or tool that the samples prove, and which limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak: Option<(f64, String)>,
    /// What is wrong, as text; empty if nothing is.
    pub findings: Vec<String>,
    /// What is wrong, as data, in the order of `findings`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub broken: Vec<Finding>,
}

/// What the samples prove about a program.
#[derive(Clone, Debug, Serialize)]
pub struct ProgramVerdict {
    /// Version of this form.
    pub schema: u32,
    /// Name of the robot.
    pub robot: String,
    /// Number of samples.
    pub samples: usize,
    /// The commands, in order.
    pub commands: Vec<CommandVerdict>,
    /// What is wrong with the samples as a whole, as text.
    pub findings: Vec<String>,
    /// What is wrong with the samples as a whole, as data, in the order of `findings`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub broken: Vec<Finding>,
    /// Whether nothing is wrong anywhere.
    pub holds: bool,
}

impl ProgramVerdict {
    /// Everything that is wrong: first with the samples as a whole, then by command.
    pub fn all_broken(&self) -> impl Iterator<Item = &Finding> {
        let commands = self.commands.iter().flat_map(|command| &command.broken);
        self.broken.iter().chain(commands)
    }
}
