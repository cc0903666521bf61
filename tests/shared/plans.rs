//! The kitting plan of the original document.

use std::collections::BTreeMap;
use std::path::Path;

use plan::finding::Severity;
use plan::kitting::{check, read, write};
use serde_json::Value;

use crate::canter::canter;

const WORLD: &str = "examples/kitting/workstation-kitABCPlan.toml";

/// The plan, from below its dashed line to the end of the document, unchanged.
fn document() -> String {
    let text = crate::text("spec/seeds/kitting-process-plan.txt");
    let dashes = text.find("-----").unwrap();
    let end = dashes + text[dashes..].find('\n').unwrap();
    text[end..].to_owned()
}

fn written(folder: &Path) -> String {
    let plan = folder.join("document.plan");
    std::fs::write(&plan, document()).unwrap();
    plan.to_str().unwrap().to_owned()
}

/// The document's plan as it stands: sections, statements by name, and its oddities.
pub(crate) fn the_document_is_read_unchanged() {
    let reading = read(&document());
    let plan = &reading.plan;
    let warnings = |f: &plan::finding::Finding| f.severity == Severity::Warning;
    assert!(
        reading.findings.iter().all(warnings),
        "{:#?}",
        reading.findings
    );
    assert_eq!(plan.requirements.len(), 5);
    assert_eq!(plan.parameters.len(), 1);
    assert_eq!(plan.variables.len(), 17);
    assert_eq!(plan.statements().len(), 97);
    let mut names = BTreeMap::new();
    for statement in plan.statements() {
        *names.entry(statement.action.name()).or_insert(0) += 1;
    }
    let expected = [
        ("If", 13),
        ("RobotMoveAbove", 12),
        ("Set", 11),
        ("SetPose", 11),
        ("DoInGivenOrder", 8),
        ("RobotPickUp", 6),
        ("RobotPutDown", 6),
        ("Quit", 6),
        ("Bind", 5),
        ("FactotumReplace", 4),
        ("RobotChangeEndEffector", 3),
        ("DoInAnyOrder", 2),
        ("DestroyInstance", 2),
        ("FactotumRemove", 2),
        ("FactotumRefill", 2),
        ("Start", 1),
        ("Stop", 1),
        ("LoopInGivenOrderWhile", 1),
        ("CreateInstance", 1),
    ];
    assert_eq!(names, expected.into_iter().collect());
}

/// The block layout of the document's plan is the same plan; writing and reading changes nothing.
pub(crate) fn layouts_agree() {
    let plan = read(&document()).plan;
    let block = crate::text("data/nist/process-plan/kitABCPlan.normalised.plan");
    let other = read(&block);
    assert!(other.findings.is_empty(), "{:?}", other.findings);
    assert_eq!(plan.todo, other.plan.todo);
    assert_eq!(plan.about, other.plan.about);
    assert_eq!(plan.requirements, other.plan.requirements);
    let again = read(&write(&plan));
    assert!(again.findings.is_empty(), "{:?}", again.findings);
    assert_eq!(again.plan, plan);
}

/// Reading and checking the document's plan finds its known oddities, and nothing else.
pub(crate) fn the_documents_oddities_are_found() {
    let reading = read(&document());
    let world = std::fs::read_to_string(system_tests::repository::root().join(WORLD)).unwrap();
    let world = plan::world::import_toml(&world).unwrap();
    let mut findings = reading.findings;
    findings.extend(check(&reading.plan, Some(&world)));
    let mut codes = BTreeMap::new();
    for finding in findings.iter().filter(|f| f.severity != Severity::Note) {
        assert_eq!(finding.severity, Severity::Warning, "{finding:?}");
        *codes.entry(finding.code).or_insert(0) += 1;
    }
    let expected = [
        ("plan::label", 1),
        ("plan::capitals", 1),
        ("plan::unquoted_type", 3),
        ("plan::parentheses", 2),
        ("plan::quoted_name", 2),
        ("plan::single_equal", 3),
        ("plan::object_and_text", 1),
    ];
    assert_eq!(codes, expected.into_iter().collect(), "13 warnings");
}

/// `canter plan-check` counts the same.
pub(crate) fn the_documents_plan_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let plan = written(folder.path());
    let ran = canter(["plan-check", &plan, "--json", "--world", WORLD]);
    let found: Value = serde_json::from_str(&ran.stdout).unwrap();
    let names = [
        "requirements",
        "parameters",
        "variables",
        "statements",
        "warnings",
        "errors",
    ];
    let counts = names.map(|name| found[name].as_u64().unwrap());
    assert_eq!(counts, [5, 1, 17, 97, 13, 0], "{found}");
    assert_eq!(ran.code, 0);
}

/// `canter plan-run --dry-run` makes three kits.
pub(crate) fn the_documents_plan_makes_three_kits_in_thought() {
    let folder = tempfile::tempdir().unwrap();
    let plan = written(folder.path());
    let start = ["plan-run", &plan, "--world", WORLD, "--json", "--dry-run"];
    let end = ["--robot", "ur5e", "--set", "NumberOfKitsToMake=3"];
    let ran = canter(start.iter().chain(&end));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let names = ["pick_ups", "put_downs", "moves_above", "kits"];
    let counts = names.map(|name| report[name].as_u64().unwrap());
    assert_eq!(counts, [18, 18, 36, 3], "{report}");
    assert_eq!(report["outcome"], "stopped");
    // The document puts each kit at the bottom of the box; the executor puts it on top and says so.
    assert!(
        report["warnings"]
            .to_string()
            .contains("on top of what is in"),
        "{report}"
    );
}
