//! What clients of CRCL ask for, judged from the setpoints that the arm was given.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::Duration;

use nalgebra::{Point3, SVector};

use crate::crcl_client::{Scene, document};

/// Radius of the circle that is driven (mm).
const RADIUS: f64 = 50.0;

/// How many waypoints it has.
const COUNT: usize = 200;

/// How near each must be passed (mm).
const TOLERANCE: f64 = 2.0;

/// Everything that the engine publishes while it lives.
pub(crate) struct Recorder {
    ends: Arc<AtomicBool>,
    thread: JoinHandle<Vec<[f64; 6]>>,
}

impl Recorder {
    pub(crate) fn start(arm: &str) -> Self {
        let arm = system_tests::domain::arm(arm);
        let ends = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&ends);
        let thread = std::thread::spawn(move || {
            let observer = ipc::Observer::open(&arm).unwrap();
            let mut all = Vec::new();
            while !stop.load(Ordering::Acquire) {
                while let Some(setpoint) = observer.next_setpoint() {
                    all.push(std::array::from_fn(|joint| setpoint.position[joint]));
                }
                sleep(Duration::from_micros(500));
            }
            all
        });
        Self { ends, thread }
    }

    /// The joint positions, one row a period.
    pub(crate) fn joints(self) -> Vec<[f64; 6]> {
        self.ends.store(true, Ordering::Release);
        self.thread.join().unwrap()
    }

    /// The way of the controlled point (mm).
    pub(crate) fn points(self) -> Vec<Point3<f64>> {
        let robot = planner::robot::load("ur5e").unwrap();
        let flange_from_tool = robot.tooling().flange_from_tool();
        let chain = robot.chain::<6>().unwrap().with_tool(&flange_from_tool);
        let point = |q: &[f64; 6]| {
            let pose = chain.forward(&SVector::from(*q));
            Point3::from(pose.translation.vector * 1000.0)
        };
        self.joints().iter().map(point).collect()
    }
}

/// A circle through `start`, as points of waypoints.
fn circle(start: [f64; 3]) -> Vec<[f64; 3]> {
    let angle = |index: usize| std::f64::consts::TAU * (index + 1) as f64 / COUNT as f64;
    let point = |index: usize| {
        let (sin, cos) = angle(index).sin_cos();
        [
            start[0] + RADIUS * (cos - 1.0),
            start[1] + RADIUS * sin,
            start[2],
        ]
    };
    (0..COUNT).map(point).collect()
}

/// Every waypoint is passed within its tolerance, one after the other, and nothing stops between
/// the first and the last.
fn judge(way: &[Point3<f64>], waypoints: &[[f64; 3]]) {
    let mut at = 0;
    let mut first = 0;
    for (index, waypoint) in waypoints.iter().enumerate() {
        let waypoint = Point3::from(*waypoint);
        let near = |point: &Point3<f64>| (point - waypoint).norm() <= TOLERANCE;
        let passed = way[at..].iter().position(near);
        at += passed.unwrap_or_else(|| panic!("waypoint {index} is not passed after row {at}"));
        if index == 0 {
            first = at;
        }
    }
    let steps = way[first..at]
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .enumerate()
        // Before the first of these rows the arm rests in the ball of the first waypoint.
        .skip_while(|(_, step)| *step < 1e-4);
    let (row, slowest) = steps
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .expect("more than one row");
    // The controlled point goes at 100 mm/s; a stop would be rows without any step. Rows may be
    // missing in the recording, none is there twice.
    assert!(
        slowest > 1e-4,
        "the arm stops: a step of {slowest} mm in row {row} of {}",
        at - first
    );
}

