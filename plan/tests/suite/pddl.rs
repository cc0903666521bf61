//! PDDL plans: simulated and executed.

use std::path::{Path, PathBuf};

use plan::interp::{Code, CommandSink, PddlInterpreter, PlanInterpreter, Pull, PulledRun, pull};
use plan::pddl::{ActionTable, Failure, read_domain, read_plan, read_problem, simulate};
use plan::run::{PlanRunReport, RobotOptions, SimulatedMotion};
use plan::world::{Class, Durability, Model, Writer, import_toml};

use crate::fixtures::repository_text;
use crate::running::{assert_consistent, read_world};

/// Domain, problem and plan of the example, with one text replaced in one of them.
fn outcome(file: &str, from: &str, to: &str) -> Result<usize, Failure> {
    let text = |name: &str| {
        let text = repository_text(&format!("examples/kitting/{name}"));
        if name != file {
            return text;
        }
        assert!(text.contains(from), "{name} has no {from}");
        text.replacen(from, to, 1)
    };
    let domain = read_domain(&text("one-kit-domain.pddl")).unwrap();
    let problem = read_problem(&text("one-kit-problem.pddl")).unwrap();
    let plan = read_plan(&text("one-kit.pddl")).unwrap();
    simulate(&domain, &problem, &plan)
}

/// The example plan reaches the goal of its problem.
#[test]
fn a_good_plan_reaches_its_goal() {
    assert_eq!(outcome("", "", ""), Ok(18));
}

