//! The report of a run of a plan, in the same form for both kinds of plans.

use std::io::{self, Write};

use plan::run::PlanRunReport;
use serde::Serialize;

use crate::output;

/// The report of a run. Scripts rely on the names.
#[derive(Debug, Serialize)]
pub(crate) struct PlanReport {
    /// `stopped` at the end of the plan, `failed`, or `interrupted` by the operator.
    outcome: &'static str,
    /// Reason given to EndCanon: 0, or positive when the plan failed.
    code: i64,
    /// In words; null when all went well.
    reason: Option<String>,
    statements: usize,
    commands: usize,
    pick_ups: usize,
    put_downs: usize,
    moves_above: usize,
    end_effector_changes: usize,
    factotum_calls: usize,
    kits: usize,
    motion_s: f64,
    wall_s: f64,
    /// Time (s) by which the orders that the executor chose are shorter than the written ones.
    gained_s: f64,
    warnings: Vec<String>,
}

impl From<PlanRunReport> for PlanReport {
    fn from(report: PlanRunReport) -> Self {
        let counters = report.counters;
        Self {
            outcome: report.outcome,
            code: report.code,
            reason: report.reason,
            statements: counters.statements,
            commands: counters.commands,
            pick_ups: counters.pick_ups,
            put_downs: counters.put_downs,
            moves_above: counters.moves_above,
            end_effector_changes: counters.end_effector_changes,
            factotum_calls: counters.factotum_calls,
            kits: counters.kits,
            motion_s: counters.motion_s,
            wall_s: report.wall_s,
            gained_s: counters.gained_s,
            warnings: report.warnings,
        }
    }
}

impl PlanReport {
    /// `stopped`, `failed` or `interrupted`.
    pub(crate) fn outcome(&self) -> &str {
        self.outcome
    }

    /// Writes the report, as JSON or as text; `off_path` is the largest distance (m) of the arm
    /// from its path.
    ///
    /// # Errors
    /// The sink cannot be written.
    pub(crate) fn write(
        &self,
        out: &mut impl Write,
        json: bool,
        off_path: Option<f64>,
    ) -> io::Result<()> {
        if json {
            return output::json_to(out, self);
        }
        match (&self.reason, self.outcome) {
            (Some(reason), "interrupted") => writeln!(out, "interrupted: {reason}")?,
            (Some(reason), outcome) => {
                writeln!(out, "{outcome}: {reason} (EndCanon({}))", self.code)?;
            }
            (None, _) => {}
        }
        let counts = [
            (self.kits, "kit"),
            (self.statements, "statement"),
            (self.commands, "command"),
            (self.pick_ups, "pick-up"),
            (self.put_downs, "put-down"),
        ];
        let counts: Vec<String> = counts.map(|(count, name)| counted(count, name)).into();
        writeln!(
            out,
            "{}, {} above, {}, {}",
            counts.join(", "),
            counted(self.moves_above, "move"),
            counted(self.end_effector_changes, "end effector change"),
            counted(self.factotum_calls, "factotum call"),
        )?;
        write!(out, "{:.3} s of motion", self.motion_s)?;
        if self.gained_s > 0.0 {
            write!(out, ", {:.3} s gained by chosen orders", self.gained_s)?;
        }
        write!(out, "; {:.3} s by the clock on the wall", self.wall_s)?;
        if let Some(off_path) = off_path {
            write!(
                out,
                "; driver at most {:.3} mm off the path",
                off_path * 1e3
            )?;
        }
        writeln!(out, "; {}", counted(self.warnings.len(), "warning"))
    }
}

/// A number with its noun.
pub(crate) fn counted(count: usize, name: &str) -> String {
    format!("{count} {name}{}", if count == 1 { "" } else { "s" })
}
