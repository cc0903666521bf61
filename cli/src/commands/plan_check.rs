use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use plan::finding::{Finding, Severity, has_errors};
use plan::kitting::{Plan, check, read, write};
use plan::pddl::{PddlError, read_domain, read_plan, read_problem, simulate};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::pddl_file::{action_table, is_pddl};
use crate::plan_report::counted;
use crate::{input, output, world_file};

/// Check a kitting process plan or a PDDL plan without executing it
///
/// Kitting plans are read in the outline layout, the block layout and JSON; with a world also checks
/// that what the plan requires is there. A PDDL plan is simulated when its domain and
/// problem are given: up to its goal, or to the first precondition that is false.
#[derive(Args, Debug)]
pub(crate) struct PlanCheck {
    /// The plan
    plan: PathBuf,
    /// Database, or workstation file (.toml, .json, .xml)
    #[arg(long, value_name = "WORLD")]
    world: Option<PathBuf>,
    /// Domain of a PDDL plan
    #[arg(long, value_name = "DOMAIN.pddl", requires = "problem")]
    domain: Option<PathBuf>,
    /// Problem of a PDDL plan
    #[arg(long, value_name = "PROBLEM.pddl", requires = "domain")]
    problem: Option<PathBuf>,
    /// Table (TOML) of further PDDL actions
    #[arg(long, value_name = "TABLE.toml")]
    actions: Option<PathBuf>,
    /// Print counts and findings as JSON
    #[arg(long, conflicts_with = "to")]
    json: bool,
    /// Print the kitting plan itself in another form, when it can be read without errors
    #[arg(long, value_enum)]
    to: Option<Form>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Form {
    /// The layout with begin and end.
    Block,
    /// JSON.
    Json,
}

impl PlanCheck {
    /// Reads and checks the plan.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let source = input::text(&self.plan)?;
        if self.domain.is_some() || is_pddl(&source) {
            return self.pddl(&source);
        }
        let world = self.world.as_deref().map(world_file::load).transpose()?;
        let reading = read(&source);
        let mut findings = reading.findings;
        if !has_errors(&findings) {
            findings.extend(check(&reading.plan, world.as_ref()));
            findings.sort_by_key(|finding| finding.span.start);
        }
        match self.to {
            Some(form) if !has_errors(&findings) => convert(&reading.plan, form)?,
            _ if self.json => self.print_json(&source, &reading.plan, &findings)?,
            _ => self.print(&source, &reading.plan, &findings)?,
        }
        Ok(if has_errors(&findings) {
            Exit::Refused
        } else {
            Exit::Done
        })
    }

    fn pddl(&self, source: &str) -> Result<Exit, Failure> {
        let verdict = self.judge(source)?;
        let (steps, reason) = match &verdict {
            Ok(steps) => (*steps, None),
            Err((steps, reason)) => (*steps, Some(reason)),
        };
        let goal = self.problem.is_some();
        if self.json {
            let goal = goal.then_some(verdict.is_ok());
            output::json(&serde_json::json!({
                "steps": steps,
                "goal_reached": goal,
                "reason": reason,
            }))?;
        } else {
            let mut out = io::stdout().lock();
            match reason {
                Some(reason) => writeln!(out, "{}: {reason}", self.plan.display())?,
                None if goal => writeln!(out, "{steps} steps, the goal is reached")?,
                None => writeln!(out, "{steps} steps, all actions are known")?,
            }
        }
        Ok(if verdict.is_ok() {
            Exit::Done
        } else {
            Exit::Refused
        })
    }

    /// Number of steps of a PDDL plan without errors, or the number of good steps and the error.
    fn judge(&self, source: &str) -> Result<Result<usize, (usize, String)>, Failure> {
        let steps = match read_plan(source) {
            Ok(steps) => steps,
            Err(error) => return Ok(Err((0, error.to_string()))),
        };
        let count = steps.len();
        if let (Some(domain), Some(problem)) = (&self.domain, &self.problem) {
            let unreadable = |path: &Path, error: PddlError| {
                let message = anyhow::anyhow!("{}: {error}", path.display());
                Failure::new(Exit::Unreadable, message)
            };
            let read = read_domain(&input::text(domain)?);
            let known = read.map_err(|error| unreadable(domain, error))?;
            let read = read_problem(&input::text(problem)?);
            let asked = read.map_err(|error| unreadable(problem, error))?;
            let done = simulate(&known, &asked, &steps);
            return Ok(done.map_err(|failure| (count, failure.to_string())));
        }
        let table = action_table(self.actions.as_deref())?;
        let unknown = steps.iter().find_map(|step| {
            let message = table.knows(step).err()?;
            Some(format!("line {}: {message}", step.line))
        });
        Ok(unknown.map_or(Ok(count), |message| Err((count, message))))
    }

    fn print_json(&self, source: &str, plan: &Plan, findings: &[Finding]) -> io::Result<()> {
        let file = self.plan.display().to_string();
        let list: Vec<_> = findings.iter().map(|f| f.to_json(&file, source)).collect();
        let of = |severity| findings.iter().filter(|f| f.severity == severity).count();
        output::json(&serde_json::json!({
            "requirements": plan.requirements.len(),
            "parameters": plan.parameters.len(),
            "variables": plan.variables.len(),
            "statements": plan.statements().len(),
            "errors": of(Severity::Error),
            "warnings": of(Severity::Warning),
            "notes": of(Severity::Note),
            "findings": list,
        }))
    }

    fn print(&self, source: &str, plan: &Plan, findings: &[Finding]) -> io::Result<()> {
        let file = self.plan.display().to_string();
        let mut out = io::stdout().lock();
        for finding in findings {
            writeln!(out, "{:?}", finding.report(&file, source))?;
        }
        let of = |severity| findings.iter().filter(|f| f.severity == severity).count();
        let counts = [
            (plan.requirements.len(), "requirement"),
            (plan.parameters.len(), "parameter"),
            (plan.variables.len(), "variable"),
            (plan.statements().len(), "statement"),
            (of(Severity::Error), "error"),
            (of(Severity::Warning), "warning"),
            (of(Severity::Note), "note"),
        ];
        let counts = counts.map(|(count, name)| counted(count, name));
        writeln!(
            out,
            "{}; {}",
            counts[..4].join(", "),
            counts[4..].join(", ")
        )
    }
}

/// Prints the plan in another form, which reads as the same plan.
fn convert(plan: &Plan, form: Form) -> io::Result<()> {
    match form {
        Form::Block => io::stdout().lock().write_all(write(plan).as_bytes()),
        Form::Json => output::json(plan),
    }
}
