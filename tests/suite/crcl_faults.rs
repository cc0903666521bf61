//! What clients and processes of a CRCL server may do wrong, and what the arm then does.

use std::io::{Read, Write};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::canter::canter;
use crate::crcl_client::{Connection, Scene, document, move_to};

/// How far a joint may be from where it was when nothing has moved (degrees): noise of nothing.
const STILL: f64 = 1e-2;

fn slow(client: &mut Connection, id: i64) {
    client.done(
        "SetTransSpeed",
        id,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>20</Setting></TransSpeed>",
    );
}

/// Begins a slow move of 200 mm downwards.
fn begin_move(client: &mut Connection, id: i64) {
    let start = client.status();
    let [x, y, z] = start.point();
    client.send(&move_to(id, &start, [x, y, z - 200.0]));
    let end = Instant::now() + Duration::from_secs(20);
    while client.status().point()[2] > z - 1.0 {
        assert!(Instant::now() < end, "the arm does not move");
        sleep(Duration::from_millis(5));
    }
}

/// The arm rests within some seconds, and stays where it is.
fn wait_for_rest(scene: &Scene) {
    let mut client = scene.connect();
    let end = Instant::now() + Duration::from_secs(30);
    let mut before = client.status().joints();
    loop {
        sleep(Duration::from_millis(200));
        let now = client.status().joints();
        let moved = now.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if moved.fold(0.0, f64::max) < STILL {
            return;
        }
        assert!(Instant::now() < end, "the arm does not rest");
        before = now;
    }
}

