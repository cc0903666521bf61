//! Guards, sensors, loops and programs of the robot over CRCL.

use crate::crcl_client::{Answer, Connection, Scene, document};

/// Height of the table above the base (mm).
const TABLE: f64 = 200.0;

fn scene(name: &str) -> Scene {
    let wall = format!("--wall=0,0,{},0,0,1,20000", TABLE / 1000.0);
    Scene::with_engine(name, &[&wall], &[])
}

/// A straight move to this height above a place of the table, with this in front of it.
fn down(id: i64, before: &str, z: f64) -> String {
    let inside = format!(
        "{before}<MoveStraight>true</MoveStraight><EndPosition><Point><X>400</X><Y>0</Y><Z>{z}</Z>\
         </Point><XAxis><I>1</I><J>0</J><K>0</K></XAxis><ZAxis><I>0</I><J>0</J><K>-1</K></ZAxis>\
         </EndPosition>"
    );
    document("MoveTo", id, &inside)
}

fn guard(sensor: &str, limit: f64, more: &str) -> String {
    format!(
        "<Guard>{sensor}<LimitType>OVER_MAX</LimitType><LimitValue>{limit}</LimitValue>{more}</Guard>"
    )
}

const WRENCH: &str = "<SensorID>wrench</SensorID><SubField>Fz</SubField>";

fn goes(client: &mut Connection, id: i64, text: &str) -> Answer {
    client.send(text);
    let answer = client.wait(id);
    assert_eq!(answer.state(), "CRCL_Done", "{}", answer.0);
    answer
}

fn begin(client: &mut Connection) {
    client.done("InitCanon", 1, "");
    client.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>100</Setting></TransSpeed>",
    );
    let flags = ["Joint", "Pose", "Gripper", "Settings", "Sensors", "Guards"].map(|part| {
        let end = if matches!(part, "Joint") {
            "Statuses"
        } else {
            "Status"
        };
        format!("<Report{part}{end}>true</Report{part}{end}>")
    });
    client.done("ConfigureStatusReport", 3, &flags.concat());
    goes(client, 4, &down(4, "", TABLE + 60.0));
}

/// A guarded move down to a table is done where it touches it, and says how far it may go on, how
/// far it went, and the peak.
#[test]
fn a_guarded_move_stops_at_the_table() {
    let scene = scene("guarded");
    let mut client = scene.connect();
    begin(&mut client);
    let status = client.status();
    let ids: Vec<_> = status.0.matches("<SensorID>wrench</SensorID>").collect();
    assert_eq!(ids.len(), 1, "{}", status.0);
    let above = status.number("ScalarValue.");
    assert!(above.abs() < 1.0, "{}", status.0);
    let answer = goes(
        &mut client,
        5,
        &down(5, &guard(WRENCH, 10.0, ""), TABLE - 60.0),
    );
    let [_, _, z] = answer.point();
    assert!(z < TABLE && z > TABLE - 8.0, "stopped at {z}");
    for words in ["tripped at", "stopped within", "its limits allow", "peak"] {
        assert!(answer.why().contains(words), "{}", answer.why());
    }
    let number = |before: &str| -> f64 {
        let rest = answer.why().split_once(before).unwrap().1.trim_start();
        rest.split([' ', ';']).next().unwrap().parse().unwrap()
    };
    let [stopped, allowed] = [number("stopped within"), number("limits allow")];
    assert!(stopped <= allowed && allowed < 20.0, "{}", answer.why());
    assert_eq!(answer.number("TriggerCount"), 1.0);
    assert!(answer.number("TriggerValue") > 10.0);
    // The same in pounds, as an error; every later command is one until InitCanon.
    goes(&mut client, 6, &down(6, "", TABLE + 60.0));
    client.done("SetForceUnits", 7, "<UnitName>pound</UnitName>");
    let error = "<ErrorOnTrigger>true</ErrorOnTrigger>";
    client.send(&down(8, &guard(WRENCH, 2.0, error), TABLE - 60.0));
    let answer = client.wait(8);
    assert_eq!(answer.state(), "CRCL_Error", "{}", answer.0);
    assert!(answer.why().contains("tripped at"), "{}", answer.why());
    assert!(answer.number("TriggerValue") > 2.0 && answer.number("TriggerValue") < 4.0);
    client.done("InitCanon", 9, "");
    goes(&mut client, 10, &down(10, "", TABLE + 60.0));
}

