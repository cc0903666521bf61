//! A client that behaves as NIST's C++ library CRPI does, from the specification of the protocol:
//! one connection, documents over several lines, large numbers of commands, GetStatus with the
//! number 0 five times a second, one call of `recv` with 4096 bytes for one status, numbers of six
//! digits, and moves through waypoints with settings at each.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::crcl_client::{Answer, Scene};
use crate::crcl_motion::Recorder;

/// How often CRPI asks.
const ASK: Duration = Duration::from_millis(200);

/// Within this time a command must show in a status.
const SEEN: Duration = Duration::from_secs(3);

/// How many waypoints the circle has, its radius (mm), and the tolerance at each (mm).
const COUNT: usize = 36;
const RADIUS: f64 = 60.0;
const TOLERANCE: f64 = 2.0;

struct Crpi {
    stream: TcpStream,
    id: i64,
}

impl Crpi {
    /// Connects, and says what CRPI says first.
    fn new(scene: &Scene) -> Self {
        let stream = TcpStream::connect(scene.address()).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(3)))
            .unwrap();
        let mut crpi = Self {
            stream,
            id: 1_641_182_853,
        };
        crpi.run("InitCanon", "");
        let report = |joint: usize| {
            format!(
                "    <ConfigureJointReport>\n      <JointNumber>{joint}</JointNumber>\n      \
                 <ReportPosition>true</ReportPosition>\n      \
                 <ReportTorqueOrForce>true</ReportTorqueOrForce>\n      \
                 <ReportVelocity>true</ReportVelocity>\n    </ConfigureJointReport>\n"
            )
        };
        let reports: String = (1..=6).map(report).collect();
        let reset = "    <ResetAll>false</ResetAll>\n".to_owned();
        crpi.run("ConfigureJointReports", &(reset + &reports));
        let parts = [
            "JointStatuses",
            "PoseStatus",
            "GripperStatus",
            "SettingsStatus",
        ];
        let parts = parts.map(|part| format!("    <Report{part}>true</Report{part}>\n"));
        crpi.run("ConfigureStatusReport", &parts.concat());
        crpi
    }

    fn send(&mut self, kind: &str, id: i64, inside: &str) {
        let text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<CRCLCommandInstance \
             xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
             xsi:noNamespaceSchemaLocation=\"CRCLCommandInstance.xsd\">\n  <CRCLCommand \
             xsi:type=\"{kind}Type\">\n    <CommandID>{id}</CommandID>\n{inside}  </CRCLCommand>\n\
             </CRCLCommandInstance>"
        );
        self.stream.write_all(text.as_bytes()).unwrap();
    }

    /// Asks, and takes what one call of `recv` gives for the whole status.
    fn status(&mut self) -> Answer {
        self.send("GetStatus", 0, "");
        let mut buffer = [0; 4096];
        let count = self.stream.read(&mut buffer).unwrap();
        let text = String::from_utf8(buffer[..count].to_vec()).unwrap();
        let whole = text.starts_with("<?xml") && text.ends_with("</CRCLStatus>");
        assert!(whole, "not one status in one read: {text}");
        assert_eq!(text.matches("<CRCLStatus").count(), 1, "{text}");
        Answer(text)
    }

    /// Executes a command and waits until it is over; Ready counts as done.
    fn run(&mut self, kind: &str, inside: &str) -> Answer {
        self.id += 1;
        let id = self.id;
        self.send(kind, id, inside);
        let sent = Instant::now();
        loop {
            sleep(ASK);
            let answer = self.status();
            if answer.id() != id {
                assert!(sent.elapsed() < SEEN, "{kind} does not show: {}", answer.0);
                continue;
            }
            match answer.state() {
                "CRCL_Done" | "CRCL_Ready" => return answer,
                "CRCL_Error" => panic!("{kind}: {}", answer.why()),
                _ => assert!(
                    sent.elapsed() < Duration::from_secs(90),
                    "{kind}: {}",
                    answer.0
                ),
            }
        }
    }
}

/// A number as CRPI writes it: six digits.
fn six(value: f64) -> String {
    let text = format!("{value:.5e}");
    text.parse::<f64>().unwrap().to_string()
}

/// A pose with the tool down, turned about its axis (rad).
fn pose([x, y, z]: [f64; 3], turn: f64) -> String {
    let (sin, cos) = turn.sin_cos();
    format!(
        "      <Point>\n        <X>{}</X> <Y>{}</Y> <Z>{}</Z>\n      </Point>\n      <XAxis>\n        \
         <I>{}</I> <J>{}</J> <K>0</K>\n      </XAxis>\n      <ZAxis>\n        <I>0</I> \
         <J>-1.22465e-16</J> <K>-1</K>\n      </ZAxis>\n",
        six(x),
        six(y),
        six(z),
        six(cos),
        six(sin)
    )
}

fn near(answer: &Answer, to: [f64; 3], most: f64) {
    let point = answer.point();
    let squares = point.iter().zip(to).map(|(a, b)| (a - b) * (a - b));
    let off = squares.sum::<f64>().sqrt();
    assert!(off <= most, "{off} mm off {to:?}: {}", answer.0);
}

