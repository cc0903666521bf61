//! Thirty wrong plans and the findings about each.

use plan::finding::Severity;
use plan::kitting::{check, read};
use plan::world::import_toml;

use crate::fixtures::repository_text;

const GOOD: &str = r#"About
  PlanId = "small"
  PlanWorkstation = "workstation1"
  TargetSKU = "kitABC"
PlanRequirements
  item
    name = "trays"
    type = "LargeContainer"
    SkuRef = "Box1"
    contentsType = "SkuRef KitTrayX"
    contentsQuantity = 12
    location = WORKSTATION
  end
PlanParameters
  item name = "Count" type = "positiveInteger" end
InternalVariables
  item name = "Trays" type = "LargeContainer" requirement = "trays" end
  item name = "Tray" type = "KitTray" SkuRef = "KitTrayX" end
  item name = "Kit" type = "KitInstance" end
  item name = "Place" type = "Pose" end
  item name = "n" type = "integer" initialValue = 0 end
ToDo
  Start()
  Bind(Trays, WORKSTATION, ANY, QUIT)
  LoopInGivenOrderWhile {n < Count} begin
    Set(Tray, GetTop(Trays.trays))
    SetPose(Place, ROBOT, Tray.hasSolidObject_PhysicalLocation)
    RobotMoveAbove(Place)
    If {n == 0}
      RobotChangeEndEffector("TrayGripper")
    Else
      RobotPickUp(Tray)
    Set(n, n + 1)
  end
  Stop()
"#;

/// Each: what is replaced in the good plan, and by what.
const BAD: [(&str, &str); 34] = [
    ("  Start()\n", ""),
    ("  Stop()\n", ""),
    ("Set(n, n + 1)", "Set(n, n + )"),
    ("Set(n, n + 1)", "Set(n n + 1)"),
    ("Set(n, n + 1)", "Set(n, m + 1)"),
    ("Set(n, n + 1)", "Set(n, \"one\")"),
    ("Set(n, n + 1)", "Set(Count, n + 1)"),
    ("Set(n, n + 1)", "Sett(n, n + 1)"),
    ("Set(n, n + 1)", "Set(n)"),
    ("Set(n, n + 1)", "Set(n, Contains(Trays, KitTrayY, 1))"),
    ("Set(n, n + 1)", "Set(n, Contains(Trays, KitTrayX))"),
    ("Set(n, n + 1)", "Set(n, Count(Trays))"),
    ("Set(n, n + 1)", "Set(n, Tray.hasBox_Weight)"),
    ("Set(n, n + 1)", "Set(Tray.trays, 1)"),
    ("Set(n, n + 1)", "Else Quit()"),
    ("Set(n, n + 1)", "Start()"),
    ("Set(n, n + 1)", "DoInAnyOrder begin end"),
    (
        "Set(n, n + 1)",
        "DoInPreconditionOrder begin (1 (2) Quit()) (2 (1) Quit()) end",
    ),
    (
        "Set(n, n + 1)",
        "DoInPreconditionOrder begin (1 (3) Quit()) (1 () Quit()) end",
    ),
    (
        "Set(n, n + 1)",
        "CreateInstance(Kit, Trays, \"hasKitInstance_Tray\")",
    ),
    (
        "Set(n, n + 1)",
        "CreateInstance(Kit, Tray, \"hasKitInstance_Box\")",
    ),
    ("Set(n, n + 1)", "FactotumRefill(Tray)"),
    ("Set(n, n + 1)", "SetPose(n, ROBOT, Place)"),
    ("{n < Count}", "{n + Count}"),
    ("{n < Count}", "n < Count"),
    ("{n < Count}", "{n < Count"),
    (
        "Bind(Trays, WORKSTATION, ANY, QUIT)",
        "Bind(Trays, ROOM, ANY, QUIT)",
    ),
    (
        "Bind(Trays, WORKSTATION, ANY, QUIT)",
        "Bind(Tray, WORKSTATION, ANY, QUIT)",
    ),
    (
        "RobotChangeEndEffector(\"TrayGripper\")",
        "RobotChangeEndEffector(\"Hook\")",
    ),
    ("type = \"KitTray\"", "type = \"Tray\""),
    ("requirement = \"trays\"", "requirement = \"boxes\""),
    ("contentsQuantity = 12", "contentsQuantity = 13"),
    ("name = \"Kit\"", "name = \"tray\""),
    (
        "PlanWorkstation = \"workstation1\"",
        "PlanWorkstation = \"elsewhere",
    ),
];

/// The good plan is good, and each bad one is refused for the right reason at the right place.
#[test]
fn bad_plans_are_refused() {
    let world = import_toml(&repository_text("examples/kitting/workstation.toml")).unwrap();
    let mut said = String::new();
    for (from, to) in [("", "")].into_iter().chain(BAD) {
        assert!(from.is_empty() || GOOD.contains(from), "{from}");
        let source = GOOD.replacen(from, to, 1);
        let reading = read(&source);
        let mut findings = reading.findings;
        if findings.is_empty() {
            findings = check(&reading.plan, Some(&world));
        }
        said.push_str(&format!("{from:?} -> {to:?}\n"));
        assert!(
            from.is_empty() || findings.iter().any(|f| f.severity == Severity::Error),
            "{to}"
        );
        for finding in &findings {
            let (line, column) = finding.position(&source);
            let help = finding
                .help
                .as_ref()
                .map(|help| format!(" ({help})"))
                .unwrap_or_default();
            let (severity, code) = (finding.severity, finding.code);
            said.push_str(&format!(
                "  {line}:{column} {severity:?} {code}: {}{help}\n",
                finding.message
            ));
        }
    }
    expect_test::expect_file!["../data/bad_plans.txt"].assert_eq(&said);
}

/// A finding is shown with file, line and caret.
#[test]
fn findings_point_into_the_text() {
    let source = GOOD.replace("Set(n, n + 1)", "Set(n, m + 1)");
    let findings = check(&read(&source).plan, None);
    let shown = format!("{:?}", findings[0].report("small.plan", &source));
    assert!(
        shown.contains("small.plan:33:12") && shown.contains("plan::unknown_name"),
        "{shown}"
    );
}
