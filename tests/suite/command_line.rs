//! The command line as a user runs it: what it prints, to which stream, and with which exit code.

use crate::canter::{canter, canter_reading};

#[test]
fn help_is_an_answer() {
    let ran = canter(["--help"]);
    assert_eq!(ran.code, 0);
    assert!(ran.stdout.contains("Usage: canter"), "{}", ran.stdout);
    assert_eq!(ran.stderr, "");
}

#[test]
fn the_version_is_an_answer() {
    // A release also names its commit.
    let version = canter(["--version"]).stdout;
    let number = concat!("canter ", env!("CARGO_PKG_VERSION"));
    assert!(version.starts_with(number), "{version}");
}

#[test]
fn an_unknown_command_is_a_usage_error() {
    let ran = canter(["dance"]);
    assert_eq!(ran.code, 2);
    assert_eq!(ran.stdout, "");
    assert!(ran.stderr.contains("dance"), "{}", ran.stderr);
}

#[test]
fn every_shell_gets_completions() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let ran = canter(["completions", shell]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{shell}");
        assert!(ran.stdout.contains("completions"), "{shell}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    assert!(canter(["man"]).stdout.contains(".TH canter 1"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("man1");
    assert_eq!(canter(["man", "--folder", path.to_str().unwrap()]).code, 0);
    for page in ["canter.1", "canter-man.1", "canter-completions.1"] {
        assert!(path.join(page).exists(), "{page}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    use std::io::Read;
    let mut child = crate::canter::command(["man"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stderr = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut stderr)
        .unwrap();
    assert_eq!(
        (child.wait().unwrap().code(), stderr.as_str()),
        (Some(0), "")
    );
}

#[test]
fn shipped_robots_are_listed_and_shown() {
    let listed = canter(["robots", "list"]);
    assert_eq!((listed.code, listed.stderr.as_str()), (0, ""));
    let needed = [
        "ur5e",
        "ur10e",
        "panda",
        "fr3",
        "iiwa7",
        "iiwa14",
        "irb120",
        "tx2_60",
        "lrmate200id",
    ];
    for robot in needed {
        assert!(listed.stdout.contains(robot), "{robot}");
        let shown = canter(["robots", "show", robot, "--json"]);
        let shown: serde_json::Value = serde_json::from_str(&shown.stdout).unwrap();
        assert_eq!(shown["name"], robot);
        let mobility = &shown["mobility"];
        let [near, far] = ["nearest_m", "farthest_m"].map(|end| mobility["reach"][end].as_f64());
        assert!(near < far && far > Some(0.5), "{robot}: {mobility}");
        assert!(mobility["condition"].as_f64() > Some(1.0), "{robot}");
        assert!(mobility["manipulability"].as_f64() > Some(0.0), "{robot}");
        let joints = shown["dof"].as_u64().unwrap() as usize;
        for list in ["name", "lower", "upper", "velocity", "acceleration", "jerk"] {
            assert_eq!(
                shown["joints"][list].as_array().unwrap().len(),
                joints,
                "{robot} {list}"
            );
        }
        assert!(
            canter(["robots", "show", robot])
                .stdout
                .contains("controlled point at home")
        );
    }
}

#[test]
fn a_urdf_becomes_a_robot() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("mine");
    let urdf = "robots/ur5e/robot.urdf";
    let ran = canter([
        "robots",
        "import",
        urdf,
        "--to",
        to.to_str().unwrap(),
        "--tip",
        "flange",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stdout.contains("6 joints"), "{}", ran.stdout);
    let shown = canter(["robots", "show", to.to_str().unwrap()]);
    assert_eq!(shown.code, 0, "{}", shown.stderr);
    let again = canter([
        "robots",
        "import",
        urdf,
        "--to",
        to.to_str().unwrap(),
        "--tip",
        "flange",
    ]);
    assert_eq!(
        again.code, 3,
        "a robot.toml that may have been edited was overwritten"
    );
}

/// `canter fk` against `k` on the same file.
#[test]
fn forward_kinematics_of_a_file() {
    for robot in ["ur5e", "panda", "iiwa7", "irb120"] {
        let arm = system_tests::arm::Arm::read(robot);
        let rows: Vec<Vec<f64>> = (0..20)
            .map(|row| {
                let part = |joint: usize| 0.5 + 0.45 * ((row * 7 + joint * 3) as f64).sin();
                let at =
                    |(joint, [low, high, _]): (usize, &[f64; 3])| low + part(joint) * (high - low);
                arm.joints.iter().enumerate().map(at).collect()
            })
            .collect();
        let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let csv = rows.iter().map(line).collect::<Vec<_>>().join("\n");
        let ran = canter_reading(["fk", "--robot", robot, "--joints", "-"], csv.as_bytes());
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
        let mut lines = ran.stdout.lines();
        assert_eq!(lines.next(), Some("x_m,y_m,z_m,qw,qx,qy,qz"));
        for (row, line) in rows.iter().zip(lines) {
            let got: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let pose = arm.flange(row);
            let (p, r) = (pose.translation, pose.rotation);
            let apart = [p.x - got[0], p.y - got[1], p.z - got[2]].map(f64::abs);
            let along = (r.w * got[3] + r.i * got[4] + r.j * got[5] + r.k * got[6]).abs();
            assert!(
                apart.iter().all(|gap| *gap < 1e-12) && (along - 1.0).abs() < 1e-12,
                "{robot}"
            );
        }
    }
}

#[test]
fn a_program_is_converted_there_and_back() {
    let text = canter(["convert", "examples/pick_and_place.canon"]);
    assert_eq!((text.code, text.stderr.as_str()), (0, ""));
    let json: serde_json::Value = serde_json::from_str(&text.stdout).unwrap();
    assert_eq!(json["commands"].as_array().unwrap().len(), 24);
    let back = canter_reading(["convert", "-"], text.stdout.as_bytes());
    assert_eq!(back.code, 0, "{}", back.stderr);
    let again = canter_reading(["convert", "-"], back.stdout.as_bytes());
    assert_eq!(again.stdout, text.stdout);
    let bad = canter_reading(["convert", "-"], b"MoveTo({{1,2}})");
    assert_eq!((bad.code, bad.stdout.as_str()), (3, ""));
    let schema: serde_json::Value = serde_json::from_str(&canter(["schema"]).stdout).unwrap();
    assert_eq!(schema["title"], "Canonical robot program");
}

/// Log lines have no colours in a pipe.
#[test]
fn piped_logs_have_no_colours() {
    let ran = crate::canter::command(["robots", "list"])
        .env("CANTER_LOG", "debug")
        .env_remove("NO_COLOR")
        .output()
        .unwrap();
    let said = String::from_utf8(ran.stderr).unwrap();
    assert!(said.contains("DEBUG"), "{said}");
    assert!(!said.contains('\u{1b}'), "{said:?}");
}
