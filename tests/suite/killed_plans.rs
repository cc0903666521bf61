//! Runs of plans that end by `kill -9` or by Ctrl-C, and are continued with `--resume`.
//!
//! `CANTER_KILLS` sets how many dry runs are killed, `CANTER_KILLS_MOVING` how many with the
//! simulated driver in lock-step.

use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::{canter, command};
use crate::plans::{objects, own, report, run, size, world};

/// Starts a run in a copy of the world that is kept.
fn start(database: &Path, kits: usize, more: &[&str]) -> Child {
    let keep = ["--keep", database.to_str().unwrap()];
    let more: Vec<&str> = more.iter().chain(&keep).copied().collect();
    command(run(&own(), kits, &more))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Resumes a run that was killed; returns the report.
fn resume(database: &Path, more: &[&str]) -> Value {
    let database = database.to_str().unwrap();
    let start = ["plan-run", "--resume", "-r", "ur5e", "--json", "--world"];
    let arguments = start.iter().chain([&database]).chain(more);
    let ran = canter(arguments);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    report(&ran)
}

/// Name, class, reference and pose of each object except the arm, whose position depends on its
/// last motion.
fn state(world: &Value) -> Vec<String> {
    let line = |object: &Value| {
        let numbers = |part: &str| -> Vec<i64> {
            let list = object["pose"][part].as_array();
            let list = list.map_or(&[][..], Vec::as_slice);
            list.iter()
                .map(|x| (x.as_f64().unwrap() * 1e3).round() as i64)
                .collect()
        };
        let (name, class) = (&object["name"], &object["class"]);
        let reference = &object["reference"];
        let properties = &object["properties"];
        format!(
            "{name} {class} {reference} {:?} {:?} {properties}",
            numbers("point"),
            numbers("rpy")
        )
    };
    objects(world).iter().map(line).collect()
}

/// Kills as many runs as asked for and resumes each; all must have the same result. Returns how
/// many runs were killed.
fn kill_runs(kits: usize, kills: usize, mode: &dyn Fn(&str) -> Vec<String>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let begin = |database: &Path, name: &str| {
        let mode = mode(name);
        let mode: Vec<&str> = mode.iter().map(String::as_str).collect();
        start(database, kits, &mode)
    };
    let whole = folder.path().join("whole.db");
    let began = Instant::now();
    assert!(begin(&whole, "whole").wait().unwrap().success());
    let length = began.elapsed();
    let expected = state(&world(&whole));
    let mut cut = 0;
    // Moments spread over the run by the golden ratio, the same each time.
    for number in 1..=kills {
        let database = folder.path().join(format!("{number}.db"));
        let mut process = begin(&database, &number.to_string());
        std::thread::sleep(length.mul_f64((number as f64 * 0.618_033_988_75).fract()));
        process.kill().unwrap();
        process.wait().unwrap();
        let shown = canter(["world", "show", database.to_str().unwrap()]).stdout;
        if !shown.contains("last run") {
            // Killed before the plan had begun.
            continue;
        }
        let mut left = world(&database);
        if shown.contains("not ended") {
            cut += 1;
            let again = folder.path().join(format!("{number}-again.db"));
            let keep = ["--keep".to_owned(), again.to_str().unwrap().to_owned()];
            let more = [mode(&format!("{number}-again")), keep.into()].concat();
            let more: Vec<&str> = more.iter().map(String::as_str).collect();
            let report = resume(&database, &more);
            let done = ["kits", "pick_ups"].map(|name| report[name].as_u64().unwrap() as usize);
            assert_eq!(done, [kits, 6 * kits], "{report}");
            left = world(&again);
        }
        assert_eq!(state(&left), expected, "kill {number}");
    }
    assert!(cut > 0, "no kill hit the run");
    format!("{kills} kills, {cut} of them in the middle of the run, which takes {length:?}")
}

/// Killed at random times of a dry run: the database opens, is consistent, and the resumed run has
/// the same result.
#[test]
fn a_killed_run_goes_on_to_the_same_end() {
    let dry = |_: &str| vec!["--dry-run".into()];
    println!("{}", kill_runs(2, size("CANTER_KILLS", 6), &dry));
}

/// The same while the simulated driver moves the arm.
#[test]
fn a_killed_arm_goes_on_to_the_same_end() {
    let moving = |name: &str| {
        let arm = format!("kills{}/{name}", std::process::id());
        let options = ["--lock-step", "--speed", "100", "--arm", &arm];
        options.map(str::to_owned).into()
    };
    let said = kill_runs(1, size("CANTER_KILLS_MOVING", 2), &moving);
    println!("{said}");
}

/// A PDDL plan whose motion failed is resumed at the same step.
#[test]
fn a_pddl_run_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let (file, database) = (folder.path().join("far.toml"), folder.path().join("far.db"));
    let world = "examples/kitting/workstation-pddl.toml";
    let text = std::fs::read_to_string(system_tests::repository::root().join(world)).unwrap();
    let place = text.split("name = \"part_c_tray\"").nth(1).unwrap();
    let place = place.lines().find(|line| line.starts_with("pose")).unwrap();
    let far = text.replacen(place, "pose = { point = [2000, 0, 700] }", 1);
    std::fs::write(&file, far).unwrap();
    let (file, database) = (file.to_str().unwrap(), database.to_str().unwrap());
    let plan = "examples/kitting/one-kit.pddl";
    let start = ["plan-run", plan, "--world", file, "--keep", database];
    let go_on = ["plan-run", "--resume", "--world", database];
    for arguments in [&start[..], &go_on[..]] {
        let more = ["--dry-run", "--json", "-r", "ur5e"];
        let ran = canter(arguments.iter().chain(&more));
        let report = report(&ran);
        let said = ["outcome", "code", "statements"].map(|name| report[name].to_string());
        assert_eq!(said, ["\"failed\"", "100", "6"], "{report}");
        let reason = report["reason"].as_str().unwrap();
        assert!(reason.starts_with("step 7, (take-part "), "{reason}");
    }
    let shown = canter(["world", "show", database]).stdout;
    assert!(shown.contains("6 statements, 0 kits; failed"), "{shown}");
}

