//! The five functions of the specification, called from a program in C.

use std::path::{Path, PathBuf};
use std::process::Command;

use plan::world::{Durability, Writer, import_toml};

use crate::fixtures::repository_text;
use crate::running::{assert_consistent, read_world};

/// The interpreter as a static library, which cargo builds with the tests of a whole package.
fn library() -> Option<PathBuf> {
    let tests = std::env::current_exe().unwrap();
    let path = tests.ancestors().nth(2)?.join("examples/libinterpreter.a");
    path.exists().then_some(path)
}

/// A controller in C pulls a plan to its end, and its commits are in the world.
#[test]
fn a_controller_in_c_pulls_a_plan() {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    if Command::new(&compiler).arg("--version").output().is_err() {
        println!("left out: there is no C compiler {compiler}");
        return;
    }
    let Some(library) = library() else {
        println!("left out: this test alone was built, without the examples");
        return;
    };
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("controller");
    let compiled = Command::new(&compiler)
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
        .arg(package.join("include"))
        .arg(package.join("tests/data/controller.c"))
        .arg(&library)
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{said}");

    let database = folder.path().join("world.db");
    let world = repository_text("examples/kitting/workstation-pddl.toml");
    Writer::open(&database, Durability::Process)
        .unwrap()
        .replace(&import_toml(&world).unwrap())
        .unwrap();
    let ran = Command::new(&program)
        .arg(&database)
        .arg(package.join("../examples/kitting/one-kit.pddl"))
        .output()
        .unwrap();
    let text = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{text}");
    let lines: Vec<&str> = text.lines().collect();
    let commands = lines.len() - 1;
    assert_eq!(
        lines[commands],
        format!("18 steps, {commands} commands, code 1")
    );
    assert_eq!(
        (lines[0], lines[commands - 1]),
        ("InitCanon ()", "EndCanon (0)")
    );
    let reading = crcl::text::read(&lines[..commands].join("\n"), &crcl::ReadOptions::default());
    assert!(!reading.has_errors(), "{text}");
    let world = read_world(&database);
    assert_consistent(&world);
    let kit = world.named("kit_1").unwrap();
    let place = world.object(kit.location.reference).unwrap();
    assert_eq!(place.name, "finished_kit_receiver");
}
