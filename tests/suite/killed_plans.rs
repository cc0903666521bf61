//! Runs of plans that end by `kill -9` or by Ctrl-C, and go on with `--resume`.
//!
//! `CANTER_KILLS` sets how many runs are killed.

use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::{canter, command};
use crate::plans::{objects, own, report, run, size, world};

/// Starts a run in a copy of the world that is kept.
fn start(database: &Path, more: &[&str]) -> Child {
    let keep = ["--keep", database.to_str().unwrap()];
    let more: Vec<&str> = more.iter().chain(&keep).copied().collect();
    command(run(&own(), 2, &more))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Goes on with a run that was killed; the report.
fn resume(database: &Path, more: &[&str]) -> Value {
    let database = database.to_str().unwrap();
    let start = ["plan-run", "--resume", "-r", "ur5e", "--json", "--world"];
    let arguments = start.iter().chain([&database]).chain(more);
    let ran = canter(arguments);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    report(&ran)
}

/// Name, class, reference and pose of each object, without those of the arm, which is where its
/// last way led it.
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

/// Killed at random moments of a dry run: the database opens, is consistent, and the run goes on to
/// the same end.
#[test]
fn a_killed_run_goes_on_to_the_same_end() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.db");
    let began = Instant::now();
    assert!(start(&whole, &["--dry-run"]).wait().unwrap().success());
    let length = began.elapsed();
    let expected = state(&world(&whole));
    let (kills, mut cut) = (size("CANTER_KILLS", 6), 0);
    // Moments spread over the run by the golden ratio, the same each time.
    for number in 1..=kills {
        let database = folder.path().join(format!("{number}.db"));
        let mut process = start(&database, &["--dry-run"]);
        std::thread::sleep(length.mul_f64((number as f64 * 0.618_033_988_75).fract()));
        process.kill().unwrap();
        process.wait().unwrap();
        let shown = canter(["world", "show", database.to_str().unwrap()]).stdout;
        if !shown.contains("last run") {
            // Killed before the plan had begun.
            continue;
        }
        drop(world(&database));
        if shown.contains("not ended") {
            cut += 1;
            let again = folder.path().join(format!("{number}-again.db"));
            let report = resume(&database, &["--dry-run", "--keep", again.to_str().unwrap()]);
            assert_eq!(
                (report["kits"].as_u64(), report["pick_ups"].as_u64()),
                (Some(2), Some(12)),
                "{report}"
            );
            assert_eq!(state(&world(&again)), expected, "kill {number}");
        } else {
            assert_eq!(state(&world(&database)), expected, "kill {number}");
        }
    }
    println!("{kills} kills, {cut} of them in the middle of the run, which takes {length:?}");
    assert!(cut > 0, "no kill hit the run");
}

/// With the simulated driver: killed while the arm moves, then stopped by Ctrl-C, then to its end.
#[test]
fn a_moving_arm_is_killed_and_stopped_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let path = database.to_str().unwrap();
    let name = |number: u32| format!("killed{}/{number}", std::process::id());
    let (first, second, third) = (name(1), name(2), name(3));
    let moving = |statements: usize| {
        let deadline = Instant::now() + Duration::from_secs(300);
        while Instant::now() < deadline {
            let shown = canter(["world", "show", path]).stdout;
            let last = shown.lines().last().unwrap_or_default();
            let count = last
                .split(", ")
                .nth(1)
                .and_then(|part| part.split(' ').next()?.parse().ok());
            if count.is_some_and(|count: usize| count >= statements) && last.contains("under way") {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("the run does not get as far as {statements} statements");
    };
    let fast = ["--lock-step", "--speed", "100", "--arm"];
    let mut process = start(&database, &[&fast[..], &[&first]].concat());
    moving(16);
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
    moving(40);
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
        (Some(2), Some(12)),
        "{report}"
    );
    let whole = folder.path().join("whole.db");
    assert!(start(&whole, &["--dry-run"]).wait().unwrap().success());
    assert_eq!(state(&world(&database)), state(&world(&whole)));
}