/// What no driver measures, and what cannot be guarded, is an error and moves nothing.
#[test]
fn a_guard_that_cannot_be_is_an_error() {
    let scene = scene("unguarded");
    let mut client = scene.connect();
    begin(&mut client);
    let before = client.status().joints();
    let nothing = guard("<SensorID>nothing</SensorID>", 1.0, "");
    client.send(&down(5, &nothing, TABLE + 30.0));
    let answer = client.wait(5);
    assert_eq!(answer.state(), "CRCL_Error", "{}", answer.0);
    assert!(answer.why().contains("nothing"), "{}", answer.why());
    let after = client.status().joints();
    let moved = after.iter().zip(&before).map(|(a, b)| (a - b).abs());
    assert!(moved.fold(0.0, f64::max) < 1e-3, "{before:?} {after:?}");
    client.done("InitCanon", 6, "");
    let guarded = guard(WRENCH, 1.0, "") + "<UnitName>inch</UnitName>";
    let answer = client.failed("SetLengthUnits", 7, &guarded);
    assert!(answer.why().contains("neither moves"), "{}", answer.why());
    client.done("InitCanon", 8, "");
    client.done("EnableSensor", 9, "<SensorID>digital_input_0</SensorID>");
    assert!(client.status().0.contains("<On>false</On>"));
    client.done("DisableSensor", 10, "<SensorID>wrench</SensorID>");
    assert!(!client.status().0.contains("<SensorID>wrench</SensorID>"));
    let answer = client.failed("EnableSensor", 11, "<SensorID>camera</SensorID>");
    assert!(answer.why().contains("camera"), "{}", answer.why());
}

/// A block is executed as often as its end says, and a program of the robot's own language runs.
#[test]
fn blocks_and_programs_of_the_robot_are_executed() {
    let scene = scene("blocks");
    let mut client = scene.connect();
    begin(&mut client);
    client.done("LoopBlockStart", 5, "<LoopName>a</LoopName>");
    goes(&mut client, 6, &down(6, "", TABLE + 40.0));
    goes(&mut client, 7, &down(7, "", TABLE + 50.0));
    let recorder = crate::crcl_motion::Recorder::start(&scene.arm);
    std::thread::sleep(std::time::Duration::from_millis(100));
    client.done(
        "LoopBlockEnd",
        8,
        "<LoopName>a</LoopName><MaxCount>3</MaxCount>",
    );
    let heights: Vec<_> = recorder.points().iter().map(|point| point.z).collect();
    // Twice more down and up: rows at the lower height, apart from each other.
    let low = |z: &f64| (z - TABLE - 40.0).abs() < 0.01;
    let visits = heights
        .windows(2)
        .filter(|pair| low(&pair[1]) && !low(&pair[0]))
        .count();
    assert_eq!(visits, 2, "visits of the lower height");
    client.failed(
        "LoopBlockEnd",
        9,
        "<LoopName>a</LoopName><MaxCount>3</MaxCount>",
    );
    client.done("InitCanon", 10, "");
    let program = "MoveStraightTo({{400, 10, 240}, {0, 0, -1}, {1, 0, 0}})";
    let answer = client.done(
        "RunProgram",
        11,
        &format!("<ProgramText>{program}</ProgramText>"),
    );
    let [x, y, z] = answer.point();
    let off = (x - 400.0)
        .abs()
        .max((y - 10.0).abs())
        .max((z - 240.0).abs());
    assert!(off < 1.0, "{x} {y} {z}");
    let answer = client.failed("RunProgram", 12, "<ProgramText>Fly()</ProgramText>");
    assert!(answer.why().contains("line 1"), "{}", answer.why());
}
