//! `canter plan-run`, `plan-check` and `world` as real processes, with the example workstation.
//!
//! The plan of the original document and NIST's PDDL plans are used where the folder of
//! specifications lies beside the repository; our own plans everywhere. The larger sizes are set by
//! environment variables: `CANTER_KILLS`, `CANTER_LAYOUTS`, `CANTER_KITS`, `CANTER_PLAN_ROBOTS`.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde_json::Value;
use system_tests::repository;

use crate::canter::{Ran, canter, command};

const WORLD: &str = "examples/kitting/workstation.toml";
const PLAN: &str = "examples/kitting/kit-abc.plan";

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

/// A file of the folder of specifications; none without the folder.
fn shared(path: &str) -> Option<PathBuf> {
    let path = repository::root().join("../shared").join(path);
    path.exists().then_some(path)
}

/// The plan of the original document: from below its dashed line to its end, unchanged.
fn document(folder: &Path) -> Option<Work> {
    let text = std::fs::read_to_string(shared("spec/seeds/kitting-process-plan.txt")?).unwrap();
    let dashes = text.find("-----").unwrap();
    let end = dashes + text[dashes..].find('\n').unwrap();
    let plan = folder.join("document.plan");
    std::fs::write(&plan, &text[end..]).unwrap();
    let world = "examples/kitting/workstation-kitABCPlan.toml";
    Some(Work { plan, world })
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

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().map_or(&[][..], Vec::as_slice);
    list.iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Every finished kit is in the box for kits, with each part at its pose of the design.
fn assert_kits(world: &Value, kits: usize) {
    let pose = |object: &Value| {
        (
            numbers(&object["pose"]["point"]),
            numbers(&object["pose"]["rpy"]),
        )
    };
    let finished: Vec<&Value> = objects(world)
        .iter()
        .filter(|object| object["properties"]["isKitInstance_Finished"] == true)
        .collect();
    assert_eq!(finished.len(), kits);
    for kit in finished {
        let place = kit["reference"].as_str().unwrap();
        assert!(place.starts_with("BoxOfKits"), "{kit}");
        let mut wanted: Vec<&Value> = world["design"][0]["part"]
            .as_array()
            .unwrap()
            .iter()
            .collect();
        let parts = objects(world)
            .iter()
            .filter(|object| object["reference"] == kit["name"] && object["class"] == "Part");
        for part in parts {
            let (point, rpy) = pose(part);
            let at = |design: &&Value| {
                let (wanted, turned) = pose(design);
                let off = |a: &[f64], b: &[f64]| {
                    a.iter()
                        .zip(b)
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max)
                };
                // Millimetres and degrees.
                design["sku"] == part["properties"]["hasPart_SkuRef"]
                    && off(&point, &wanted) < 1e-3
                    && off(&rpy, &turned) < 1e-3
            };
            let found = wanted.iter().position(at);
            wanted.remove(found.unwrap_or_else(|| panic!("{part} is at no place of the design")));
        }
        assert!(wanted.is_empty(), "{kit} lacks {wanted:?}");
    }
}

/// The counts of three kits with full supplies.
fn assert_three_kits(report: &Value) {
    let counts = [
        "pick_ups",
        "put_downs",
        "moves_above",
        "kits",
        "factotum_calls",
    ];
    let counts = counts.map(|name| report[name].as_u64().unwrap());
    assert_eq!(counts, [18, 18, 36, 3, 0], "{report}");
    assert_eq!(report["outcome"], "stopped");
    assert_eq!(report["reason"], Value::Null);
}

/// Three kits by the command as a user gives it, with the simulated driver in lock-step: the
/// document's plan where there is one, else ours.
#[test]
fn three_kits_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let work = document(folder.path()).unwrap_or_else(own);
    let robots = std::env::var("CANTER_PLAN_ROBOTS").unwrap_or_else(|_| "ur5e".into());
    for robot in robots.split(',') {
        let database = folder.path().join(format!("{robot}.db"));
        let arm = format!("plans{}/{robot}", std::process::id());
        let keep = database.to_str().unwrap();
        let more = [
            "--robot",
            robot,
            "--lock-step",
            "--arm",
            &arm,
            "--keep",
            keep,
            "--verbose",
            "--speed",
            "100",
        ];
        let ran = canter(run(&work, 3, &more));
        assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
        let report = report(&ran);
        println!(
            "{robot}: {} s of motion in {} s",
            report["motion_s"], report["wall_s"]
        );
        assert_three_kits(&report);
        let with: Vec<&str> = ran
            .stderr
            .lines()
            .filter_map(|line| line.strip_prefix("with "))
            .collect();
        // The tray gripper that brought a kit to its box takes the next tray.
        let (tray, part) = ("TrayGripper", "PartGripper");
        assert_eq!(with, [tray, part, tray, part, tray, part, tray]);
        assert_kits(&world(&database), 3);
    }
}

