//! Robot folders: the shipped ones, broken ones, imported ones.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::{SMatrix, Vector3};
use planner::robot::{self, RobotError};
use std::path::{Path, PathBuf};

/// Direction of the flange and manipulability (lengths in units of 0.3 m) at home.
fn at_home<const N: usize>(robot: &robot::Robot) -> (Vector3<f64>, f64) {
    let (pose, mut jacobian) = robot
        .chain::<N>()
        .unwrap()
        .jacobian(&robot::vector(&robot.home));
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / 0.3);
    let square: SMatrix<f64, 6, 6> = jacobian * jacobian.transpose();
    (
        pose.rotation * Vector3::z(),
        square.symmetric_eigenvalues().min().max(0.0).sqrt(),
    )
}

#[test]
fn shipped_robots_load_and_stand_well_at_home() {
    assert!(robot::list().len() >= 14);
    for name in robot::list() {
        let robot = robot::load(name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(robot.name, name);
        assert_eq!(robot.joints.jerk.len(), robot.dof());
        assert_eq!(robot.mounted, Some(0), "{name}");
        let (approach, smallest) = match robot.dof() {
            6 => at_home::<6>(&robot),
            7 => at_home::<7>(&robot),
            dof => panic!("{name}: {dof} joints"),
        };
        assert!(
            (approach + Vector3::z()).norm() < 0.01,
            "{name}: flange looks along {approach}"
        );
        assert!(
            smallest > 0.15,
            "{name}: nearly singular at home, {smallest}"
        );
    }
}

/// Published limits of the URDF go before the defaults.
#[test]
fn published_limits_are_kept() {
    let panda = robot::load("panda").unwrap();
    assert_eq!(panda.joints.acceleration[1], 7.5);
    assert_eq!(panda.joints.jerk[6], 10_000.0);
    assert_eq!(robot::load("ur5e").unwrap().joints.source, "canter default");
}

/// The margin makes the limits that are planned with, and the maker's are known.
#[test]
fn the_margin_is_planned_with() {
    let fr3 = robot::load("fr3").unwrap();
    let maker = fr3.joints.of_the_maker();
    assert!((fr3.joints.acceleration[0] - 8.0).abs() < 1e-12);
    assert!((maker.acceleration[0] - 10.0).abs() < 1e-12);
    assert!((fr3.joints.jerk[3] - 0.5 * maker.jerk[3]).abs() < 1e-9);
    assert!((fr3.joints.velocity[6] - 0.9 * maker.velocity[6]).abs() < 1e-12);
    let ur5e = robot::load("ur5e").unwrap();
    assert_eq!(ur5e.joints.of_the_maker(), ur5e.joints);
    let old = "[joints]\n";
    for (name, bad) in [("zero", "0.0"), ("more", "1.01"), ("nan", "nan")] {
        let new = format!("[joints]\nmargin.jerk = {bad}\n");
        let folder = folder(&format!("margin-{name}"), old, &new);
        let error = robot::load(folder.to_str().unwrap()).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("a share above 0 and at most 1"), "{text}");
    }
}

fn shipped(file: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../robots/ur5e")
        .join(file);
    std::fs::read_to_string(path).unwrap()
}

