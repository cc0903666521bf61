//! Single statements and expressions, each in a small plan.

use plan::kitting::read;
use plan::run::Event;
use plan::world::Scalar;

use crate::running::{Result, Trial};

const HEAD: &str = "About PlanId = \"p\" PlanWorkstation = \"workstation1\" TargetSKU = \"kitABC\"
PlanRequirements
  item name = \"trays\" type = \"LargeContainer\" SkuRef = \"Box1\" contentsType = \"SkuRef KitTrayX\" location = WORKSTATION end
PlanParameters item name = \"NumberOfKitsToMake\" type = \"positiveInteger\" end
InternalVariables
  item name = \"Box\" type = \"LargeContainer\" requirement = \"trays\" end
  item name = \"Tray\" type = \"KitTray\" end
  item name = \"Kit\" type = \"KitInstance\" end
  item name = \"Place\" type = \"Pose\" end
  item name = \"n\" type = \"integer\" initialValue = 0 end
  item name = \"m\" type = \"integer\" initialValue = 0 end
ToDo
  Start()
  Bind(Box, WORKSTATION, ANY, QUIT)
";

/// Statements of a body, one per line; the result is what was executed.
fn run(body: &str) -> Result {
    let source = format!("{HEAD}{body}\nStop()\n");
    Trial::new(&source, "examples/kitting/workstation.toml", 3).run()
}

/// Runs a body that must come to its end.
fn good(body: &str) -> Result {
    let result = run(body);
    let report = &result.report;
    assert_eq!(
        (report.outcome, report.code),
        ("stopped", 0),
        "{body}: {report:#?}"
    );
    result
}

/// Lines of the body (from 1) that were executed.
fn lines(result: &Result) -> Vec<usize> {
    let before = HEAD.lines().count();
    let line = |event: &Event| match event {
        Event::Statement { line, .. } => line.checked_sub(before).filter(|line| *line > 0),
        _ => None,
    };
    result.events.iter().filter_map(line).collect()
}

fn above(x: i32, y: i32) -> String {
    format!("RobotMoveAbove(Pose(Point({x}, {y}, 0), RollPitchYaw(0, 0, 0), WORKSTATION))")
}

/// The body is executed when the condition is true, and only then.
fn holds(condition: &str) -> bool {
    !lines(&good(&format!("If {{{condition}}}\nSet(m, 1)"))).is_empty()
}

/// Of If, ElseIf and Else one is executed, also as one step of a list without order.
#[test]
fn one_branch_of_a_choice_is_taken() {
    let chain = "If {n == 0}\nSet(m, 10)\nElseIf {n == 1}\nSet(m, 11)\nElse\nSet(m, 12)";
    for (value, line) in [(0, 3), (1, 5), (2, 7)] {
        let result = good(&format!("Set(n, {value})\n{chain}"));
        assert_eq!(lines(&result), [1, line]);
        let listed = format!("DoInAnyOrder begin\n{chain}\nSet(Place, Null)\nend");
        let result = good(&format!("Set(n, {value})\n{listed}"));
        assert_eq!(lines(&result).len(), 3, "{value}: {:?}", lines(&result));
        assert!(lines(&result).contains(&(line + 1)));
    }
}

/// The outline layout has the same choices.
#[test]
fn choices_in_the_outline_layout() {
    let todo = "5. ToDo\n 5.1 Start()\n 5.2 If {NumberOfKitsToMake == 1} Set(n, 1)\n 5.3 ElseIf {NumberOfKitsToMake == 3}\n DoInGivenOrder\n 5.3.1 Set(n, 2)\n 5.3.2 Set(m, 2)\n 5.4 Else Quit()\n 5.5 Stop\n";
    let (head, _) = HEAD.split_once("ToDo").unwrap();
    let outline = read(&format!("{head}{todo}"));
    let block = read(&format!(
        "{head}ToDo Start() If {{NumberOfKitsToMake == 1}} Set(n, 1) ElseIf {{NumberOfKitsToMake == 3}} DoInGivenOrder begin Set(n, 2) Set(m, 2) end Else Quit() Stop"
    ));
    assert!(block.findings.is_empty(), "{:?}", block.findings);
    assert!(outline.findings.is_empty(), "{:?}", outline.findings);
    assert_eq!(outline.plan.todo, block.plan.todo);
    assert_eq!(outline.plan.todo.len(), 5);
}

/// DoOne executes one of its statements: the one that is over first.
#[test]
fn one_of_a_list_is_done() {
    let body = format!(
        "DoOne begin\n{}\n{}\n{}\nend",
        above(600, 300),
        above(350, 20),
        above(600, -300)
    );
    assert_eq!(lines(&good(&body)), [3]);
}