/// The same in a dry run takes the same time of motion, for both plans.
#[test]
fn a_dry_run_makes_three_kits() {
    let folder = tempfile::tempdir().unwrap();
    for (number, work) in [Some(own()), document(folder.path())]
        .iter()
        .flatten()
        .enumerate()
    {
        let database = folder.path().join(format!("{number}.db"));
        let ran = canter(run(
            work,
            3,
            &["--dry-run", "--keep", database.to_str().unwrap()],
        ));
        assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
        assert_three_kits(&report(&ran));
        assert_kits(&world(&database), 3);
    }
}

/// Where the gripper lets go, the measured controlled point is at the grasp of the part in its pose
/// of the design, within the end tolerance; the samples of the simulated driver tell.
#[test]
fn parts_are_let_go_at_their_poses() {
    /// Largest distance (m) of a measured point from where it should be.
    const TOLERANCE: f64 = 1e-4;
    let folder = tempfile::tempdir().unwrap();
    let samples = folder.path().join("samples.csv");
    let arm = format!("plans{}/poses", std::process::id());
    let path = samples.to_str().unwrap();
    let more = [
        "--lock-step",
        "--arm",
        &arm,
        "--samples",
        path,
        "--speed",
        "100",
    ];
    let ran = canter(run(&own(), 1, &more));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    let mut reader = csv::Reader::from_path(&samples).unwrap();
    let header = reader.headers().unwrap().clone();
    let at = |name: &str| header.iter().position(|column| column == name).unwrap();
    let places = ["measured_x_m", "measured_y_m", "measured_z_m"].map(at);
    let speeds: Vec<usize> = (1..=6).map(|joint| at(&format!("dq{joint}"))).collect();
    let (mut still, mut rests) = (0, Vec::new());
    for record in reader.records() {
        let record = record.unwrap();
        let value = |column: usize| record[column].parse::<f64>().unwrap();
        still = if speeds.iter().all(|column| value(*column) == 0.0) {
            still + 1
        } else {
            0
        };
        // The gripper takes 0.2 s; a tenth later the servos have settled.
        if still == 150 {
            rests.push(places.map(value));
        }
    }
    // Kit tray at (350, 0, 0) mm, parts in it by the design, the grasp 14 mm above their bottom.
    for (x, y) in [
        (-0.038, 0.022),
        (-0.038, -0.022),
        (0.038, 0.022),
        (0.038, -0.022),
    ] {
        let wanted = [0.35 + x, y, 0.004 + 0.014];
        let off = |rest: &[f64; 3]| {
            rest.iter()
                .zip(&wanted)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
        };
        let nearest = rests.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!(
            nearest < TOLERANCE,
            "no rest at {wanted:?}, the nearest is {nearest} m away"
        );
    }
}