/// A folder with the UR5e in which one piece of `robot.toml` is replaced.
fn folder(name: &str, old: &str, new: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("canter-robot-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let toml = shipped("robot.toml");
    assert!(
        toml.contains(old),
        "the test replaces text that is not there: {old}"
    );
    std::fs::write(folder.join("robot.toml"), toml.replacen(old, new, 1)).unwrap();
    std::fs::write(folder.join("robot.urdf"), shipped("robot.urdf")).unwrap();
    folder
}

#[test]
fn faults_of_robot_toml_name_the_place() {
    let cases = [
        (
            "\nspeed_m_per_s = 1.0",
            "\nspeed_m_per_s = -1.0",
            "tool_limits.speed_m_per_s: expected a positive finite number, found -1.0",
        ),
        (
            "\nspeed_m_per_s = 1.0",
            "\nspeed_m_per_s = \"fast\"",
            ":15:17: invalid type: string \"fast\", expected f64",
        ),
        (
            "\nspeed_m_per_s",
            "\nspeed_mm_per_s",
            "unknown field `speed_mm_per_s`, expected one of",
        ),
        (
            "jerk_per_s3 = [100.0, ",
            "jerk_per_s3 = [",
            "joints.jerk_per_s3: expected 6 numbers, one per joint",
        ),
        (
            "jerk_per_s3",
            "velocity_per_s",
            "joints.jerk_per_s3: expected a value for joint \"joint_1\", as its URDF has none, found no such key",
        ),
        (
            "[0.0, -1.570796",
            "[7.0, -1.570796",
            "home.joints_rad_or_m: expected joint \"joint_1\" from -6.28",
        ),
        (
            "mounted = \"gripper\"",
            "mounted = \"hammer\"",
            ":3:11: mounted: expected the name of an end effector of this file, found \"hammer\"",
        ),
        (
            "name = \"vacuum\"",
            "name = \"gripper\"",
            "expected a name that no other end effector has",
        ),
        (
            "closing_s = 0.4\n",
            "",
            "expected both opening_s and closing_s, or neither",
        ),
        (
            "position_m = [0.0, 0.0, 0.0]",
            "position_m = [0.0, nan, 0.0]",
            "base.position_m: expected three numbers",
        ),
        (
            "tip_link = \"flange\"",
            "tip_link = \"hand\"",
            "robot.urdf:tip link \"hand\" does not exist",
        ),
        ("[home]", "[home", "robot.toml:"),
    ];
    for (index, (old, new, expected)) in cases.into_iter().enumerate() {
        let folder = folder(&index.to_string(), old, new);
        let error = robot::load(folder.to_str().unwrap())
            .expect_err(expected)
            .to_string();
        assert!(
            error.contains(expected),
            "expected: {expected}\nfound:    {error}"
        );
        assert!(
            error.contains("robot.toml:") || error.contains("robot.urdf:"),
            "{error}"
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}

#[test]
fn unknown_robots_are_named() {
    let error = robot::load("ur6").unwrap_err();
    assert!(matches!(&error, RobotError::Unknown { .. }));
    assert!(error.to_string().contains("ur5e"), "{error}");
    assert!(matches!(
        robot::load("/no/such/folder"),
        Err(RobotError::Read { .. })
    ));
}

/// A URDF on its own becomes a folder that loads, once.
#[test]
fn a_urdf_is_imported() {
    let folder = std::env::temp_dir().join(format!("canter-import-{}", std::process::id()));
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../robots/fr3/robot.urdf");
    let robot = robot::import(&file, &folder, None).unwrap();
    assert_eq!(robot.dof(), 7);
    assert_eq!(robot.joints.acceleration, vec![10.0; 7]);
    let again = robot::import(&file, &folder, None).unwrap_err();
    assert!(again.to_string().contains("exists already"), "{again}");
    assert!(robot::import(Path::new("none.urdf"), &folder, None).is_err());
    std::fs::remove_dir_all(folder).unwrap();
}

/// Damaged `robot.toml` files: an answer or an error, never a panic.
#[test]
fn damaged_files_are_answered() {
    let (urdf, toml) = (shipped("robot.urdf"), shipped("robot.toml"));
    let count = std::env::var("CANTER_FUZZ_CASES")
        .ok()
        .and_then(|count| count.parse().ok());
    let mut state = 51_u64;
    let mut draw = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let pieces = [
        "nan",
        "inf",
        "-1",
        "[[",
        "]",
        "=",
        "\"",
        "#",
        "1e999",
        "\u{0}",
        "mounted = 3\n",
    ];
    let (mut read, mut refused) = (0, 0);
    for _ in 0..count.unwrap_or(1000) {
        let mut bytes = toml.as_bytes().to_vec();
        for _ in 0..=draw(4) {
            let from = draw(bytes.len());
            let to = (from + draw(12)).min(bytes.len());
            bytes.splice(from..to, pieces[draw(pieces.len())].bytes());
        }
        match robot::parse("fuzz", &urdf, &String::from_utf8_lossy(&bytes)) {
            Ok(robot) => read += usize::from(robot.dof() == 6),
            Err(error) => refused += usize::from(!error.to_string().is_empty()),
        }
    }
    assert_eq!(read + refused, count.unwrap_or(1000));
    assert!(read > 0 && refused > 0, "{read} read, {refused} refused");
}