/// Loops test before each pass, and passes do not overlap.
#[test]
fn loops_pass_by_pass() {
    for name in ["LoopInGivenOrderWhile", "LoopInAnyOrderWhile"] {
        let body = format!("{name} {{n < 3}} begin\nSet(n, n + 1)\nSet(m, m + 10)\nend");
        assert_eq!(lines(&good(&body)), [2, 3, 2, 3, 2, 3], "{name}");
        let never = format!("{name} {{n < 0}} begin\nSet(n, n + 1)\nend");
        assert!(lines(&good(&never)).is_empty());
        let idle = run(&format!(
            "{name} {{n < 3}} begin\nIf {{n == 7}} Quit()\nend"
        ))
        .report;
        assert_eq!((idle.outcome, idle.code), ("failed", 2), "{idle:#?}");
    }
    let far_and_near = format!("{}\n{}", above(600, 300), above(350, 20));
    let body = format!("LoopInAnyOrderWhile {{n < 2}} begin\n{far_and_near}\nSet(n, n + 1)\nend");
    let done = lines(&good(&body));
    for pass in done.chunks(3) {
        let mut pass = pass.to_vec();
        pass.sort_unstable();
        assert_eq!(pass, [2, 3, 4], "{done:?}");
    }
}

/// Stop ends a plan well and Quit badly, wherever they stand.
#[test]
fn plans_end_where_they_say() {
    let result = good("If {true}\nStop()\nSet(n, 1)");
    assert_eq!(lines(&result), Vec::<usize>::new());
    let report = run("If {true}\nQuit()\nSet(n, 1)").report;
    assert_eq!((report.outcome, report.code), ("failed", 1), "{report:#?}");
}

/// Operators bind as they do in C.
#[test]
fn expressions_have_values() {
    let truths = [
        "1 + 2 * 3 == 7",
        "(1 + 2) * 3 == 9",
        "7 % 4 - 3 == 0",
        "-2 + 2 == 0 && !(1 == 2)",
        "1 == 2 || 2 <= 2",
        "1 == 2 && 1 == 2 || 1 == 1",
        "9 / 3 >= 3",
        "3 > 2 == true",
        "Robot.hasRobot_Id == \"Robot1\"",
        "Robot.hasRobot_EndEffector == Null",
        "Contains(Box, KitTrayX, 1) == 12",
        "Contains(WORKSTATION, KitTrayX, 1) == 0",
        "Contains(WORKSTATION, KitTrayX, 2) == 12",
        "Box.hasSolidObject_PhysicalLocation.hasPhysicalLocation_RefObject == WORKSTATION",
        "Box.hasSolidObject_PhysicalLocation.hasPose_Point.hasPoint_Z == 0",
        "GetFirst(Box.trays).hasKitTray_SkuRef == \"KitTrayX\"",
        "GetTop(Box.trays) != GetFirst(Box.trays)",
        "WORKSTATION.hasWorkstation_LengthUnit == \"mm\"",
    ];
    for condition in truths {
        assert!(holds(condition), "{condition}");
        assert!(!holds(&format!("!({condition})")), "!({condition})");
    }
    let report = run("Set(n, 1 / (n - n))").report;
    assert_eq!((report.outcome, report.code), ("failed", 2), "{report:#?}");
}

/// A property that is set is in the world afterwards; a pose is given another reference.
#[test]
fn values_are_set() {
    let result = good(
        "Set(Box.hasLargeContainer_Capacity, 20)\nSetPose(Place, ROBOT, GetFreePose(Box, GetTop(Box.trays)))\nIf {Place.hasPhysicalLocation_RefObject != Robot} Quit()",
    );
    let set = |name: &str| {
        let object = result.world.named(name).unwrap();
        object.properties.get("hasLargeContainer_Capacity").cloned()
    };
    assert_eq!(set("BoxOfTrays"), Some(Scalar::Number(20.0)));
    assert_eq!(set("BoxOfKits"), Some(Scalar::Number(12.0)));
}

/// A kit is created round a tray and destroyed again; the tray is where it was.
#[test]
fn instances_come_and_go() {
    let tray = "Set(Tray, GetTop(Box.trays))\nCreateInstance(Kit, Tray, \"hasKitInstance_Tray\")\nIf {Contains(Box, KitTrayX, 1) != 11 || Contains(Box, kitABC, 1) != 1 || Kit.hasKitInstance_Tray != Tray} Quit()";
    let with = good(tray).world;
    let kit = with
        .objects()
        .find(|o| o.name.starts_with("KitInstance"))
        .unwrap();
    let body = format!(
        "{tray}\nDestroyInstance(Kit)\nIf {{Kit != Null || Contains(Box, KitTrayX, 1) != 12}} Quit()"
    );
    let without = good(&body).world;
    let tray = with.children(kit.id).next().unwrap();
    let (then, now) = (
        with.workstation_from(tray.id).unwrap(),
        without.workstation_from(tray.id).unwrap(),
    );
    assert!((then.translation.vector - now.translation.vector).norm() < 1e-12);
    assert!(without.object(kit.id).is_err());
}
