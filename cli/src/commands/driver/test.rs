use std::io::{self, Write};
use std::time::Duration;

use clap::Args;
use driver_conformance::{Clause, Verdict, test_driver};
use ipc::{EngineLink, IpcError};
use serde_json::json;

use crate::client::{ArmOption, HANG};
use crate::damage;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// How long the driver may take to send its number of joints.
const LOOK: Duration = Duration::from_secs(3);

/// After this time the test counts as blocked by damaged segments; a slow driver takes half of it.
const LONGEST: Duration = Duration::from_secs(60);

/// Test a running driver against the driver protocol
///
/// Plays the engine and prints one result per clause of docs/driver-protocol.md. The joints move by
/// a few hundredths of a rad, and the gripper closes and opens: keep away from a real arm. Takes
/// about ten seconds; the exit code is 1 when a clause fails.
#[derive(Args, Debug)]
pub(super) struct Test {
    #[command(flatten)]
    arm: ArmOption,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Test {
    /// Tests all clauses.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let arm = self.arm.open()?;
        // A first check, so that damaged shared memory is reported soon.
        damage::bounded(HANG, || {
            EngineLink::open(&arm).and_then(|link| link.joints(LOOK))
        })
        .map_err(failure)?;
        let report = damage::bounded(LONGEST, || test_driver(&arm)).map_err(failure)?;
        let count = |verdict| {
            let found = |clause: &&Clause| clause.verdict == verdict;
            report.clauses.iter().filter(found).count()
        };
        let [passed, failed, skipped] = [Verdict::Pass, Verdict::Fail, Verdict::Skip].map(count);
        if self.json {
            output::json(&json!({
                "arm": arm.to_string(),
                "driver": report.driver,
                "joints": report.joints,
                "passed": passed,
                "failed": failed,
                "skipped": skipped,
                "clauses": report.clauses,
            }))?;
        } else {
            let mut out = io::stdout().lock();
            for clause in &report.clauses {
                let verdict = match clause.verdict {
                    Verdict::Pass => "pass",
                    Verdict::Fail => "FAIL",
                    Verdict::Skip => "skip",
                };
                writeln!(out, "{verdict}  {:46} {}", clause.name, clause.seen)?;
            }
            writeln!(
                out,
                "driver {} of {} joints: {passed} passed, {failed} failed, {skipped} skipped",
                report.driver, report.joints
            )?;
        }
        Ok(if failed == 0 {
            Exit::Done
        } else {
            Exit::Refused
        })
    }
}

/// A driver that cannot be tested: absent, or driven by an engine.
fn failure(error: IpcError) -> Failure {
    match error {
        IpcError::Refused { .. } => Failure::new(Exit::Refused, error),
        other => other.into(),
    }
}
