//! A run that is killed at any time can be resumed from its database.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use plan::run::{
    Batch, Cell, Controller, Motion, MotionFailure, PlanRunReport, RunOptions, SimulatedFactotum,
    SimulatedMotion, Situation, Stock, prepare,
};
use plan::world::{Durability, Reader, Writer, import_toml};

use crate::fixtures::repository_text;
use crate::running::{assert_consistent, assert_kits, read_world};

/// Name of the variable that makes the test below a child process; its value is the database.
const CHILD: &str = "CANTER_TEST_KILLED_WORLD";

/// A simulated arm that really takes a little time.
struct Slow(SimulatedMotion);

impl Motion for Slow {
    fn arm(&mut self) -> Option<Isometry3<f64>> {
        None
    }

    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let seconds = self.0.execute(start, batch)?;
        std::thread::sleep(Duration::from_millis(2));
        Ok(seconds)
    }

    fn predict(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        self.0.predict(start, batch)
    }
}

/// Starts the plan in this database, or resumes it.
fn run(path: &Path, motion: &mut dyn Motion) -> PlanRunReport {
    let source = repository_text("examples/kitting/kit-abc.plan");
    let writer = Writer::open(path, Durability::Process).unwrap();
    let world = import_toml(&repository_text("examples/kitting/workstation.toml")).unwrap();
    let (program, _) = prepare(&source, &world).unwrap();
    let last = writer.last_run().unwrap();
    let stock = match &last {
        Some(run) => serde_json::from_str(&run.stock).unwrap(),
        None => Stock::of(&world, &program.plan),
    };
    let mut factotum = SimulatedFactotum::new(stock.clone());
    let reader = Reader::open(path).unwrap();
    let cell = Cell {
        writer,
        reader,
        motion,
        factotum: &mut factotum,
    };
    let options = RunOptions::default();
    let mut controller = if last.is_some() {
        Controller::resume(cell, options).unwrap()
    } else {
        let given = BTreeMap::from([("NumberOfKitsToMake".to_owned(), "2".to_owned())]);
        Controller::start(cell, &source, &given, &stock, options).unwrap()
    };
    controller.run(&mut |_| {}).unwrap()
}

fn fresh_world(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    let mut world = import_toml(&repository_text("examples/kitting/workstation.toml")).unwrap();
    // Only two PartA, so that the run needs the factotum.
    for number in 3..=8 {
        let part = world.named(&format!("PartA_{number}")).unwrap().id;
        world.apply(&plan::world::Change::Delete(part)).unwrap();
    }
    Writer::open(&path, Durability::Process)
        .unwrap()
        .replace(&world)
        .unwrap();
    path
}

/// Not a test of its own: what the test below starts and kills.
#[test]
fn child() {
    if let Some(path) = std::env::var_os(CHILD) {
        run(Path::new(&path), &mut Slow(SimulatedMotion::default()));
    }
}

fn spawn(path: &Path) -> std::process::Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "killed::child", "--nocapture"])
        .env(CHILD, path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Killed at 50 times: the database opens, is consistent, and the resumed run has the same result.
#[test]
fn a_killed_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fresh_world(folder.path(), "whole.db");
    let began = Instant::now();
    assert!(spawn(&whole).wait().unwrap().success());
    let length = began.elapsed();
    let expected = read_world(&whole);
    assert_kits(&expected, 2);
    let mut cut = 0;
    // Moments spread over the run by the golden ratio, the same each time.
    for number in 1..=50_u32 {
        let path = fresh_world(folder.path(), &format!("{number}.db"));
        let mut process = spawn(&path);
        std::thread::sleep(length.mul_f64((f64::from(number) * 0.618_033_988_75).fract()));
        process.kill().unwrap();
        process.wait().unwrap();
        let halfway = read_world(&path);
        assert_consistent(&halfway);
        let last = Writer::open(&path, Durability::Process)
            .unwrap()
            .last_run()
            .unwrap();
        if last.as_ref().is_none_or(|run| run.outcome.is_none()) {
            cut += usize::from(last.is_some());
            let report = run(&path, &mut SimulatedMotion::default());
            assert_eq!(
                (report.outcome, report.counters.kits),
                ("stopped", 2),
                "{report:#?}"
            );
        }
        let world = read_world(&path);
        crate::world::assert_same(&expected, &world);
        assert_consistent(&world);
    }
    println!("50 kills, {cut} of them in the middle of the run, which takes {length:?}");
    assert!(cut > 10, "only {cut} kills hit the run");
}
