//! Kits that a user's command makes, compared with the design: in the world after the run, and by
//! what the simulated driver measured.
//!
//! `CANTER_PLAN_ROBOTS` names other arms than ur5e.

use std::path::Path;

use k::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use system_tests::arm::Arm;

use crate::canter::canter;
use crate::plans::{Work, objects, own, report, run, world};

/// Largest distance of the controlled point from a pose: the planned end is exact to less than a
/// micrometre, the rest is the following error of the driver (m, rad).
const END_TOLERANCE: (f64, f64) = (1e-4, 1e-3);

/// Standstill (servo ticks) in which the gripper acts: it takes 0.2 s, and a part of that later the
/// servos have settled.
const STILL: usize = 150;

/// A pose of a workstation file: millimetres and degrees.
fn pose(value: &Value) -> Isometry3<f64> {
    let numbers = |name: &str| {
        let list = value[name].as_array().map_or(&[][..], Vec::as_slice);
        let number = |index: usize| list.get(index).map_or(0.0, |x| x.as_f64().unwrap());
        Vector3::new(number(0), number(1), number(2))
    };
    let (point, rpy) = (numbers("point") / 1e3, numbers("rpy").map(f64::to_radians));
    Isometry3::from_parts(
        Translation3::from(point),
        UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z),
    )
}

/// Whether two poses are within a distance (m) and an angle (rad).
fn near(one: &Isometry3<f64>, other: &Isometry3<f64>, (distance, angle): (f64, f64)) -> bool {
    let difference = one.inv_mul(other);
    difference.translation.vector.norm() < distance && difference.rotation.angle() < angle
}

fn finished(world: &Value) -> Vec<&Value> {
    let is = |object: &&Value| object["properties"]["isKitInstance_Finished"] == true;
    objects(world).iter().filter(is).collect()
}

/// Every finished kit is in the box for kits, with each part at its pose of the design.
pub(crate) fn assert_kits(world: &Value, kits: usize) {
    let finished = finished(world);
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
            let at = |design: &&Value| {
                design["sku"] == part["properties"]["hasPart_SkuRef"]
                    && near(&pose(&part["pose"]), &pose(&design["pose"]), (1e-6, 1e-5))
            };
            let found = wanted.iter().position(at);
            wanted.remove(found.unwrap_or_else(|| panic!("{part} is at no place of the design")));
        }
        assert!(wanted.is_empty(), "{kit} lacks {wanted:?}");
    }
}

/// Where the end of the arm was measured whenever the arm stood still for some time: forward
/// kinematics by `k`.
fn rests(samples: &Path, robot: &str) -> Vec<Isometry3<f64>> {
    let arm = Arm::read(robot);
    let mut reader = csv::Reader::from_path(samples).unwrap();
    let header = reader.headers().unwrap().clone();
    let columns = |stem: &str| -> Vec<usize> {
        let at = |joint| format!("{stem}{}", joint + 1);
        let find = |name: String| header.iter().position(|column| column == name).unwrap();
        (0..arm.joints.len()).map(|joint| find(at(joint))).collect()
    };
    let (measured, speeds) = (columns("measured_q"), columns("dq"));
    let (mut still, mut rests) = (0, Vec::new());
    for record in reader.records() {
        let record = record.unwrap();
        let value = |column: &usize| record[*column].parse::<f64>().unwrap();
        let moves = speeds.iter().any(|column| value(column) != 0.0);
        still = if moves { 0 } else { still + 1 };
        if still == STILL {
            let joints: Vec<f64> = measured.iter().map(value).collect();
            rests.push(arm.flange(&joints));
        }
    }
    rests
}