/// Waits until a run has executed some statements and another is being executed.
pub(crate) fn moving(database: &str, statements: usize) {
    let deadline = Instant::now() + Duration::from_secs(300);
    while Instant::now() < deadline {
        let shown = canter(["world", "show", database]).stdout;
        let last = shown.lines().last().unwrap_or_default();
        let count = last
            .split(", ")
            .nth(1)
            .and_then(|part| part.split(' ').next()?.parse().ok());
        if count.is_some_and(|count: usize| count >= statements) && last.contains("not ended") {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the run does not get as far as {statements} statements");
}

/// A driver that dies is a fault of the arm: the run ends at once with the exit code of such a
/// fault.
#[test]
fn a_plan_whose_driver_dies_ends() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let arm = format!("killed{}/driver", std::process::id());
    let driver = ["driver", "sim", "-r", "ur5e", "--arm", &arm];
    let mut driver = command(driver).stderr(Stdio::null()).spawn().unwrap();
    let external = ["--lock-step", "--driver", "external", "--arm", &arm];
    let mut process = start(&database, 3, &external);
    moving(database.to_str().unwrap(), 8);
    driver.kill().unwrap();
    driver.wait().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    let code = loop {
        if let Some(status) = process.try_wait().unwrap() {
            break status.code();
        }
        if Instant::now() > deadline {
            process.kill().unwrap();
            panic!("the run goes on without a driver");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(code, Some(7));
    drop(world(&database));
}

/// With the simulated driver: killed while the arm moves, then stopped by Ctrl-C, then to its end.
#[test]
fn a_moving_arm_is_killed_and_stopped_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let path = database.to_str().unwrap();
    // The same arm again at once: what is left of the killed process must not be in the way.
    let name = |number: u32| format!("killed{}/{number}", std::process::id());
    let (first, second, third) = (name(1), name(1), name(2));
    let fast = ["--lock-step", "--speed", "100", "--arm"];
    let mut process = start(&database, 1, &[&fast[..], &[&first]].concat());
    moving(path, 8);
    process.kill().unwrap();
    process.wait().unwrap();
    drop(world(&database));

    let mut process = command([
        "plan-run", "--resume", "-r", "ur5e", "--json", "--world", path,
    ])
    .args(fast)
    .arg(&second)
    .stdout(Stdio::piped())
    .stderr(Stdio::null())
    .spawn()
    .unwrap();
    moving(path, 30);
    let interrupt = ["-INT", &process.id().to_string()];
    assert!(
        std::process::Command::new("kill")
            .args(interrupt)
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(process.wait().unwrap().code(), Some(5));
    let mut text = String::new();
    std::io::Read::read_to_string(&mut process.stdout.take().unwrap(), &mut text).unwrap();
    let interrupted: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(interrupted["outcome"], "interrupted", "{interrupted}");
    drop(world(&database));

    let report = resume(&database, &[&fast[..], &[&third]].concat());
    assert_eq!(
        (report["kits"].as_u64(), report["put_downs"].as_u64()),
        (Some(1), Some(6)),
        "{report}"
    );
    let whole = folder.path().join("whole.db");
    assert!(start(&whole, 1, &["--dry-run"]).wait().unwrap().success());
    assert_eq!(state(&world(&database)), state(&world(&whole)));
}
