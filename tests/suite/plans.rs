//! `canter plan-run`, `plan-check` and `world` as real processes, with the example workstation.

use std::path::{Path, PathBuf};

use serde_json::Value;
use system_tests::repository;

use crate::canter::{Ran, canter};
use crate::kitting_end_to_end::assert_kits;

pub(crate) const WORLD: &str = "examples/kitting/workstation.toml";
pub(crate) const PLAN: &str = "examples/kitting/kit-abc.plan";

/// A plan with the workstation it is for.
pub(crate) struct Work {
    pub(crate) plan: PathBuf,
    pub(crate) world: &'static str,
}

/// Our own plan.
pub(crate) fn own() -> Work {
    Work {
        plan: PLAN.into(),
        world: WORLD,
    }
}

/// A number from the environment.
pub(crate) fn size(name: &str, usual: usize) -> usize {
    let text = std::env::var(name).ok();
    text.and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Arguments of a run for some kits with a report as JSON.
pub(crate) fn run(work: &Work, kits: usize, more: &[&str]) -> Vec<String> {
    let set = format!("NumberOfKitsToMake={kits}");
    let plan = work.plan.to_str().unwrap();
    let start = ["plan-run", plan, "--world", work.world, "--json"];
    let end = ["--robot", "ur5e", "--set", &set];
    let robot = if more.contains(&"--robot") { 2 } else { 0 };
    let all = start.iter().chain(&end[robot..]).chain(more);
    all.map(|text| (*text).to_owned()).collect()
}

/// The report of a run that ended well or badly, as JSON.
pub(crate) fn report(ran: &Ran) -> Value {
    let parsed = serde_json::from_str(&ran.stdout);
    parsed.unwrap_or_else(|error| panic!("{error}: {}{}", ran.stdout, ran.stderr))
}

/// The world in a database, consistent by `canter world check`.
pub(crate) fn world(database: &Path) -> Value {
    let database = database.to_str().unwrap();
    let checked = canter(["world", "check", database]);
    assert_eq!(checked.code, 0, "{}{}", checked.stdout, checked.stderr);
    let export = canter(["world", "export", "--json", database]);
    serde_json::from_str(&export.stdout).unwrap()
}

pub(crate) fn objects(world: &Value) -> &[Value] {
    world["object"].as_array().unwrap()
}

/// The report has the fields that are documented, in both kinds of plans, and no others.
#[test]
fn reports_have_the_documented_fields() {
    let wanted = [
        "outcome",
        "code",
        "reason",
        "statements",
        "commands",
        "pick_ups",
        "put_downs",
        "moves_above",
        "end_effector_changes",
        "factotum_calls",
        "kits",
        "motion_s",
        "wall_s",
        "gained_s",
        "warnings",
    ];
    let pddl = Work {
        plan: "examples/kitting/one-kit.pddl".into(),
        world: "examples/kitting/workstation-pddl.toml",
    };
    let kitting = canter(run(&own(), 1, &["--dry-run"]));
    let pulled = canter(run(&pddl, 1, &["--dry-run"]));
    for ran in [kitting, pulled] {
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report = report(&ran);
        let mut names: Vec<&str> = report
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        names.sort_unstable();
        let mut wanted = wanted;
        wanted.sort_unstable();
        assert_eq!(names, wanted);
        let counts = ["pick_ups", "put_downs", "end_effector_changes", "kits"];
        assert_eq!(
            counts.map(|name| report[name].as_u64().unwrap()),
            [6, 6, 3, 1]
        );
    }
}

/// Counts and findings of plans, as JSON.
#[test]
fn plans_are_checked() {
    let ran = canter(["plan-check", PLAN, "--world", WORLD, "--json"]);
    let found = report(&ran);
    let count = |found: &Value, name: &str| found[name].as_u64().unwrap();
    assert_eq!(ran.code, 0);
    assert_eq!(
        (count(&found, "errors"), count(&found, "warnings")),
        (0, 0),
        "{found}"
    );
    let found_own = found;
    let folder = tempfile::tempdir().unwrap();
    // The same plan in its other forms.
    for form in ["block", "json"] {
        let other = folder.path().join(form);
        std::fs::write(&other, canter(["plan-check", PLAN, "--to", form]).stdout).unwrap();
        let ran = canter([
            "plan-check",
            other.to_str().unwrap(),
            "--world",
            WORLD,
            "--json",
        ]);
        let (found, names) = (
            report(&ran),
            ["statements", "variables", "errors", "warnings"],
        );
        let counts = names.map(|name| count(&found, name));
        let own = names.map(|name| count(&found_own, name));
        assert_eq!(counts, own, "{form}: {found}");
    }
    let bad = folder.path().join("bad.plan");
    let text = std::fs::read_to_string(repository::root().join(PLAN)).unwrap();
    std::fs::write(
        &bad,
        text.replacen("Bind(Trays, WORKSTATION", "Bind(Tray, WORKSTATION", 1),
    )
    .unwrap();
    let ran = canter(["plan-check", bad.to_str().unwrap(), "--json"]);
    let found = report(&ran);
    assert_eq!((ran.code, count(&found, "errors")), (1, 1), "{found}");
    let first = &found["findings"][0];
    assert_eq!(first["line"], 168, "{first}");
}

/// Thirteen kits: parts are refilled in both ways, a box fills at twelve and is replaced.
#[test]
fn supplies_run_empty_and_boxes_fill() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let more = [
        "--dry-run",
        "--written-order",
        "--verbose",
        "--keep",
        database.to_str().unwrap(),
    ];
    let ran = canter(run(&own(), 13, &more));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    let count = |name: &str| {
        let is = |line: &&str| line.split_whitespace().nth(3) == Some(name);
        ran.stderr.lines().filter(is).count()
    };
    // 26 PartA out of trays of 8, 13 of each other out of trays of 6; two boxes.
    assert_eq!((count("FactotumRemove"), count("FactotumRefill")), (3, 3));
    assert_eq!(count("FactotumReplace"), 4 + 2);
    assert_eq!(report(&ran)["factotum_calls"], 12);
    assert_eq!(report(&ran)["kits"], 13);
    assert_kits(&world(&database), 1);
}

