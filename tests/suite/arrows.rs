//! Crates depend on each other only as listed here, and some external crates are used in one place
//! only.

use std::fs;

use system_tests::repository::root;
use toml::{Table, Value};

/// The dependencies that are allowed between crates of Canter. `system-tests` and `benches` may
/// depend on everything.
const ARROWS: [(&str, &[&str]); 26] = [
    (
        "cli",
        &[
            "plan",
            "engine",
            "servo",
            "planner",
            "measure",
            "crcl",
            "crcl-tcp",
            "kinematics",
            "trajectory",
            "ipc",
            "recorder",
            "view",
            "scheduling",
            "driver-sim",
            "driver-franka",
            "driver-ur",
            "driver-kuka",
            "driver-cia402",
            "driver-conformance",
        ],
    ),
    (
        "canter-python",
        &[
            "planner",
            "crcl",
            "kinematics",
            "trajectory",
            "realtime",
            "ipc",
            "scheduling",
        ],
    ),
    (
        "view",
        &["planner", "crcl", "ipc", "recorder", "scheduling"],
    ),
    ("measure", &["planner", "kinematics", "trajectory"]),
    ("plan", &["crcl"]),
    ("crcl-tcp", &["crcl", "ipc"]),
    ("canter-ros2", &["ipc", "scheduling"]),
    ("canter-fleet", &["ipc"]),
    (
        "engine",
        &[
            "plan",
            "planner",
            "servo",
            "crcl",
            "kinematics",
            "trajectory",
            "realtime",
            "ipc",
            "recorder",
            "scheduling",
        ],
    ),
    ("servo", &["realtime", "ipc", "scheduling"]),
    ("planner", &["crcl", "kinematics", "trajectory", "realtime"]),
    ("trajectory", &["realtime", "simd"]),
    ("driver-kit", &["ipc", "scheduling"]),
    ("driver-sim", &["driver-kit", "ipc", "scheduling"]),
    ("driver-franka", &["driver-kit", "ipc", "scheduling"]),
    ("driver-ur", &["driver-kit", "ipc", "scheduling"]),
    ("driver-kuka", &["driver-kit", "ipc", "scheduling"]),
    ("driver-cia402", &["driver-kit", "ipc", "scheduling"]),
    ("driver-conformance", &["ipc", "scheduling"]),
    ("crcl", &[]),
    ("kinematics", &["simd"]),
    ("simd", &[]),
    ("realtime", &[]),
    ("ipc", &[]),
    ("recorder", &[]),
    ("scheduling", &[]),
];

/// External crates that only these crates of Canter may name. That the planner starts no thread and
/// reads no clock is not in a manifest: see [`the_planner_is_pure`].
const FENCES: [(&str, &[&str]); 20] = [
    ("k", &["kinematics"]),
    ("faer", &["trajectory"]),
    ("pulp", &["simd"]),
    ("iceoryx2", &["ipc"]),
    ("rusqlite", &["plan"]),
    ("anyhow", &["cli"]),
    ("clap", &["cli", "canter-ros2", "canter-fleet"]),
    ("mcap", &["recorder"]),
    ("tungstenite", &["view"]),
    ("httparse", &["view"]),
    ("pyo3", &["canter-python"]),
    ("numpy", &["canter-python"]),
    ("ros2-client", &["canter-ros2"]),
    ("socket2", &["canter-ros2"]),
    ("zenoh", &["canter-fleet"]),
    ("ratatui", &["canter-fleet"]),
    ("rcgen", &["canter-fleet"]),
    (
        "rtrb",
        &[
            "servo",
            "driver-franka",
            "driver-ur",
            "driver-kuka",
            "driver-cia402",
        ],
    ),
    (
        "libc",
        &["ipc", "scheduling", "driver-cia402", "driver-franka"],
    ),
    ("ethercrab", &["driver-cia402"]),
];

const OUTERMOST: [&str; 2] = ["system-tests", "benches"];

/// Forbidden dependencies in the manifest of a crate; development dependencies are not checked.
fn violations(manifest: &Table) -> Vec<String> {
    let name = manifest["package"]["name"].as_str().unwrap();
    if OUTERMOST.contains(&name) {
        return Vec::new();
    }
    let Some((_, allowed)) = ARROWS.iter().find(|(from, _)| *from == name) else {
        return vec![format!("{name} has no place in the order of the crates")];
    };
    let mut found = Vec::new();
    for dependency in dependencies(manifest) {
        let ours = ARROWS
            .iter()
            .any(|(crate_of_ours, _)| *crate_of_ours == dependency);
        if (ours && !allowed.contains(&dependency.as_str()))
            || OUTERMOST.contains(&dependency.as_str())
        {
            found.push(format!("{name} must not depend on {dependency}"));
        }
        if let Some((fenced, only)) = FENCES.iter().find(|(fenced, _)| *fenced == dependency)
            && !only.contains(&name)
        {
            let only = only.join(" and ");
            found.push(format!(
                "{fenced} may be used by {only} only, not by {name}"
            ));
        }
    }
    found
}

/// The normal and build dependencies by package name, those for one platform included.
fn dependencies(manifest: &Table) -> Vec<String> {
    let mut tables = vec![manifest];
    if let Some(targets) = manifest.get("target").and_then(Value::as_table) {
        tables.extend(targets.values().filter_map(Value::as_table));
    }
    tables
        .into_iter()
        .flat_map(|table| ["dependencies", "build-dependencies"].map(|kind| table.get(kind)))
        .filter_map(|table| table?.as_table())
        .flatten()
        .map(|(key, value)| {
            value
                .get("package")
                .and_then(Value::as_str)
                .unwrap_or(key)
                .to_owned()
        })
        .collect()
}

