//! Reading and writing plans.

use std::collections::BTreeMap;

use plan::finding::Severity;
use plan::kitting::{read, write};

use crate::fixtures::shared_text;

/// The plan of the original document, from its dashed line to the end.
pub(crate) fn document_plan() -> Option<String> {
    let text = shared_text("spec/seeds/kitting-process-plan.txt")?;
    let dashes = text.find("-----").unwrap();
    let end = dashes + text[dashes..].find('\n').unwrap();
    Some(text[end..].to_owned())
}

/// The document's plan as it stands: sections, statements by name, and its oddities.
#[test]
fn the_document_is_read_unchanged() {
    let Some(text) = document_plan() else { return };
    let reading = read(&text);
    let plan = &reading.plan;
    let shown: Vec<String> = reading
        .findings
        .iter()
        .map(|f| format!("{:?} {} {:?}", f.position(&text), f.message, f.severity))
        .collect();
    assert!(
        reading
            .findings
            .iter()
            .all(|f| f.severity == Severity::Warning),
        "{shown:#?}"
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
#[test]
fn layouts_agree() {
    let Some(text) = document_plan() else { return };
    let plan = read(&text).plan;
    let block = shared_text("data/nist/process-plan/kitABCPlan.normalised.plan").unwrap();
    let other = read(&block);
    assert!(other.findings.is_empty(), "{:?}", other.findings);
    assert_eq!(plan.todo, other.plan.todo);
    assert_eq!(plan.about, other.plan.about);
    assert_eq!(plan.requirements, other.plan.requirements);
    let written = write(&plan);
    let again = read(&written);
    assert!(again.findings.is_empty(), "{:?}\n{written}", again.findings);
    assert_eq!(again.plan, plan);
    let json = serde_json::to_string(&plan).unwrap();
    assert_eq!(read(&json).plan, plan);
}

/// Reading and checking the document's plan finds its known oddities, and nothing else.
#[test]
fn the_documents_oddities_are_found() {
    let Some(text) = document_plan() else { return };
    let reading = read(&text);
    let world = plan::world::import_toml(&crate::fixtures::repository_text(
        "examples/kitting/workstation-kitABCPlan.toml",
    ))
    .unwrap();
    let mut findings = reading.findings;
    findings.extend(plan::kitting::check(&reading.plan, Some(&world)));
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
