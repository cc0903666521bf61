use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use plan::finding::{Finding, Severity, has_errors};
use plan::kitting::{Plan, check, read};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::{output, world_file};

/// Check a kitting process plan without executing it
///
/// Reads the outline layout, the block layout and JSON. With a world also checks that what the plan
/// requires is there.
#[derive(Args, Debug)]
pub(crate) struct PlanCheck {
    /// The plan
    plan: PathBuf,
    /// Database, or workstation file (.toml, .json, .xml)
    #[arg(long, value_name = "WORLD")]
    world: Option<PathBuf>,
    /// Print counts and findings as JSON
    #[arg(long)]
    json: bool,
}

impl PlanCheck {
    /// Reads and checks the plan.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let source = world_file::read(&self.plan)?;
        let world = self.world.as_deref().map(world_file::load).transpose()?;
        let reading = read(&source);
        let mut findings = reading.findings;
        if !has_errors(&findings) {
            findings.extend(check(&reading.plan, world.as_ref()));
            findings.sort_by_key(|finding| finding.span.start);
        }
        if self.json {
            self.print_json(&source, &reading.plan, &findings)?;
        } else {
            self.print(&source, &reading.plan, &findings)?;
        }
        Ok(if has_errors(&findings) {
            Exit::Refused
        } else {
            Exit::Done
        })
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
        writeln!(
            out,
            "{} requirements, {} parameters, {} variables, {} statements; {} errors, {} warnings, {} notes",
            plan.requirements.len(),
            plan.parameters.len(),
            plan.variables.len(),
            plan.statements().len(),
            of(Severity::Error),
            of(Severity::Warning),
            of(Severity::Note),
        )
    }
}