/// A factotum that has nothing more ends the plan with a reason; the world is as the last motion
/// left it.
#[test]
fn a_refill_that_fails_ends_the_plan() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let keep = database.to_str().unwrap();
    let more = [
        "--dry-run",
        "--written-order",
        "--stock",
        "supply of A=0",
        "--keep",
        keep,
    ];
    let ran = canter(run(&own(), 5, &more));
    let report = report(&ran);
    assert_eq!(
        (ran.code, report["outcome"].as_str()),
        (1, Some("failed")),
        "{report}"
    );
    let reason = report["reason"].as_str().unwrap();
    assert!(
        reason.contains("no more supplies for supply of A"),
        "{reason}"
    );
    assert_eq!((&report["code"], &report["kits"]), (&4.into(), &4.into()));
    assert_kits(&world(&database), 4);
    let shown = canter(["world", "show", keep]);
    assert!(shown.stdout.contains("(EndCanon(4))"), "{}", shown.stdout);
    // When there are supplies again the run goes on.
    let whole = folder.path().join("whole.db");
    let start = ["plan-run", "--resume", "-r", "ur5e", "--world", keep];
    let end = ["--dry-run", "--keep", whole.to_str().unwrap()];
    let ran = canter(start.iter().chain(&end));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    assert_kits(&world(&whole), 5);
}

/// A motion that cannot be made ends the plan before the arm moves, and changes nothing.
#[test]
fn a_place_out_of_reach_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (file, database) = (
        folder.path().join("far.toml"),
        folder.path().join("world.db"),
    );
    let text = std::fs::read_to_string(repository::root().join(WORLD)).unwrap();
    let far = text.replacen(
        "pose = { point = [105, 210, 700] }",
        "pose = { point = [905, 210, 700] }",
        1,
    );
    assert_ne!(far, text);
    std::fs::write(&file, far).unwrap();
    let (file, keep) = (file.to_str().unwrap(), database.to_str().unwrap());
    let set = ["--set", "NumberOfKitsToMake=1"];
    let start = [
        "plan-run",
        PLAN,
        "--world",
        file,
        "-r",
        "ur5e",
        "--dry-run",
        "--json",
        "--keep",
        keep,
    ];
    let ran = canter(start.iter().chain(&set));
    let report = report(&ran);
    assert_eq!(
        (ran.code, report["outcome"].as_str()),
        (1, Some("failed")),
        "{report}"
    );
    let reason = report["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("RobotMoveAbove") && reason.contains("MoveStraightTo ({{1.3"),
        "{reason}"
    );
    let world = world(&database);
    let supply = objects(&world)
        .iter()
        .filter(|object| object["reference"] == "SupplyA")
        .count();
    assert_eq!(supply, 9, "a tray and eight parts");
}

/// A PDDL plan on the arm, in lock-step.
#[test]
fn a_pddl_plan_runs() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let arm = format!("plans{}/pddl", std::process::id());
    let work = Work {
        plan: "examples/kitting/one-kit.pddl".into(),
        world: "examples/kitting/workstation-pddl.toml",
    };
    let keep = database.to_str().unwrap();
    let more = [
        "--lock-step",
        "--arm",
        &arm,
        "--keep",
        keep,
        "--speed",
        "100",
    ];
    let ran = canter(run(&work, 1, &more));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    assert_eq!(report(&ran)["statements"], 18);
    let world = world(&database);
    let kit = objects(&world)
        .iter()
        .find(|object| object["name"] == "kit_1")
        .unwrap();
    assert_eq!(kit["reference"], "finished_kit_receiver");
    let parts = objects(&world)
        .iter()
        .filter(|o| o["reference"] == "kit_1" && o["class"] == "Part");
    assert_eq!(parts.count(), 4);
}

/// A simulated PDDL plan reaches its goal, or the first step whose precondition is false is
/// reported.
#[test]
fn a_pddl_plan_is_checked_against_its_domain() {
    let folder = tempfile::tempdir().unwrap();
    let domain = "examples/kitting/one-kit-domain.pddl";
    let text = std::fs::read_to_string(repository::root().join(domain)).unwrap();
    let spoilt = folder.path().join("domain.pddl");
    std::fs::write(
        &spoilt,
        text.replacen("(:action take-kit-tray", "(:action other", 1),
    )
    .unwrap();
    for (domain, reached) in [(domain, true), (spoilt.to_str().unwrap(), false)] {
        let plan = ["plan-check", "examples/kitting/one-kit.pddl", "--json"];
        let problem = "examples/kitting/one-kit-problem.pddl";
        let given = ["--domain", domain, "--problem", problem];
        let ran = canter(plan.iter().chain(&given));
        let verdict = report(&ran);
        assert_eq!(verdict["goal_reached"], reached, "{verdict}");
        assert_eq!(ran.code, i32::from(!reached));
        let reason = verdict["reason"].as_str().unwrap_or_default();
        let step = reason.contains("step 2, (take-kit-tray");
        assert_eq!(step, !reached, "{reason}");
    }
}
