//! One writer of a world at a time, and database files that are removed during a run.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use plan::PlanError;
use plan::world::{Change, Durability, Reader, Writer, import_toml};

use crate::fixtures::repository_text;

/// Name of the variable that makes the test below a child process; its value is the database.
const CHILD: &str = "CANTER_TEST_HELD_WORLD";

fn world(folder: &Path) -> PathBuf {
    let path = folder.join("world.db");
    let model = import_toml(&repository_text("examples/kitting/workstation.toml")).unwrap();
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    writer.replace(&model).unwrap();
    path
}

/// Not a test of its own: a writer that holds the database until it is killed.
#[test]
fn child() {
    if let Some(path) = std::env::var_os(CHILD) {
        let _writer = Writer::open(Path::new(&path), Durability::Process).unwrap();
        println!("held");
        std::thread::sleep(Duration::from_secs(600));
    }
}

#[test]
fn a_second_writer_is_refused_by_name_until_the_first_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let path = world(folder.path());
    let link = folder.path().join("link.db");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    let mut holder = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "writers::child", "--nocapture"])
        .env(CHILD, &path)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut said = std::io::BufReader::new(holder.stdout.take().unwrap());
    let mut line = String::new();
    while !line.ends_with("held\n") {
        assert!(std::io::BufRead::read_line(&mut said, &mut line).unwrap() > 0);
    }
    for name in [&path, &link] {
        let error = Writer::open(name, Durability::Process).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, PlanError::InUse { .. }), "{text}");
        assert!(text.contains(&format!("process {}", holder.id())), "{text}");
    }
    // Readers are free.
    Reader::open(&path).unwrap().model().unwrap();
    holder.kill().unwrap();
    holder.wait().unwrap();
    let writer = Writer::open(&path, Durability::Process).unwrap();
    let own = Writer::open(&path, Durability::Process)
        .unwrap_err()
        .to_string();
    assert!(
        own.contains(&format!("process {}", std::process::id())),
        "{own}"
    );
    drop(writer);
    let mut names: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        ["link.db", "world.db"],
        "nothing else is left behind"
    );
}

#[test]
fn a_database_with_two_names_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = world(folder.path());
    let second = folder.path().join("second.db");
    std::fs::hard_link(&path, &second).unwrap();
    let text = Writer::open(&path, Durability::Process)
        .unwrap_err()
        .to_string();
    assert!(text.contains("2 names (hard links)"), "{text}");
}

/// What is done to an open database, and what the writer says about it.
fn spoilt(spoil: &dyn Fn(&Path)) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = world(folder.path());
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    writer.commit(&[], None).unwrap();
    let arm = Change::Arm(nalgebra::Isometry3::identity());
    writer.commit(std::slice::from_ref(&arm), None).unwrap();
    spoil(&path);
    let error = writer.commit(&[arm], None).unwrap_err();
    assert!(matches!(error, PlanError::Lost { .. }), "{error}");
    error.to_string()
}

#[test]
fn a_lost_or_changed_database_is_noticed() {
    let beside = |path: &Path, suffix: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        PathBuf::from(name)
    };
    let deleted = spoilt(&|path| std::fs::remove_file(path).unwrap());
    assert!(deleted.contains("world.db was deleted"), "{deleted}");
    let moved = spoilt(&|path| std::fs::rename(path, beside(path, ".old")).unwrap());
    assert!(moved.contains("world.db was deleted or moved"), "{moved}");
    let replaced = spoilt(&|path| {
        let other = beside(path, ".other");
        std::fs::copy(path, &other).unwrap();
        std::fs::rename(&other, path).unwrap();
    });
    assert!(
        replaced.contains("was replaced by another file"),
        "{replaced}"
    );
    let log = spoilt(&|path| std::fs::remove_file(beside(path, "-wal")).unwrap());
    assert!(log.contains("world.db-wal was deleted"), "{log}");
    let lock = spoilt(&|path| std::fs::remove_file(beside(path, "-lock")).unwrap());
    assert!(lock.contains("lost its lock file"), "{lock}");
    let overwritten = spoilt(&|path| {
        let text = std::fs::read(path).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        std::fs::write(path, text).unwrap();
    });
    assert!(
        overwritten.contains("was written by another program"),
        "{overwritten}"
    );
    let changed = spoilt(&|path| {
        let other = rusqlite::Connection::open(path).unwrap();
        other
            .execute("UPDATE workstation SET revision = 0", [])
            .unwrap();
        // Closing it must not change the database file itself.
        std::mem::forget(other);
    });
    assert!(
        changed.contains("was changed by another program"),
        "{changed}"
    );
}