/// The measured arm rested once per kit at the grasp of each part in its pose of the design, and
/// once at the grasp of each finished kit in the box. Returns the largest distance (m).
fn assert_measured(world: &Value, rests: &[Isometry3<f64>]) -> f64 {
    let named = |name: &Value| {
        let is = |object: &&Value| object["name"] == *name;
        objects(world).iter().find(is).unwrap()
    };
    let grasp = |sku: &Value| {
        let is = |known: &&Value| known["id"] == *sku;
        let known = world["sku"].as_array().unwrap().iter().find(is).unwrap();
        pose(&known["grasp"])
    };
    // Both grippers are 100 mm long.
    let tip_from_arm = Isometry3::translation(0.0, 0.0, -0.1);
    let mut worst = 0.0_f64;
    let mut times = |tip: Isometry3<f64>| {
        let wanted = tip * tip_from_arm;
        let at = |rest: &&Isometry3<f64>| near(rest, &wanted, END_TOLERANCE);
        let off = |rest: &Isometry3<f64>| (rest * tip_from_arm.inverse()).translation.vector;
        let there: Vec<_> = rests.iter().filter(at).collect();
        for rest in &there {
            worst = worst.max((off(rest) - tip.translation.vector).norm());
        }
        there.len()
    };
    let kits = finished(world);
    // Both plans put the tray here: the free place on the table.
    let tray = Isometry3::translation(0.35, 0.0, 0.0);
    for part in world["design"][0]["part"].as_array().unwrap() {
        let place = tray * pose(&part["pose"]);
        let times = times(place * grasp(&part["sku"]));
        assert_eq!(times, kits.len(), "rests at {part} of {}", rests.len());
    }
    for kit in kits {
        let place = pose(&named(&kit["reference"])["pose"]) * pose(&kit["pose"]);
        let tray = &world["design"][0]["tray"];
        assert_eq!(times(place * grasp(tray)), 1, "rests at {kit}");
    }
    worst
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
    assert_eq!(report["code"], 0);
}

/// Three kits with the simulated driver in lock-step.
#[test]
fn three_kits_are_made() {
    make_three_kits(&own());
}

/// Makes three kits with the simulated driver in lock-step, and checks what it measured.
pub(crate) fn make_three_kits(work: &Work) {
    let folder = tempfile::tempdir().unwrap();
    let robots = std::env::var("CANTER_PLAN_ROBOTS").unwrap_or_else(|_| "ur5e".into());
    for robot in robots.split(',') {
        let file = |ending: &str| folder.path().join(format!("{robot}.{ending}"));
        let (database, samples) = (file("db"), file("csv"));
        let arm = format!("plans{}/{robot}", std::process::id());
        let pairs = [
            ("--robot", robot),
            ("--arm", &arm),
            ("--keep", database.to_str().unwrap()),
            ("--samples", samples.to_str().unwrap()),
            ("--speed", "100"),
        ];
        let pairs = pairs.iter().flat_map(|(name, value)| [*name, *value]);
        let more: Vec<&str> = pairs.chain(["--lock-step", "--verbose"]).collect();
        let ran = canter(run(work, 3, &more));
        assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
        let report = report(&ran);
        assert_three_kits(&report);
        let with = ran.stderr.lines().filter_map(|l| l.strip_prefix("with "));
        // The tray gripper that brought a kit to its box takes the next tray.
        let (tray, part) = ("TrayGripper", "PartGripper");
        let wanted = [tray, part, tray, part, tray, part, tray];
        assert_eq!(with.collect::<Vec<_>>(), wanted);
        let world = world(&database);
        assert_kits(&world, 3);
        let off = 1e6 * assert_measured(&world, &rests(&samples, robot));
        let (motion, wall) = (&report["motion_s"], &report["wall_s"]);
        println!("{robot}: {motion} s of motion in {wall} s, put down within {off:.2} um");
    }
}

/// A dry run makes the same kits.
#[test]
fn a_dry_run_makes_three_kits() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("world.db");
    let keep = ["--dry-run", "--keep", database.to_str().unwrap()];
    let ran = canter(run(&own(), 3, &keep));
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    assert_three_kits(&report(&ran));
    assert_kits(&world(&database), 3);
}