/// A plan that does not fit its domain or problem fails at the step it should, and says why.
#[test]
fn bad_plans_fail_where_they_should() {
    let (domain, problem, plan) = (
        "one-kit-domain.pddl",
        "one-kit-problem.pddl",
        "one-kit.pddl",
    );
    let cases = [
        (domain, "(:action take-kit-tray", "(:action take-tray"),
        (problem, "(bare robot_1)", ""),
        (
            problem,
            "(= (left empty_kit_tray_supply) 1)",
            "(= (left empty_kit_tray_supply) 0)",
        ),
        (
            plan,
            "(take-part robot_1 part_b_1 part_b_tray part_gripper work_table_1 kit_1)",
            "(take-part robot_1 part_b_1 part_b_tray part_gripper)",
        ),
        (
            plan,
            "(put-part robot_1 part_b_1 kit_1 work_table_1)",
            "(put-part robot_1 tray_gripper kit_1 work_table_1)",
        ),
        (
            plan,
            "(put-part robot_1 part_b_1",
            "(put-part robot_1 part_z_1",
        ),
        (problem, "(= (steps) 0)", ""),
        (plan, "(put-kit robot_1 kit_1 finished_kit_receiver)", ""),
        (problem, "(= (steps) 18)", "(= (steps) 17)"),
    ];
    let mut messages = String::new();
    for (file, from, to) in cases {
        let failure = outcome(file, from, to).unwrap_err();
        messages.push_str(&format!("{failure}\n"));
    }
    expect_test::expect![[r#"
        step 2, (take-kit-tray robot_1 kit_tray_1 empty_kit_tray_supply tray_gripper work_table_1): the domain has no action take-kit-tray
        step 1, (attach-eff robot_1 tray_gripper tray_gripper_holder): the precondition (bare robot_1) is false
        step 2, (take-kit-tray robot_1 kit_tray_1 empty_kit_tray_supply tray_gripper work_table_1): the precondition (>= (left empty_kit_tray_supply) 1) with 0 and 1 is false
        step 9, (take-part robot_1 part_b_1 part_b_tray part_gripper): take-part takes 6 objects, not 4
        step 10, (put-part robot_1 tray_gripper kit_1 work_table_1): tray_gripper is a effector, ?p takes a part
        step 10, (put-part robot_1 part_z_1 kit_1 work_table_1): the problem has no object part_z_1
        step 1, (attach-eff robot_1 tray_gripper tray_gripper_holder): the effect (increase (steps) 1) has no result: (steps) has no value
        step 18, (goal): (at kit_1 finished_kit_receiver) is false at the end
        step 19, (goal): (= (steps) 17) with 18 and 17 is false at the end
    "#]]
    .assert_eq(&messages);
}

/// The example workstation for PDDL plans as a database.
fn fresh_world(folder: &Path) -> PathBuf {
    let path = folder.join("world.db");
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    let world = repository_text("examples/kitting/workstation-pddl.toml");
    writer.replace(&import_toml(&world).unwrap()).unwrap();
    path
}

/// Executes a run with an arm that fails at these commands.
fn pull_run(path: &Path, table: &ActionTable, run: PulledRun, failures: &[usize]) -> PlanRunReport {
    let options = &RobotOptions::default();
    let mut interpreter = PddlInterpreter::new(path, table.clone(), options.clone());
    interpreter.go_on(run.source(), run.done());
    let mut motion = SimulatedMotion {
        reach: Some(0.85),
        failures: failures.to_vec(),
        ..SimulatedMotion::default()
    };
    let place = Pull {
        writer: &mut Writer::open(path, Durability::Process).unwrap(),
        motion: &mut motion,
        options,
    };
    pull(&mut interpreter, run, place, &mut |_| {}).unwrap()
}

/// Executes a plan file with a simulated arm in the example workstation for PDDL plans.
fn execute(plan: &Path, table: &ActionTable) -> (PlanRunReport, Model) {
    let folder = tempfile::tempdir().unwrap();
    let path = fresh_world(folder.path());
    let source = std::fs::read_to_string(plan).unwrap();
    let run = PulledRun::new(plan.to_str().unwrap(), &source);
    let report = pull_run(&path, table, run, &[]);
    (report, read_world(&path))
}

fn assert_one_kit(world: &Model) {
    assert_consistent(world);
    let kit = world.named("kit_1").unwrap();
    let box_ = world.object(kit.location.reference).unwrap();
    assert_eq!(box_.name, "finished_kit_receiver");
    let design = world.design("kit_design_a2b1c1").unwrap();
    let parts: Vec<_> = world
        .children(kit.id)
        .filter(|c| c.class == Class::Part)
        .collect();
    assert_eq!(parts.len(), 4);
    for part in parts {
        let at = |wanted: &plan::world::DesignPart| {
            let difference = part.location.pose.inv_mul(&wanted.pose);
            Some(wanted.sku.as_str()) == part.sku()
                && difference.translation.vector.norm() < 1e-6
                && difference.rotation.angle() < 1e-6
        };
        assert!(
            design.parts.iter().any(at),
            "{} is not at a place of the design",
            part.name
        );
    }
}

/// The example plan makes a kit with a simulated arm.
#[test]
fn a_pddl_plan_makes_a_kit() {
    let table = ActionTable::own().unwrap();
    let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/kitting/one-kit.pddl");
    let (report, world) = execute(&plan, &table);
    assert_eq!(
        (report.outcome, report.code, report.counters.statements),
        ("stopped", 0, 18),
        "{report:?}"
    );
    assert_one_kit(&world);
}

/// A run whose motion fails at any command goes on from its database to the same kit; one that
/// came to its end, or that the interpreter gave up, does not.
#[test]
fn a_failed_pddl_run_is_resumed() {
    let table = ActionTable::own().unwrap();
    let source = repository_text("examples/kitting/one-kit.pddl");
    let last = |path: &Path| Writer::open(path, Durability::Process).unwrap().last_run();
    let folder = tempfile::tempdir().unwrap();
    let path = fresh_world(folder.path());
    let good = pull_run(&path, &table, PulledRun::new("plan", &source), &[]);
    let whole = read_world(&path);
    let again = PulledRun::resume(last(&path).unwrap().unwrap()).unwrap_err();
    assert!(again.to_string().contains("came to its end"), "{again}");
    for at in (5..good.counters.commands - 1).step_by(3) {
        let folder = tempfile::tempdir().unwrap();
        let path = fresh_world(folder.path());
        let failed = pull_run(&path, &table, PulledRun::new("plan", &source), &[at]);
        assert_eq!(
            (failed.outcome, failed.code),
            ("failed", 100),
            "{failed:#?}"
        );
        let run = PulledRun::resume(last(&path).unwrap().unwrap()).unwrap();
        assert_eq!(run.done(), failed.counters.statements);
        let report = pull_run(&path, &table, run, &[]);
        let counters = &report.counters;
        assert_eq!(
            (
                report.outcome,
                counters.statements,
                counters.pick_ups,
                counters.kits
            ),
            ("stopped", 18, 6, 1),
            "command {at}: {report:#?}"
        );
        crate::world::assert_same(&whole, &read_world(&path));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = fresh_world(folder.path());
    let ghost = PulledRun::new("plan", "(attach-eff robot_1 ghost ghost_holder)");
    let report = pull_run(&path, &table, ghost, &[]);
    assert_eq!((report.outcome, report.code), ("failed", 9), "{report:#?}");
    let again = PulledRun::resume(last(&path).unwrap().unwrap()).unwrap_err();
    assert!(again.to_string().contains("gave up"), "{again}");
}

/// A user's table adds an action.
#[test]
fn a_table_adds_an_action() {
    let table = ActionTable::own().unwrap();
    let more = r#"
        [[action]]
        names = ["greet"]
        arguments = ["robot"]
        do = [{ message = "hello {robot}" }, { dwell = 0.5 }]
    "#;
    let table = table.with(more).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan");
    std::fs::write(&plan, "(greet robot_1)\n0.5: (GREET robot_1) [0.5]\n").unwrap();
    let (report, _) = execute(&plan, &table);
    assert_eq!(
        (
            report.outcome,
            report.counters.statements,
            report.counters.commands
        ),
        ("stopped", 2, 8),
        "{report:?}"
    );
    assert!(report.counters.motion_s >= 1.0);
    let wrong = more.replace("{ dwell = 0.5 }", "{ pick_up = \"part\" }");
    let error = table.with(&wrong).unwrap_err().to_string();
    assert!(error.contains("no argument is called part"), "{error}");
}

/// The codes of the five functions.
#[test]
fn the_interface_keeps_its_life_cycle() {
    struct Full;
    impl CommandSink for Full {
        fn command(&mut self, _: crcl::Command) -> bool {
            false
        }
    }
    #[derive(Default)]
    struct Lines(Vec<String>);
    impl CommandSink for Lines {
        fn command(&mut self, command: crcl::Command) -> bool {
            self.0.push(crcl::text::write_command(&command));
            true
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.db");
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    let world = repository_text("examples/kitting/workstation-pddl.toml");
    writer.replace(&import_toml(&world).unwrap()).unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let table = ActionTable::own().unwrap();
    let mut interpreter = PddlInterpreter::new(&path, table, RobotOptions::default());
    let mut sink = Lines::default();
    assert_eq!(interpreter.execute(&mut sink), Code::NotInitialised);
    assert_eq!(interpreter.close_plan(), Code::NotInitialised);
    assert_eq!(interpreter.exit(), Code::NotInitialised);
    assert_eq!(interpreter.init(), Code::Ok);
    assert_eq!(interpreter.execute(&mut sink), Code::NoPlanOpen);
    assert_eq!(interpreter.close_plan(), Code::NoPlanOpen);
    assert_eq!(
        interpreter.open_plan("nowhere", "PDDL", &mut sink),
        Code::CannotReadFile
    );
    let broken = file("broken", "(take-part robot_1\n");
    assert_eq!(
        interpreter.open_plan(&broken, "PDDL", &mut sink),
        Code::ParseError
    );
    assert!(
        interpreter.last_error().contains("line 1, column 19"),
        "{}",
        interpreter.last_error()
    );
    let unknown = file("unknown", "(dance robot_1)\n");
    assert_eq!(
        interpreter.open_plan(&unknown, "PDDL", &mut sink),
        Code::UnknownAction
    );
    assert_eq!(
        interpreter.open_plan(&unknown, "KITPLAN", &mut sink),
        Code::UnsupportedPlanType
    );
    let ghost = file("ghost", "(attach-eff robot_1 ghost ghost_holder)\n");
    assert_eq!(
        interpreter.open_plan(&ghost, "PDDL", &mut Full),
        Code::SinkFull
    );
    assert_eq!(interpreter.open_plan(&ghost, "PDDL", &mut sink), Code::Ok);
    assert_eq!(
        interpreter.open_plan(&ghost, "PDDL", &mut sink),
        Code::PlanAlreadyOpen
    );
    assert_eq!(interpreter.execute(&mut sink), Code::NoSuchPose);
    assert_eq!(interpreter.execute(&mut sink), Code::EndOfPlan);
    assert_eq!(interpreter.close_plan(), Code::Ok);
    let early = file(
        "early",
        "(take-part robot_1 part_a_1 part_a_tray part_gripper work_table_1 kit_1)\n",
    );
    assert_eq!(interpreter.open_plan(&early, "PDDL", &mut sink), Code::Ok);
    assert_eq!(interpreter.execute(&mut sink), Code::PreconditionFalse);
    assert!(
        interpreter.last_error().contains("no end effector"),
        "{}",
        interpreter.last_error()
    );
    assert_eq!(interpreter.close_plan(), Code::Ok);
    let empty = file("empty", "; nothing to do\n");
    assert_eq!(interpreter.open_plan(&empty, "PDDL", &mut sink), Code::Ok);
    assert_eq!(interpreter.execute(&mut sink), Code::EndOfPlan);
    assert_eq!(interpreter.close_plan(), Code::Ok);
    assert_eq!(interpreter.exit(), Code::Ok);
    let ends: Vec<&String> = sink
        .0
        .iter()
        .filter(|line| line.starts_with("EndCanon"))
        .collect();
    assert_eq!(
        ends,
        ["EndCanon (9)", "EndCanon (10)", "EndCanon (0)"],
        "{:?}",
        sink.0
    );
}