/// The moves of a test of moving: straight and on any way, by joints, with the gripper, settings
/// between them, each judged by the status that says it is done.
#[test]
fn a_test_of_moves_passes() {
    let scene = Scene::new("crpi_moves", &[]);
    let mut crpi = Crpi::new(&scene);
    crpi.run("Message", "    <Message>Message to operator</Message>\n");
    crpi.run("SetAngleUnits", "    <UnitName>degree</UnitName>\n");
    crpi.run("SetLengthUnits", "    <UnitName>millimeter</UnitName>\n");
    let setting = |of: &str, value: f64| {
        format!(
            "    <{of} xsi:type=\"{of}AbsoluteType\">\n      <Setting>{value}</Setting>\n    </{of}>\n"
        )
    };
    crpi.run("SetTransSpeed", &setting("TransSpeed", 300.0));
    crpi.run("SetTransAccel", &setting("TransAccel", 900.0));
    let sides =
        ["XPoint", "YPoint", "ZPoint"].map(|s| format!("      <{s}Tolerance>1</{s}Tolerance>\n"));
    let tolerance = format!("    <Tolerance>\n{}    </Tolerance>\n", sides.concat());
    crpi.run("SetEndPoseTolerance", &tolerance);
    let corners = [
        [400.0, 0.0, 400.0],
        [400.0, 150.0, 400.0],
        [450.0, 150.0, 300.0],
        [400.0, 0.0, 300.0],
    ];
    for (index, corner) in corners.into_iter().enumerate() {
        let straight = index > 0 && index % 2 == 1;
        let inside = format!(
            "    <MoveStraight>{straight}</MoveStraight>\n    <EndPosition>\n{}    </EndPosition>\n",
            pose(corner, 0.2 * index as f64)
        );
        let answer = crpi.run("MoveTo", &inside);
        near(&answer, corner, 1.0);
    }
    let before = crpi.status().joints();
    let target = before[5] + 10.0;
    let inside = format!(
        "    <ActuateJoint>\n      <JointNumber>6</JointNumber>\n      \
         <JointPosition>{}</JointPosition>\n      <JointDetails \
         xsi:type=\"JointSpeedAccelType\">\n        <JointSpeed>30</JointSpeed>\n        \
         <JointAccel>90</JointAccel>\n      </JointDetails>\n    </ActuateJoint>\n",
        six(target)
    );
    let after = crpi.run("ActuateJoints", &inside).joints();
    assert!((after[5] - target).abs() < 0.2, "{} {target}", after[5]);
    crpi.run("SetEndEffector", "    <Setting>0.5</Setting>\n");
    crpi.run("StopMotion", "    <StopCondition>Fast</StopCondition>\n");
    crpi.run("Dwell", "    <DwellTime>0.1</DwellTime>\n");
    crpi.run("EndCanon", "");
}

/// A circle of waypoints, each with its speeds, accelerations and tolerances: every box is passed in
/// order and nothing stops before the last.
#[test]
fn a_circle_of_waypoints_is_driven() {
    let scene = Scene::new("crpi_circle", &[]);
    let mut crpi = Crpi::new(&scene);
    let start = [420.0, 0.0, 350.0];
    let inside = format!(
        "    <MoveStraight>false</MoveStraight>\n    <EndPosition>\n{}    </EndPosition>\n",
        pose(start, 0.0)
    );
    near(&crpi.run("MoveTo", &inside), start, 1.0);
    let point = |index: usize| {
        let (sin, cos) = (std::f64::consts::TAU * (index + 1) as f64 / COUNT as f64).sin_cos();
        [
            start[0] + RADIUS * (cos - 1.0),
            start[1] + RADIUS * sin,
            start[2],
        ]
    };
    let own = |of: &str, value: f64| {
        format!(
            "      <{of} xsi:type=\"{of}AbsoluteType\">\n        <Setting>{value}</Setting>\n      </{of}>\n"
        )
    };
    let sides = ["XPoint", "YPoint", "ZPoint"]
        .map(|s| format!("        <{s}Tolerance>{TOLERANCE}</{s}Tolerance>\n"));
    let axes = ["XAxis", "ZAxis"].map(|s| format!("        <{s}Tolerance>5</{s}Tolerance>\n"));
    let settings = format!(
        "      <Coordinated>true</Coordinated>\n{}{}{}{}      <Tolerance>\n{}{}      </Tolerance>\n",
        own("TransSpeed", 100.0),
        own("RotSpeed", 40.0),
        own("TransAccel", 500.0),
        own("RotAccel", 200.0),
        sides.concat(),
        axes.concat()
    );
    let waypoint = |index: usize| {
        let pose = pose(point(index), 0.0);
        format!("    <Waypoint xsi:type=\"PoseAndSetType\">\n{pose}{settings}    </Waypoint>\n")
    };
    let waypoints: String = (0..COUNT).map(waypoint).collect();
    let inside = format!(
        "    <MoveStraight>true</MoveStraight>\n{waypoints}    <NumPositions>{COUNT}</NumPositions>\n"
    );
    let recorder = Recorder::start(&scene.arm);
    sleep(Duration::from_millis(100));
    near(
        &crpi.run("MoveThroughTo", &inside),
        point(COUNT - 1),
        TOLERANCE,
    );
    let way = recorder.points();
    let mut at = 0;
    let mut first = 0;
    for index in 0..COUNT {
        let inside = |p: &nalgebra::Point3<f64>| {
            let [x, y, z] = point(index);
            (p.x - x).abs().max((p.y - y).abs()).max((p.z - z).abs()) <= TOLERANCE
        };
        let passed = way[at..].iter().position(inside);
        at += passed.unwrap_or_else(|| panic!("waypoint {index} is not passed"));
        if index == 0 {
            first = at;
        }
    }
    let slowest = way[first..at]
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .fold(f64::INFINITY, f64::min);
    assert!(slowest > 1e-4, "the arm stops: a step of {slowest} mm");
}
