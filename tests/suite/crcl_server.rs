//! CRCL over TCP: clients that know the protocol only, against a server, an engine and a simulated
//! arm in processes of their own.

use std::io::Write;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::crcl_client::{Answer, Connection, Scene, document, move_to};

fn near(a: &[f64], b: &[f64], most: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
}

/// A point this far (in the connection's units) above another.
fn above(answer: &Answer, by: f64) -> [f64; 3] {
    let [x, y, z] = answer.point();
    [x, y, z + by]
}

/// The arm moves: two statuses differ.
fn wait_for_motion(connection: &mut Connection, from: &[f64; 3]) {
    let end = Instant::now() + Duration::from_secs(20);
    while near(&connection.status().point(), from, 0.5) {
        assert!(Instant::now() < end, "the arm does not move");
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_client_drives_the_arm() {
    let scene = Scene::new("drive", &[]);
    let mut client = scene.connect();
    let first = client.status();
    assert_eq!((first.state(), first.joints().len()), ("CRCL_Ready", 6));

    // Nothing moves before InitCanon.
    let up = above(&first, 40.0);
    client.send(&move_to(4, &first, up));
    let refused = client.wait(4);
    assert!(refused.why().contains("not initialised"), "{}", refused.0);
    assert!(near(&client.status().joints(), &first.joints(), 1e-3));

    client.done("InitCanon", 5, "");
    client.done("InitCanon", 6, "");
    client.done(
        "SetTransSpeed",
        7,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>200</Setting></TransSpeed>",
    );
    client.send(&move_to(8, &first, up));
    // The command is in force before the next status of this connection.
    let status = client.status();
    assert_eq!(
        (status.id(), status.state()),
        (8, "CRCL_Working"),
        "{}",
        status.0
    );
    let arrived = client.wait(8);
    assert_eq!(arrived.state(), "CRCL_Done", "{}", arrived.0);
    assert!(
        near(&arrived.point(), &up, 1.0),
        "{:?} is not {up:?}",
        arrived.point()
    );

    // Units are converted in the very next status.
    let inch = client.done("SetLengthUnits", 9, "<UnitName>inch</UnitName>");
    let expected = arrived.point().map(|value| value / 25.4);
    assert!(near(&inch.point(), &expected, 1e-2), "{:?}", inch.point());
    client.done("SetLengthUnits", 10, "<UnitName>millimeter</UnitName>");

    let report = "<ResetAll>true</ResetAll><ConfigureJointReport><JointNumber>2</JointNumber><ReportPosition>false</ReportPosition><ReportTorqueOrForce>true</ReportTorqueOrForce><ReportVelocity>true</ReportVelocity></ConfigureJointReport>";
    let joints = client.done("ConfigureJointReports", 11, report);
    assert_eq!(joints.0.matches("<JointStatus>").count(), 1);
    assert!(joints.text("JointVelocity").is_some() && joints.text("JointTorqueOrForce").is_some());
    assert!(joints.joints().is_empty());
    let all = |flag: &str| {
        [
            "JointStatuses",
            "PoseStatus",
            "GripperStatus",
            "SettingsStatus",
        ]
        .map(|part| format!("<Report{part}>{flag}</Report{part}>"))
        .concat()
    };
    let settings = client.done("ConfigureStatusReport", 12, &all("true"));
    assert!(
        settings.text("LengthUnitName") == Some("millimeter"),
        "{}",
        settings.0
    );
    let nothing = client.done("ConfigureStatusReport", 13, &all("false"));
    assert!(nothing.text("Pose").is_none() && nothing.text("JointStatus").is_none());
    client.done("ConfigureStatusReport", 14, &all("true"));

    // What cannot be done is refused with a sentence, and stays refused until InitCanon.
    let failed = client.failed("RunProgram", 15, "<ProgramText>x</ProgramText>");
    assert!(failed.why().contains("RunProgram"), "{}", failed.0);
    client.failed("Dwell", 16, "<DwellTime>0</DwellTime>");
    client.done("InitCanon", 17, "");
    client.done("Dwell", 18, "<DwellTime>0.1</DwellTime>");
    let far = move_to(19, &first, [9000.0, 0.0, 0.0]);
    client.send(&far);
    let unreachable = client.wait(19);
    assert!(unreachable.why().contains("reach"), "{}", unreachable.0);
    client.done("InitCanon", 20, "");
    client.done("EndCanon", 21, "");
    client.failed("Dwell", 22, "<DwellTime>0</DwellTime>");
}

#[test]
fn documents_come_in_any_pieces() {
    let scene = Scene::new("pieces", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    let unit = document("SetLengthUnits", 2, "<UnitName>inch</UnitName>");
    let ask = document("GetStatus", 2, "");
    for byte in format!("{unit}\0\r\n{ask}").as_bytes() {
        client.stream.write_all(&[*byte]).unwrap();
    }
    let answer = client.answer();
    assert_eq!((answer.id(), answer.state()), (2, "CRCL_Done"));
    // Two requests in one packet, two answers; between them a comment and a broken document.
    client.send(&format!(
        "{ask}<!-- {ask} --> <CRCLCommandInstance><a>{ask}"
    ));
    for _ in 0..2 {
        client.answer();
    }
    // Every split of a request in two.
    for at in 1..ask.len() {
        let (head, tail) = ask.split_at(at);
        client.send(head);
        client.send(tail);
        assert_eq!(client.answer().id(), 2, "split at {at}");
    }
}

#[test]
fn each_connection_has_units_of_its_own() {
    let scene = Scene::new("units", &[]);
    let mut clients = [scene.connect(), scene.connect(), scene.connect()];
    clients[0].done("InitCanon", 1, "");
    for (client, (id, unit)) in
        clients
            .iter_mut()
            .zip([(2, "millimeter"), (3, "meter"), (4, "inch")])
    {
        client.done(
            "SetLengthUnits",
            id,
            &format!("<UnitName>{unit}</UnitName>"),
        );
    }
    let [mm, m, inch] = clients.each_mut().map(|client| client.status().point());
    assert!(
        near(&m.map(|value| value * 1000.0), &mm, 1e-2),
        "{m:?} {mm:?}"
    );
    assert!(
        near(&inch.map(|value| value * 25.4), &mm, 1e-2),
        "{inch:?} {mm:?}"
    );
    // A move in metres moves the arm by metres.
    let [first, second, _] = &mut clients;
    let before = second.status();
    second.send(&move_to(9, &before, above(&before, 0.03)));
    assert_eq!(second.wait(9).state(), "CRCL_Done");
    let [_, _, z] = first.status().point();
    assert!((z - mm[2] - 30.0).abs() < 1.0, "{z} {mm:?}");
}

#[test]
fn the_second_connection_stops_what_the_first_began() {
    let scene = Scene::new("stop", &[]);
    let (mut first, mut second) = (scene.connect(), scene.connect());
    first.done("InitCanon", 1, "");
    first.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>20</Setting></TransSpeed>",
    );
    for (id, how) in [(3, "Fast"), (6, "Normal"), (9, "Immediate")] {
        let start = first.status();
        let up = above(&start, -100.0);
        first.send(&move_to(id, &start, up));
        wait_for_motion(&mut first, &start.point());
        // A second client may not command, but it may stop; its ID may be a smaller one.
        second.send(&document("Dwell", id + 20, "<DwellTime>0</DwellTime>"));
        let other = second.status();
        assert!(other.why().contains("commands the arm"), "{}", other.0);
        assert_eq!(first.status().id(), id);
        second.send(&document(
            "StopMotion",
            id - 1,
            &format!("<StopCondition>{how}</StopCondition>"),
        ));
        assert_eq!(second.wait(id - 1).state(), "CRCL_Done");
        let stopped = first.status();
        assert!(
            (stopped.point()[2] - up[2]).abs() > 10.0,
            "it went on: {}",
            stopped.0
        );
        sleep(Duration::from_millis(100));
        assert!(near(&first.status().point(), &stopped.point(), 0.1));
        // The next command is welcome, without InitCanon.
        first.done("Dwell", id + 1, "<DwellTime>0</DwellTime>");
    }
}

#[test]
fn a_new_move_takes_the_place_of_the_one_under_way() {
    let scene = Scene::new("preempt", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    client.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>30</Setting></TransSpeed>",
    );
    let start = client.status();
    client.send(&move_to(3, &start, above(&start, -200.0)));
    wait_for_motion(&mut client, &start.point());
    client.send(&move_to(4, &start, above(&start, 5.0)));
    let end = client.wait(4);
    assert_eq!(end.state(), "CRCL_Done", "{}", end.0);
    assert!(near(&end.point(), &above(&start, 5.0), 1.0), "{}", end.0);
}

#[test]
fn a_client_that_goes_away_stops_its_move() {
    let scene = Scene::new("gone", &[]);
    let mut watcher = scene.connect();
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    client.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>20</Setting></TransSpeed>",
    );
    let start = client.status();
    client.send(&move_to(3, &start, above(&start, -200.0)));
    wait_for_motion(&mut client, &start.point());
    drop(client);
    let answer = watcher.wait(3);
    assert!(answer.why().contains("gone"), "{}", answer.0);
    sleep(Duration::from_secs(1));
    let rest = watcher.status().point();
    sleep(Duration::from_millis(200));
    assert!(near(&watcher.status().point(), &rest, 0.1));
    assert!((rest[2] - start.point()[2]).abs() < 150.0);
    watcher.done("InitCanon", 4, "");
}

#[test]
fn what_is_no_document_gets_a_sentence() {
    let scene = Scene::new("garbage", &[]);
    let mut client = scene.connect();
    let home = client.status();
    client.done("InitCanon", 7, "");
    let mut says = |bytes: &str, text: &str| {
        client.send(bytes);
        let answer = client.status();
        assert_eq!(
            (answer.state(), answer.id()),
            ("CRCL_Error", 7),
            "{}",
            answer.0
        );
        assert!(answer.why().contains(text), "{text}: {}", answer.0);
        // It concerns nobody else, and the connection goes on.
        assert_eq!(scene.connect().status().state(), "CRCL_Done");
        let id = 7;
        client.done("InitCanon", id, "");
    };
    says(
        "hello, this is no CRCL at all, and it is long enough",
        "no document",
    );
    says(
        "<CRCLCommandInstance><CRCLCommand/></CRCLCommandInstance>",
        "kind",
    );
    let bomb = "<CRCLCommandInstance><!DOCTYPE a [<!ENTITY a \"b\">]>&a;</CRCLCommandInstance>";
    says(bomb, "not XML");
    let deep = format!(
        "<CRCLCommandInstance>{}{}</CRCLCommandInstance>",
        "<a>".repeat(10_000),
        "</a>".repeat(10_000)
    );
    says(&deep, "CRCLCommand");
    says("<CRCLProgram></CRCLProgram>", "single commands");
    says(&document("Jump", 8, ""), "Jump");
    says(
        &document("Dwell", 8, "<DwellTime>INF</DwellTime>"),
        "finite",
    );
    // Ten megabytes end the connection, with a reason.
    let mut flood = scene.connect();
    let chunk = vec![b'x'; 1 << 20];
    let mut open = flood.stream.write_all(b"<CRCLCommandInstance>").is_ok();
    for _ in 0..10 {
        open = open && flood.stream.write_all(&chunk).is_ok();
    }
    assert!(flood.is_closed());
    assert!(near(
        &scene.connect().status().joints(),
        &home.joints(),
        1e-2
    ));
}

#[test]
fn the_sixty_fifth_connection_is_sent_away() {
    let scene = Scene::new("crowd", &[]);
    let mut all: Vec<_> = (0..64).map(|_| scene.connect()).collect();
    for client in &mut all {
        client.status();
    }
    let mut one_more = scene.connect();
    assert!(one_more.answer().why().contains("64 connections"));
    assert!(one_more.is_closed());
    drop(all.pop());
    let end = Instant::now() + Duration::from_secs(10);
    loop {
        let mut again = scene.connect();
        again.send(&document("GetStatus", 1, ""));
        if again.answer().why().is_empty() {
            break;
        }
        assert!(Instant::now() < end, "the place is not free");
    }
}
