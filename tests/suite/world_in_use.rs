//! A world that is in use: a second writer is refused, and a lost file ends the run.

use std::fs::File;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use system_tests::killed::Killed;

use crate::canter::{canter, command};
use crate::killed_plans::moving;
use crate::plans::{PLAN, WORLD, world};

/// A run of a plan, killed when it is dropped.
struct Run {
    process: Killed,
    stderr: std::path::PathBuf,
}

impl Run {
    /// Imports the world into a new database, starts a run of three kits in it and waits until it
    /// has done a few statements.
    fn start(database: &Path, name: &str) -> Self {
        let path = database.to_str().unwrap();
        let imported = canter(["world", "import", WORLD, path]);
        assert_eq!(imported.code, 0, "{}", imported.stderr);
        let stderr = database.with_extension("log");
        let arm = format!("inuse{}/{name}", std::process::id());
        let plan = ["plan-run", PLAN, "--world", path, "--robot", "ur5e"];
        let how = [
            "--set",
            "NumberOfKitsToMake=3",
            "--lock-step",
            "--arm",
            &arm,
        ];
        let process = command(plan.iter().chain(&how))
            .stdout(Stdio::null())
            .stderr(File::create(&stderr).unwrap())
            .spawn()
            .unwrap();
        let process = Killed(process);
        moving(path, 3);
        Self { process, stderr }
    }

    /// Its exit code, which must come soon, and what it said.
    fn end(&mut self) -> (Option<i32>, String) {
        let deadline = Instant::now() + Duration::from_secs(120);
        while Instant::now() < deadline {
            if let Some(status) = self.process.try_wait().unwrap() {
                let said = std::fs::read_to_string(&self.stderr).unwrap();
                return (status.code(), said);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("the run does not end");
    }
}

/// While a plan runs in a database, no other process writes it, and the error names the holder.
/// When the holder is killed, the database is free and consistent, and the run can be resumed.
#[test]
fn a_second_writer_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let path = database.to_str().unwrap();
    let mut first = Run::start(&database, "holder");
    let attempts = [
        vec!["plan-run", PLAN, "--world", path, "--robot", "ur5e"],
        vec!["plan-run", "--resume", "--world", path, "--robot", "ur5e"],
        vec!["world", "import", WORLD, path],
    ];
    for attempt in attempts {
        let ran = canter(&attempt);
        assert_eq!(ran.code, 1, "{attempt:?}: {}", ran.stderr);
        let holder = format!("plan-run, process {}", first.process.id());
        let told = ran.stderr.contains("is in use by") && ran.stderr.contains(&holder);
        assert!(told, "{attempt:?}: {}", ran.stderr);
    }
    assert_eq!(canter(["world", "show", path]).code, 0, "reading is free");
    assert!(
        first.process.try_wait().unwrap().is_none(),
        "the run goes on"
    );
    drop(first);
    drop(world(&database));
    let go_on = ["plan-run", "--resume", "--world", path, "--robot", "ur5e"];
    let ran = canter(go_on.iter().chain(&["--dry-run"]));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
}

/// How a database is lost.
type Loss = fn(&Path);

/// A database that is deleted, or replaced by another, ends the run with an error that says so.
#[test]
fn a_lost_world_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let ways: [(&str, Loss); 2] = [
        ("was deleted", |path| std::fs::remove_file(path).unwrap()),
        ("was replaced", |path| {
            let other = path.with_extension("other");
            std::fs::copy(path, &other).unwrap();
            std::fs::rename(&other, path).unwrap();
        }),
    ];
    for (number, (said, lose)) in ways.into_iter().enumerate() {
        let database = folder.path().join(format!("{number}.db"));
        let mut run = Run::start(&database, &number.to_string());
        lose(&database);
        let (code, stderr) = run.end();
        assert_eq!(code, Some(3), "{stderr}");
        let named = stderr.contains(&format!("{number}.db {said}"));
        assert!(named, "{stderr}");
    }
}