/// The manifests of all members of the workspace.
fn manifests() -> Vec<Table> {
    let read = |path: std::path::PathBuf| -> Table {
        let text = fs::read_to_string(&path).unwrap();
        text.parse()
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let workspace = read(root().join("Cargo.toml"));
    let members = workspace["workspace"]["members"].as_array().unwrap();
    members
        .iter()
        .map(|member| read(root().join(member.as_str().unwrap()).join("Cargo.toml")))
        .collect()
}

#[test]
fn arrows_point_down() {
    let manifests = manifests();
    assert!(manifests.len() >= ARROWS.len(), "members are missing");
    let found: Vec<_> = manifests.iter().flat_map(violations).collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_wrong_arrow_is_seen() {
    let check = |text: &str| violations(&text.parse().unwrap());
    assert_eq!(
        check("[package]\nname = 'realtime'\n[dependencies]\nkinematics.workspace = true"),
        ["realtime must not depend on kinematics"]
    );
    assert_eq!(
        check(
            "[package]\nname = 'crcl'\n[target.'cfg(unix)'.dependencies]\nx = { package = 'ipc' }"
        ),
        ["crcl must not depend on ipc"]
    );
    assert_eq!(
        check("[package]\nname = 'engine'\n[build-dependencies]\niceoryx2 = '1'"),
        ["iceoryx2 may be used by ipc only, not by engine"]
    );
    assert_eq!(
        check("[package]\nname = 'common'"),
        ["common has no place in the order of the crates"]
    );
    assert!(check("[package]\nname = 'plan'\n[dependencies]\ncrcl.workspace = true").is_empty());
}

/// What the sources of a pure crate must not name: threads, clocks, channels, atomics, processes.
const IMPURE: [&str; 8] = [
    "std::thread",
    "std::time",
    "core::time",
    "std::sync",
    "core::sync",
    "std::process",
    "std::env",
    "unsafe ",
];

/// The first forbidden name in this source.
fn impurity(text: &str) -> Option<&'static str> {
    let code = text
        .lines()
        .filter_map(|line| line.split("//").next())
        .collect::<Vec<_>>();
    IMPURE
        .into_iter()
        .find(|name| code.iter().any(|line| line.contains(name)))
}

#[test]
fn the_planner_is_pure() {
    for folder in [
        "planner/src",
        "trajectory/src",
        "kinematics/src",
        "simd/src",
    ] {
        for path in sources(folder) {
            let found = impurity(&fs::read_to_string(&path).unwrap());
            assert_eq!(found, None, "{}", path.display());
        }
    }
    assert_eq!(
        impurity("fn f() {\n    std::thread::spawn(|| ());\n}"),
        Some("std::thread")
    );
    assert_eq!(impurity("// std::thread"), None);
}

/// What the sources of the command line must not contain: code that chooses a motion by the arm,
/// makes commands, plans one command, or waits for a session by itself.
const MOTION_DECISIONS: [&str; 9] = [
    ".dof() <",
    ".dof() >",
    ".dof() ==",
    ".dof() !=",
    "Command::Move",
    "planner::controller",
    "planner::way",
    "host.turn(",
    "session.note(",
];

/// The first of these in the code of a source, without comments.
fn motion_decision(text: &str) -> Option<&'static str> {
    let code: Vec<_> = text
        .lines()
        .filter_map(|line| line.split("//").next())
        .collect();
    MOTION_DECISIONS
        .into_iter()
        .find(|name| code.iter().any(|line| line.contains(name)))
}

#[test]
fn the_command_line_decides_nothing_about_motion() {
    for path in sources("cli/src") {
        let found = motion_decision(&fs::read_to_string(&path).unwrap());
        assert_eq!(found, None, "{}", path.display());
    }
    assert_eq!(
        motion_decision("    straight: robot.dof() <= 6,"),
        Some(".dof() <")
    );
    assert_eq!(
        motion_decision("    let note = host.turn()?;"),
        Some("host.turn(")
    );
    assert_eq!(motion_decision("// robot.dof() <= 6"), None);
}

/// Inside crates: only one file uses `k`, and the real-time crate has no heap.
#[test]
fn fences_inside_crates_hold() {
    let urdf = root().join("kinematics/src/urdf.rs");
    for path in sources("kinematics/src") {
        let text = fs::read_to_string(&path).unwrap();
        let names_k = text.lines().any(names_crate_k);
        assert!(!names_k || path == urdf, "{} names k", path.display());
    }
    let realtime = fs::read_to_string(root().join("realtime/src/lib.rs")).unwrap();
    assert!(realtime.contains("#![no_std]"), "realtime must be no_std");
    assert!(names_crate_k("use k::Chain;") && names_crate_k("    let x = k::Chain::new();"));
    assert!(!names_crate_k("let x = rank::of(y);") && !names_crate_k("// k::Chain"));
}

/// Whether code of this line names the crate `k`.
fn names_crate_k(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or(line);
    code.match_indices("k::").any(|(at, _)| {
        !code[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_')
    })
}

/// All Rust files under a folder of the repository.
fn sources(folder: &str) -> Vec<std::path::PathBuf> {
    let mut folders = vec![root().join(folder)];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files
}