/// Eight connections ask without a pause while the arm moves: each gets an answer for each request,
/// in order, and the move comes to its end.
#[test]
fn a_storm_of_polls_changes_nothing() {
    const POLLS: usize = 1000;
    let scene = Scene::new("storm", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    slow(&mut client, 2);
    begin_move(&mut client, 3);
    let mut storm: Vec<_> = (0..8).map(|_| scene.connect()).collect();
    std::thread::scope(|scope| {
        for poller in &mut storm {
            scope.spawn(move || {
                let mut last = 0.0;
                for _ in 0..POLLS / 10 {
                    poller.send(&document("GetStatus", 1, "").repeat(10));
                    for _ in 0..10 {
                        let answer = poller.answer();
                        assert_eq!(answer.id(), 3);
                        let number = answer.number("StatusID");
                        assert!(number > last, "{number} after {last}");
                        last = number;
                    }
                }
            });
        }
    });
    assert_eq!(client.wait(3).state(), "CRCL_Done");
    for poller in &mut storm {
        assert_eq!(poller.status().state(), "CRCL_Done");
    }
}

/// A client may vanish at any moment: what moved stops, what did not move stays, and the next client
/// finds a server that works.
#[test]
fn a_client_may_vanish_in_every_state() {
    let scene = Scene::new("vanish", &[]);
    let init = document("InitCanon", 1, "");
    let dwell = document("Dwell", 2, "<DwellTime>3</DwellTime>");
    let ask = document("GetStatus", 3, "");
    let states: [&dyn Fn(&mut Connection); 9] = [
        &|_| {},
        &|client| client.send(&ask[..ask.len() / 2]),
        &|client| client.send(&ask),
        &|client| client.send(&init),
        &|client| client.send(&format!("{init}{dwell}")),
        &|client| {
            client.done("InitCanon", 1, "");
            client.send(&dwell);
        },
        &|client| {
            client.done("InitCanon", 1, "");
            slow(client, 2);
            begin_move(client, 4);
        },
        &|client| {
            client.done("InitCanon", 1, "");
            client.failed("RunProgram", 5, "<ProgramText>x</ProgramText>");
        },
        &|client| {
            client.done("InitCanon", 1, "");
            client.send("<CRCLCommandInstance><CRCLCommand>");
        },
    ];
    for (number, state) in states.into_iter().enumerate() {
        let mut client = scene.connect();
        state(&mut client);
        drop(client);
        wait_for_rest(&scene);
        let mut next = scene.connect();
        let before = next.status().joints();
        next.done("InitCanon", 100, "");
        let after = next
            .done("Dwell", 101, "<DwellTime>0.1</DwellTime>")
            .joints();
        let moved = after.iter().zip(&before).map(|(a, b)| (a - b).abs());
        assert!(
            moved.fold(0.0, f64::max) < STILL,
            "state {number}: it moves"
        );
    }
}

/// Who asks and reads nothing is cut off, and nobody else notices.
#[test]
fn who_reads_nothing_is_cut_off() {
    let scene = Scene::new("deaf", &[]);
    let mut deaf = scene.connect();
    let many = document("GetStatus", 1, "").repeat(100);
    deaf.stream
        .set_write_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let end = Instant::now() + Duration::from_secs(60);
    // The buffers of both sides take some megabytes.
    while deaf.stream.write_all(many.as_bytes()).is_ok() {
        assert!(Instant::now() < end, "it may go on for ever");
    }
    let mut buffer = vec![0; 1 << 16];
    while deaf.stream.read(&mut buffer).is_ok_and(|count| count > 0) {
        assert!(Instant::now() < end, "it is still connected");
    }
    assert_eq!(scene.connect().status().state(), "CRCL_Ready");
}

/// The engine dies while a client's move is under way: the client is told so.
#[test]
fn an_engine_that_dies_is_told_to_the_client() {
    let mut scene = Scene::new("orphan", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    slow(&mut client, 2);
    begin_move(&mut client, 3);
    scene.kill_engine();
    let told = client.wait(3);
    assert_eq!(told.state(), "CRCL_Error", "{}", told.0);
    assert!(told.why().contains("engine"), "{}", told.0);
}

/// The server is killed while a move is under way: the engine brings the move to its end, and another
/// server takes over.
#[test]
fn another_server_takes_over_from_one_that_was_killed() {
    let mut scene = Scene::new("successor", &[]);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    slow(&mut client, 2);
    begin_move(&mut client, 3);
    scene.restart_server();
    wait_for_rest(&scene);
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    client.done("Dwell", 2, "<DwellTime>0.1</DwellTime>");
}

/// The arm does not move for a while.
fn assert_still(client: &mut Connection, case: &str) {
    let before = client.status().joints();
    sleep(Duration::from_millis(400));
    let now = client.status().joints();
    let moved = now.iter().zip(&before).map(|(a, b)| (a - b).abs());
    let moved = moved.fold(0.0, f64::max);
    assert!(moved < STILL, "{case}: moved {moved} degrees");
}

/// An operator stops the arm. Whatever a client does then, a StopMotion, a move that replaces its own,
/// or that it goes away: the arm is held until the operator resumes.
#[test]
fn an_operators_stop_outlives_what_clients_do() {
    let scene = Scene::new("held", &[]);
    let operator = |verb: &str| {
        let ran = canter([verb, "--arm", &scene.arm]);
        assert_eq!(ran.code, 0, "{verb}: {}", ran.stderr);
    };
    let mut watcher = scene.connect();
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    slow(&mut client, 2);

    begin_move(&mut client, 3);
    operator("stop");
    client.done("StopMotion", 4, "<StopCondition>Fast</StopCondition>");
    let start = client.status();
    let [x, y, z] = start.point();
    client.send(&move_to(5, &start, [x, y, z + 20.0]));
    assert_still(&mut watcher, "a move after StopMotion");
    client.send(&move_to(6, &start, [x, y, z + 30.0]));
    assert_still(&mut watcher, "a move that replaces one that is held");
    operator("resume");
    let end = client.wait(6);
    assert_eq!(end.state(), "CRCL_Done", "{}", end.0);
    assert!((end.point()[2] - z - 30.0).abs() < 1.0, "{}", end.0);

    begin_move(&mut client, 7);
    operator("stop");
    drop(client);
    let gone = watcher.wait(7);
    assert!(gone.why().contains("gone"), "{}", gone.0);
    watcher.send(&document("InitCanon", 8, ""));
    let start = watcher.status();
    let [x, y, z] = start.point();
    assert_eq!(watcher.wait(8).state(), "CRCL_Done");
    watcher.send(&move_to(9, &start, [x, y, z + 20.0]));
    assert_still(&mut scene.connect(), "a move of another client");
    operator("resume");
    assert_eq!(watcher.wait(9).state(), "CRCL_Done");
}
