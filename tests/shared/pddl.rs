//! NIST's PDDL domains, problems and plans.

use plan::pddl::{Failure, read_domain, read_plan, read_problem, simulate};
use serde_json::Value;

use crate::canter::canter;

const G1: &str = "g1-2012-06";
const G3: &str = "g2g3-2013-2014";

fn run(domain: &str, problem: &str, plan: &str) -> Result<usize, Failure> {
    let text = |path: &str| crate::text(&format!("data/nist/pddl/{path}"));
    let domain = read_domain(&text(domain)).unwrap();
    let problem = read_problem(&text(problem)).unwrap();
    let plan = read_plan(&text(plan)).unwrap();
    simulate(&domain, &problem, &plan)
}

/// Plans that reach their goal.
pub(crate) fn good_plans_reach_their_goal() {
    let (problem, plan) = (
        format!("{G1}/kitting-problem.pddl"),
        format!("{G1}/kitting-plan.txt"),
    );
    for number in 0..2 {
        let domain = format!("{G1}/kitting-domain_{number}.pddl");
        assert_eq!(run(&domain, &problem, &plan), Ok(18), "{domain}");
    }
    let old = "g2g3-2013-2014/a2b1c1/old";
    let result = run(
        &format!("{old}/kitting-domain.pddl"),
        &format!("{old}/kitting-problem_a2b1c1.pddl"),
        &format!("{old}/plan_a2b1c1.txt"),
    );
    assert_eq!(result, Ok(18));
    let result = run(
        &format!("{G3}/domain-kitting.pddl"),
        &format!("{G3}/a2b1c1/problem-a2b1c1.pddl"),
        &format!("{G3}/a2b1c1/pddlplan_a2b1c1.txt"),
    );
    assert_eq!(result, Ok(21));
}

/// Plans that do not fit their domain or problem fail at the right step.
pub(crate) fn bad_plans_fail_where_they_should() {
    let g1 = |domain: &str| {
        (
            format!("{G1}/{domain}"),
            format!("{G1}/kitting-problem.pddl"),
            format!("{G1}/kitting-plan.txt"),
        )
    };
    let cases = [
        g1("kitting-domain_2.pddl"),
        g1("kitting-domain_3.pddl"),
        (
            format!("{G3}/domain-kitting.pddl"),
            format!("{G3}/a2b1c1/problem-a2b1c1.pddl"),
            format!("{G3}/a2b1c1/plan_a2b1c1.txt"),
        ),
        (
            format!("{G3}/domain-fluents.pddl"),
            format!("{G3}/a2b1c1/problem-fluents-a2b1c1.pddl"),
            format!("{G3}/a2b1c1/plan_a2b1c1.txt.1"),
        ),
        (
            "aprs/domain-mini-demo.pddl".into(),
            "aprs/problem-mini-demo.pddl".into(),
            "aprs/minidemo_pddl_actions.txt".into(),
        ),
    ];
    let mut messages = String::new();
    for (domain, problem, plan) in cases {
        let failure = run(&domain, &problem, &plan).unwrap_err();
        messages.push_str(&format!("{plan} in {domain}: {failure}\n"));
    }
    expect_test::expect![[r#"
        g1-2012-06/kitting-plan.txt in g1-2012-06/kitting-domain_2.pddl: step 2, (take-kit-tray robot_1 kit_tray_1 empty_kit_tray_supply tray_gripper work_table_1): the domain has no action take-kit-tray
        g1-2012-06/kitting-plan.txt in g1-2012-06/kitting-domain_3.pddl: step 2, (take-kit-tray robot_1 kit_tray_1 empty_kit_tray_supply tray_gripper work_table_1): the domain has no action take-kit-tray
        g2g3-2013-2014/a2b1c1/plan_a2b1c1.txt in g2g3-2013-2014/domain-kitting.pddl: step 1, (attach-endeffector robot_1 tray_gripper tray_gripper_holder changing_station_1): the precondition (endeffectorholder-has-endeffector tray_gripper_holder tray_gripper) is false
        g2g3-2013-2014/a2b1c1/plan_a2b1c1.txt.1 in g2g3-2013-2014/domain-fluents.pddl: step 8, (take-part robot_1 part_c_1 part_c_tray part_gripper work_table_1 kit_a2b1c1): take-part takes 4 objects, not 6
        aprs/minidemo_pddl_actions.txt in aprs/domain-mini-demo.pddl: step 1, (look-for-part robot_1 large_gear_1 sku_part_large_gear kit_s2b2 part_gripper): the effect (increase (grasp-set-flag) 1) has no result: (grasp-set-flag) has no value
    "#]].assert_eq(&messages);
}

/// `canter plan-check` says the same: to the goal, or to the precondition that is false.
pub(crate) fn verdicts_of_the_command_line() {
    let file = |name: &str| {
        let path = crate::path("data/nist/pddl/g1-2012-06").join(name);
        path.to_str().unwrap().to_owned()
    };
    let (plan, problem) = (file("kitting-plan.txt"), file("kitting-problem.pddl"));
    for (domain, reached) in [("0", true), ("1", true), ("2", false), ("3", false)] {
        let domain = file(&format!("kitting-domain_{domain}.pddl"));
        let given = ["--domain", &domain, "--problem", &problem, "--json"];
        let ran = canter(["plan-check", &plan].iter().chain(&given));
        let verdict: Value = serde_json::from_str(&ran.stdout).unwrap();
        assert_eq!(verdict["goal_reached"], reached, "{verdict}");
        assert_eq!(ran.code, i32::from(!reached));
        let reason = verdict["reason"].as_str().unwrap_or_default();
        let step = reason.contains("step 2, (take-kit-tray");
        assert_eq!(step, !reached, "{reason}");
    }
}

/// `canter plan-run` executes the plan of June 2012 with the simulated driver, in lock-step.
pub(crate) fn the_plan_of_june_2012_runs_on_the_arm() {
    let plan = crate::path("data/nist/pddl/g1-2012-06/kitting-plan.txt");
    let arm = format!("shared{}/pddl", std::process::id());
    let world = "examples/kitting/workstation-pddl.toml";
    let start = [
        "plan-run",
        plan.to_str().unwrap(),
        "--world",
        world,
        "--json",
    ];
    let end = [
        "--lock-step",
        "--speed",
        "100",
        "--robot",
        "ur5e",
        "--arm",
        &arm,
    ];
    let ran = canter(start.iter().chain(&end));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["statements"], 18, "{report}");
    assert_eq!(report["kits"], 1, "{report}");
}
