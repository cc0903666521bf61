//! Reading and writing plans.

use std::collections::BTreeMap;

use plan::finding::Severity;
use plan::kitting::{read, write};

use crate::fixtures::{data, repository_text};

/// A plan in the outline layout with everything in it that the reader puts up with: sections,
/// statements by name.
#[test]
fn the_outline_layout_is_read() {
    let text = data("odd.plan");
    let text = &text[text.rfind("-----").unwrap() + 5..];
    let reading = read(text);
    let plan = &reading.plan;
    let shown: Vec<String> = reading
        .findings
        .iter()
        .map(|f| format!("{:?} {} {:?}", f.position(text), f.message, f.severity))
        .collect();
    assert!(
        reading
            .findings
            .iter()
            .all(|f| f.severity == Severity::Warning),
        "{shown:#?}"
    );
    assert_eq!(plan.about("PlanId"), "odd");
    assert_eq!(plan.requirements.len(), 3);
    assert_eq!(plan.parameters.len(), 1);
    assert_eq!(plan.variables.len(), 10);
    let mut names = BTreeMap::new();
    for statement in plan.statements() {
        *names.entry(statement.action.name()).or_insert(0) += 1;
    }
    let expected = [
        ("Set", 5),
        ("If", 5),
        ("DoInGivenOrder", 2),
        ("Bind", 3),
        ("RobotChangeEndEffector", 2),
        ("RobotMoveAbove", 2),
        ("RobotPickUp", 2),
        ("RobotPutDown", 2),
        ("FactotumReplace", 2),
        ("Quit", 1),
        ("SetPose", 1),
        ("CreateInstance", 1),
        ("DestroyInstance", 1),
        ("FactotumRemove", 1),
        ("FactotumRefill", 1),
        ("DoInAnyOrder", 1),
        ("LoopInGivenOrderWhile", 1),
        ("Start", 1),
        ("Stop", 1),
    ];
    assert_eq!(names, expected.into_iter().collect());
}

/// Outline, block layout and JSON are the same plan: writing and reading changes nothing.
#[test]
fn layouts_agree() {
    let odd = data("odd.plan");
    let odd = odd[odd.rfind("-----").unwrap() + 5..].to_owned();
    for text in [odd, repository_text("examples/kitting/kit-abc.plan")] {
        let plan = read(&text).plan;
        let written = write(&plan);
        assert!(written.contains("begin"), "the block layout:\n{written}");
        let again = read(&written);
        assert!(again.findings.is_empty(), "{:?}\n{written}", again.findings);
        assert_eq!(again.plan, plan);
        let json = serde_json::to_string(&plan).unwrap();
        assert_eq!(read(&json).plan, plan);
    }
}

/// Reading and checking a careless plan finds each carelessness, and nothing else.
#[test]
fn oddities_are_found() {
    let text = data("odd.plan");
    let reading = read(&text[text.rfind("-----").unwrap() + 5..]);
    let world = repository_text("examples/kitting/workstation.toml");
    let world = plan::world::import_toml(&world).unwrap();
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
        ("plan::single_equal", 2),
        ("plan::object_and_text", 1),
    ];
    assert_eq!(codes, expected.into_iter().collect());
}