/// The report has the fields that are documented, in both kinds of plans, and no others.
#[test]
fn reports_have_the_documented_fields() {
    let wanted = [
        "outcome",
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
    let folder = tempfile::tempdir().unwrap();
    if let Some(work) = document(folder.path()) {
        let ran = canter([
            "plan-check",
            work.plan.to_str().unwrap(),
            "--json",
            "--world",
            work.world,
        ]);
        let found = report(&ran);
        let names = [
            "requirements",
            "parameters",
            "variables",
            "statements",
            "warnings",
            "errors",
        ];
        let counts = names.map(|name| count(&found, name));
        assert_eq!(counts, [5, 1, 17, 97, 13, 0], "{found}");
        assert_eq!(ran.code, 0);
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
    assert_eq!(report["kits"], 4);
    assert_kits(&world(&database), 4);
    let shown = canter(["world", "show", keep]);
    assert!(shown.stdout.contains("(EndCanon(4))"), "{}", shown.stdout);
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

/// NIST's PDDL plans: to their goal in thought, or to the step and the precondition that is false;
/// the plan of June 2012 on the arm, in lock-step.
#[test]
fn pddl_plans_run() {
    let folder = tempfile::tempdir().unwrap();
    let g1 = shared("data/nist/pddl/g1-2012-06");
    let plan = g1
        .as_ref()
        .map_or("examples/kitting/one-kit.pddl".into(), |g1| {
            g1.join("kitting-plan.txt")
        });
    let database = folder.path().join("world.db");
    let arm = format!("plans{}/pddl", std::process::id());
    let work = Work {
        plan: plan.clone(),
        world: "examples/kitting/workstation-pddl.toml",
    };
    let keep = database.to_str().unwrap();
    let ran = canter(run(
        &work,
        1,
        &[
            "--lock-step",
            "--arm",
            &arm,
            "--keep",
            keep,
            "--speed",
            "100",
        ],
    ));
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
    let Some(g1) = g1 else { return };
    for (domain, reached) in [("0", true), ("1", true), ("2", false), ("3", false)] {
        let domain = g1.join(format!("kitting-domain_{domain}.pddl"));
        let problem = g1.join("kitting-problem.pddl");
        let arguments = [
            "plan-check".as_ref(),
            plan.as_os_str(),
            "--domain".as_ref(),
            domain.as_os_str(),
            "--problem".as_ref(),
            problem.as_os_str(),
            "--json".as_ref(),
        ];
        let ran = canter(arguments);
        let verdict = report(&ran);
        assert_eq!(verdict["goal_reached"], reached, "{verdict}");
        assert_eq!(ran.code, i32::from(!reached));
        let reason = verdict["reason"].as_str().unwrap_or_default();
        assert_eq!(
            reason.contains("step 2, (take-kit-tray"),
            !reached,
            "{reason}"
        );
    }
}

/// On random layouts the order chosen by the planner's predicted times is never slower than the
/// written one. The places of the supplies are drawn with a fixed seed.
#[test]
fn chosen_orders_are_never_slower() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(repository::root().join(WORLD)).unwrap();
    let mut state: u64 = 20_261_121;
    let mut random = move || {
        // Source: Marsaglia, Xorshift RNGs (2003), the 64-bit triple 13, 7, 17.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let layouts = size("CANTER_LAYOUTS", 4);
    let (mut sums, mut better) = ([0.0; 2], 0);
    for layout in 0..layouts {
        let mut places = [210.0, 0.0, -210.0];
        for last in (1..3).rev() {
            places.swap(last, (random() * (last + 1) as f64) as usize);
        }
        let mut moved = text.clone();
        for (index, y) in [210, 0, -210].iter().enumerate() {
            let old = format!("pose = {{ point = [105, {y}, 700] }}");
            let (x, y) = (
                105.0 + 60.0 * (random() - 0.5),
                places[index] + 40.0 * (random() - 0.5),
            );
            moved = moved.replacen(
                &old,
                &format!("pose = {{ point = [{x:.2}, {y:.2}, 700] }} #"),
                1,
            );
        }
        let file = folder.path().join(format!("{layout}.toml"));
        std::fs::write(&file, moved).unwrap();
        let time = |more: &[&str]| {
            let start = [
                "plan-run",
                PLAN,
                "--world",
                file.to_str().unwrap(),
                "-r",
                "ur5e",
                "--json",
            ];
            let end = ["--dry-run", "--set", "NumberOfKitsToMake=1"];
            let ran = canter(start.iter().chain(&end).chain(more));
            assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
            report(&ran)["motion_s"].as_f64().unwrap()
        };
        let (written, chosen) = (time(&["--written-order"]), time(&[]));
        assert!(
            chosen <= written + 1e-9,
            "layout {layout}: {chosen} s > {written} s"
        );
        sums = [sums[0] + written, sums[1] + chosen];
        better += usize::from(chosen < written - 1e-6);
    }
    println!(
        "{layouts} layouts: {:.3} s a kit as written, {:.3} s as chosen ({:.2} % less), better in {better}",
        sums[0] / layouts as f64,
        sums[1] / layouts as f64,
        100.0 * (1.0 - sums[1] / sums[0])
    );
}

/// Processor time (s) and resident memory (kB) of a process.
fn cost(process: u32) -> (f64, u64) {
    let read =
        |file: &str| std::fs::read_to_string(format!("/proc/{process}/{file}")).unwrap_or_default();
    let (stat, status) = (read("stat"), read("status"));
    // After the name in parentheses come state, ..., utime and stime in hundredths of a second.
    let fields = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .skip(11);
    let ticks: f64 = fields
        .take(2)
        .filter_map(|field| field.parse::<f64>().ok())
        .sum();
    let memory = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let memory = memory.and_then(|line| line.split_whitespace().next()?.parse().ok());
    (ticks / 100.0, memory.unwrap_or(0))
}

/// Many kits in a dry run: prints what a kit costs at the start and at the end, and holds the
/// memory flat.
#[test]
fn many_kits_cost_no_more_each() {
    use std::io::BufRead;
    let kits = size("CANTER_KITS", 4);
    let mut child = command(run(&own(), kits, &["--dry-run"]))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut marks = vec![(0.0, 0)];
    for line in std::io::BufReader::new(child.stderr.take().unwrap()).lines() {
        if line.unwrap().ends_with("is finished") {
            marks.push(cost(child.id()));
        }
    }
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert_eq!(marks.len(), kits + 1);
    let window = (kits / 10).max(1);
    let first = marks[window].0 - marks[0].0;
    let last = marks[kits].0 - marks[kits - window].0;
    println!(
        "{kits} kits: first {window} {:.3} s of processor each, last {window} {:.3} s, ratio {:.3}; \
         memory after {window} {} kB, at the end {} kB",
        first / window as f64,
        last / window as f64,
        last / first,
        marks[window].1,
        marks[kits].1
    );
    let (early, late) = (marks[kits.div_ceil(2)].1, marks[kits].1);
    assert!(late < early + 20_000, "{early} kB grew to {late} kB");
}
