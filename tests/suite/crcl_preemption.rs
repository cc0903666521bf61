//! A new move while one runs takes its place without a stop, where the new way allows it.

use std::thread::sleep;
use std::time::Duration;

use crate::crcl_client::{Answer, Connection, Scene, document};
use crate::crcl_motion::Recorder;

fn move_to(id: i64, straight: bool, pose: &Answer, point: [f64; 3]) -> String {
    let [x, y, z] = point;
    let pose = pose.pose();
    let axes = &pose[pose.find("</Point>").unwrap() + 8..];
    let inside = format!(
        "<MoveStraight>{straight}</MoveStraight><EndPosition><Point><X>{x}</X><Y>{y}</Y><Z>{z}</Z>\
         </Point>{axes}</EndPosition>"
    );
    document("MoveTo", id, &inside)
}

fn begin(scene: &Scene) -> (Connection, Answer) {
    let mut client = scene.connect();
    client.done("InitCanon", 1, "");
    client.done(
        "SetTransSpeed",
        2,
        "<TransSpeed xsi:type=\"TransSpeedAbsoluteType\"><Setting>100</Setting></TransSpeed>",
    );
    let status = client.status();
    (client, status)
}

/// How often the joints rest between two rows that move.
fn rests(rows: &[[f64; 6]]) -> usize {
    let step = |pair: &[[f64; 6]]| {
        let steps = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).abs());
        steps.fold(0.0, f64::max)
    };
    let moving: Vec<_> = rows.windows(2).map(|pair| step(pair) > 1e-7).collect();
    let begins = moving.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    begins.saturating_sub(1)
}

/// Jogging by repeated moves, as NIST's pendant does: each from the pose of the status, sent while
/// the one before is still under way. Straight on along one line, nothing stops.
#[test]
fn straight_moves_go_on_without_a_stop() {
    let scene = Scene::new("jogging", &[]);
    let (mut client, start) = begin(&scene);
    let [x, y, z] = start.point();
    let recorder = Recorder::start(&scene.arm);
    sleep(Duration::from_millis(100));
    for id in 3..9 {
        let ahead = client.status().point()[2] - 60.0;
        client.send(&move_to(id, true, &start, [x, y, ahead]));
        assert_ne!(client.status().state(), "CRCL_Error");
        sleep(Duration::from_millis(150));
    }
    let end = client.wait(8);
    assert_eq!(end.state(), "CRCL_Done", "{}", end.0);
    let rows = recorder.joints();
    // On a machine that stalls a plan may come too late; then the arm stops first.
    assert!(rests(&rows) <= 2, "the arm stops between moves");
    // Each move alone is 60 mm long.
    let way = z - end.point()[2];
    assert!(way > 62.0, "{way} mm: {}", end.0);
}

/// A move on any way is led over into another, to somewhere else; the first never becomes done.
#[test]
fn a_move_on_any_way_is_led_over_into_another() {
    let scene = Scene::new("lead", &[]);
    let (mut client, start) = begin(&scene);
    let [x, y, z] = start.point();
    let recorder = Recorder::start(&scene.arm);
    sleep(Duration::from_millis(100));
    client.send(&move_to(3, false, &start, [x, y + 120.0, z - 60.0]));
    sleep(Duration::from_millis(500));
    let under_way = client.status();
    assert_eq!((under_way.id(), under_way.state()), (3, "CRCL_Working"));
    client.send(&move_to(4, false, &start, [x - 80.0, y + 60.0, z]));
    let answer = client.wait(4);
    assert_eq!(answer.state(), "CRCL_Done", "{}", answer.0);
    let off = (answer.point()[0] - x + 80.0).abs() + (answer.point()[1] - y - 60.0).abs();
    assert!(off < 2.0, "{}", answer.0);
    let rows = recorder.joints();
    assert_eq!(rests(&rows), 0, "the arm stops between moves");
}

/// Where the new way leads back, the arm stops on its path first; a stop ends what was led over.
#[test]
fn a_way_back_begins_at_rest_and_a_stop_stops() {
    let scene = Scene::new("back", &[]);
    let (mut client, start) = begin(&scene);
    let [x, y, z] = start.point();
    client.send(&move_to(3, true, &start, [x, y, z - 100.0]));
    sleep(Duration::from_millis(400));
    client.send(&move_to(4, true, &start, [x, y, z]));
    let answer = client.wait(4);
    assert_eq!(answer.state(), "CRCL_Done", "{}", answer.0);
    assert!((answer.point()[2] - z).abs() < 1.5, "{}", answer.0);
    client.send(&move_to(5, true, &start, [x, y, z - 100.0]));
    sleep(Duration::from_millis(300));
    client.send(&move_to(6, true, &start, [x, y, z - 150.0]));
    sleep(Duration::from_millis(100));
    client.done("StopMotion", 7, "<StopCondition>Fast</StopCondition>");
    let stopped = client.status().point()[2];
    assert!(stopped > z - 149.0, "{stopped}");
    sleep(Duration::from_millis(200));
    assert!((client.status().point()[2] - stopped).abs() < 0.1);
}