#[test]
fn two_hundred_waypoints_are_passed_without_a_stop() {
    let scene = Scene::new("through", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    client.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>100</Setting></TransSpeed>",
    );
    let sides = ["X", "Y", "Z"]
        .map(|side| format!("<{side}PointTolerance>{TOLERANCE}</{side}PointTolerance>"));
    let tolerance = format!("<Tolerance>{}</Tolerance>", sides.concat());
    client.done("SetIntermediatePoseTolerance", 3, &tolerance);
    let home = client.status();
    let pose = home.pose();
    let axes = &pose[pose.find("</Point>").unwrap() + 8..];
    let waypoints = circle(home.point());
    let settings = format!(
        "<Coordinated>true</Coordinated><TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>100\
         </Setting></TransSpeed>{tolerance}"
    );
    // Once with the settings in force, once with settings at every pose, as CRPI does.
    for (id, kind, own) in [
        (4, "", ""),
        (5, " xsi:type=\"PoseAndSetType\"", settings.as_str()),
    ] {
        let pose = |[x, y, z]: &[f64; 3]| {
            format!(
                "<Waypoint{kind}><Point><X>{x}</X><Y>{y}</Y><Z>{z}</Z></Point>{axes}{own}</Waypoint>"
            )
        };
        let poses: String = waypoints.iter().map(pose).collect();
        let inside =
            format!("<MoveStraight>true</MoveStraight>{poses}<NumPositions>{COUNT}</NumPositions>");
        let recorder = Recorder::start(&scene.arm);
        sleep(Duration::from_millis(100));
        client.send(&document("MoveThroughTo", id, &inside));
        let answer = client.wait(id);
        assert_eq!(answer.state(), "CRCL_Done", "{}", answer.0);
        judge(&recorder.points(), &waypoints);
    }
}

#[test]
fn single_joints_go_where_they_are_told() {
    let scene = Scene::new("joints", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    let before = client.status().joints();
    let joint = |number: usize, by: f64| {
        let to = before[number - 1] + by;
        format!(
            "<ActuateJoint><JointNumber>{number}</JointNumber><JointPosition>{to}</JointPosition>\
             <JointDetails xsi:type=\"JointSpeedAccelType\"><JointSpeed>10</JointSpeed></JointDetails>\
             </ActuateJoint>"
        )
    };
    let recorder = Recorder::start(&scene.arm);
    sleep(Duration::from_millis(100));
    let after = client
        .done("ActuateJoints", 2, &(joint(1, 6.0) + &joint(5, -4.0)))
        .joints();
    let moved = [6.0, 0.0, 0.0, 0.0, -4.0, 0.0];
    for (index, by) in moved.iter().enumerate() {
        let off = (after[index] - before[index] - by).abs();
        assert!(off < 0.2, "joint {} is {off} degrees off", index + 1);
    }
    let rows = recorder.joints();
    for joint in 0..6 {
        let steps = rows
            .windows(2)
            .map(|pair| (pair[1][joint] - pair[0][joint]).abs());
        let steps: Vec<_> = steps.filter(|step| *step > 0.0).collect();
        assert_eq!(steps.is_empty(), moved[joint] == 0.0, "joint {}", joint + 1);
        // 10 degrees a second at 1 kHz; a row or two may be missing.
        let mut sorted = steps;
        sorted.sort_by(f64::total_cmp);
        let most = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0);
        assert!(
            most <= 10_f64.to_radians() * 1.001e-3,
            "joint {}: {most}",
            joint + 1
        );
    }
    // A joint that the arm does not have, and a place beyond its range, move nothing.
    client.failed("ActuateJoints", 3, &joint(1, 1e5));
    client.done("InitCanon", 4, "");
    let wrong = joint(1, 1.0).replace("<JointNumber>1<", "<JointNumber>7<");
    assert!(
        client
            .failed("ActuateJoints", 5, &wrong)
            .why()
            .contains('7')
    );
}

#[test]
fn a_gripper_opens_to_a_part_of_its_way() {
    let scene = Scene::new("gripper", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    let flags = ["Joint", "Pose", "Gripper", "Settings"];
    let flags = flags.map(|part| {
        let part = match part {
            "Joint" => "JointStatuses".to_owned(),
            other => format!("{other}Status"),
        };
        format!("<Report{part}>true</Report{part}>")
    });
    client.done("ConfigureStatusReport", 2, &flags.concat());
    for (id, setting, millimetres) in [
        (3, 0.25, 20.0),
        (4, 0.0, 0.0),
        (5, 1.0, 80.0),
        (6, 0.5, 40.0),
    ] {
        let inside = format!("<Setting>{setting}</Setting>");
        client.done("SetEndEffector", id, &inside);
        let open = client.status().number("Separation");
        assert!((open - millimetres).abs() < 0.1, "{setting}: {open} mm");
    }
}
