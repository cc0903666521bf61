//! Faults of real processes, checked by what the driver received.
//!
//! Each test starts an engine and a driver as separate processes, kills or stops one of them, and
//! reads the driver's log: no setpoint ever breaks a limit of a joint.

use std::thread;
use std::time::{Duration, Instant};

use system_tests::domain::domain;

use crate::scene::{Line, PATIENCE, Scene, assert_within_limits, read, rest_error};

#[test]
fn kill_the_engine() {
    let scene = Scene::new("kill-engine");
    let (mut engine, _driver) = scene.moving();
    engine.child.kill().unwrap();
    engine.child.wait().unwrap();
    // The driver stops within watchdog and braking time, and latches; a new engine starts from its
    // position.
    thread::sleep(Duration::from_millis(600));
    let again = scene.engine();
    again.wait_for("ready");
    again.wait_for("Started { command: 0");
    thread::sleep(Duration::from_millis(200));
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);
    let sessions: Vec<u64> = lines.iter().map(|line| line.session).collect();
    assert_ne!(sessions.first(), sessions.last());
}

#[test]
fn kill_the_driver_and_attach_another() {
    let scene = Scene::new("kill-driver");
    let (mut engine, mut driver) = scene.moving();
    driver.child.kill().unwrap();
    driver.child.wait().unwrap();
    engine.wait_for("DriverLost");
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);

    let _other = scene.driver(1);
    thread::sleep(Duration::from_millis(300));
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    thread::sleep(Duration::from_millis(300));
    let lines = read(&scene.log(1));
    assert!(assert_within_limits(&lines) > 500);
}

#[test]
fn stop_the_engine_process_for_300_ms() {
    let scene = Scene::new("stop-engine");
    let (mut engine, _driver) = scene.moving();
    engine.signal(libc::SIGSTOP);
    thread::sleep(Duration::from_millis(300));
    engine.signal(libc::SIGCONT);
    let fault = engine.wait_for("Faulted");
    assert!(
        fault.contains("Stalled") || fault.contains("DriverFault"),
        "{fault}"
    );
    // It does not continue by itself.
    thread::sleep(Duration::from_millis(500));
    let stopped = read(&scene.log(0)).len();
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    let lines = read(&scene.log(0));
    assert!(lines.len() > stopped);
    // A latched driver does not follow what it receives; only sessions count.
    assert_within_limits(&lines);
}

/// Stalls shorter than the watchdog: no setpoint is further from the one before than the joints can
/// move in one period, however long ago that one was.
#[test]
fn a_short_stall_of_the_engine_makes_no_jump() {
    let scene = Scene::new("short-stalls");
    let (engine, _driver) = scene.moving();
    for stall in [5, 20, 40, 60, 75, 30, 70, 10, 50, 65] {
        engine.signal(libc::SIGSTOP);
        thread::sleep(Duration::from_millis(stall));
        engine.signal(libc::SIGCONT);
        thread::sleep(Duration::from_millis(250));
    }
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);
    let velocity = system_tests::servo_arm::limits().velocity;
    let mut late = 0;
    for pair in lines.windows(2) {
        // Setpoints that the driver read too late are not in its log.
        let follows =
            pair[1].session == pair[0].session && pair[1].sequence == pair[0].sequence + 1;
        if !follows {
            continue;
        }
        late += usize::from(pair[1].tick > pair[0].tick + 4);
        for joint in 0..velocity.len() {
            let step = (pair[1].setpoint[0][joint] - pair[0].setpoint[0][joint]).abs();
            assert!(
                step <= velocity[joint] * 0.001 * 1.001,
                "{step} rad in one setpoint"
            );
        }
    }
    assert!(late >= 5, "only {late} stalls were seen");
}

#[test]
fn stop_the_driver_process_for_300_ms() {
    let scene = Scene::new("stop-driver");
    let (mut engine, driver) = scene.moving();
    driver.signal(libc::SIGSTOP);
    engine.wait_for("DriverLost");
    thread::sleep(Duration::from_millis(300));
    driver.signal(libc::SIGCONT);
    thread::sleep(Duration::from_millis(700));
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    let lines = read(&scene.log(0));
    assert_within_limits(&lines);
}

#[test]
fn a_second_engine_is_refused_by_name() {
    let scene = Scene::new("second");
    let (_engine, _driver) = scene.moving();
    let mut second = scene.engine();
    let line = second.wait_for("taken");
    assert!(
        line.contains("engine of") && line.contains("process"),
        "{line}"
    );
    assert_eq!(second.child.wait().unwrap().code(), Some(4));
    let mut other = scene.driver(7);
    assert!(other.wait_for("taken").contains("driver"));
    assert_eq!(other.child.wait().unwrap().code(), Some(4));
}

/// Dead processes whose segments are still there, in the domain of this test alone.
fn dead_nodes() -> usize {
    ipc::count_nodes(&domain()).unwrap().dead
}

/// After a hundred kills, each start cleans up after the one before; the last one is cleaned up
/// here.
#[test]
fn a_hundred_kills_leak_nothing() {
    let scene = Scene::new("leak");
    let mut most = 0;
    for _ in 0..100 {
        let mut driver = scene.driver(0);
        let start = Instant::now();
        while !scene.log(0).exists() && start.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
        driver.child.kill().unwrap();
        driver.child.wait().unwrap();
        std::fs::remove_file(scene.log(0)).unwrap();
        most = most.max(dead_nodes());
    }
    assert!(most < 20, "{most} dead processes at a time");
    let start = Instant::now();
    while dead_nodes() > 0 && start.elapsed() < PATIENCE {
        ipc::remove_dead_nodes(&domain()).unwrap();
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(dead_nodes(), 0);
}

/// A process of higher priority uses all processors: either every period is made in time, or the
/// fault latches; in both cases no setpoint breaks a limit.
#[test]
fn a_hog_of_the_processors() {
    let scene = Scene::new("hog");
    let (engine, _driver) = scene.moving();
    let stop = std::sync::atomic::AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                // Without the right to do so, the process has ordinary priority.
                scheduling::request_real_time(scheduling::RealTimeRequest {
                    priority: 90,
                    processor: None,
                    lock_memory: false,
                    low_latency: false,
                });
                let end = Instant::now() + Duration::from_millis(400);
                while Instant::now() < end && !stop.load(std::sync::atomic::Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
    });
    drop(engine);
    thread::sleep(Duration::from_millis(400));
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);
    assert!(lines.last().unwrap().received_ns > 0);
}

/// An engine that ends sends a goodbye: the driver rests at the last setpoint.
#[test]
fn at_rest_the_joints_are_at_the_setpoint() {
    let scene = Scene::new("rest");
    let (engine, driver) = scene.moving();
    driver.signal(0);
    engine.wait_for("Finished { command: 1");
    drop(engine);
    let lines = read(&scene.log(0));
    let resting: Vec<Line> = lines
        .iter()
        .take_while(|line| line.tick < 40)
        .cloned()
        .collect();
    assert!(rest_error(&resting[..1]) < 1e-6);
}

/// A planner that stops in the middle of a command: the arm stops on the path, without a fault.
#[test]
fn a_starved_planner_stops_the_arm() {
    let scene = Scene::new("starved");
    let (mut engine, _driver) = scene.moving();
    engine.say("starve");
    let started = engine.wait_for("Started { command: 4000000000");
    assert!(!started.is_empty());
    // The planned part lasts 3 s; the arm slows down towards its end.
    let start = Instant::now();
    let lines = loop {
        thread::sleep(Duration::from_millis(500));
        let lines = read(&scene.log(0));
        let [_, velocity, _] = lines.last().unwrap().setpoint;
        if start.elapsed() > Duration::from_secs(3) && velocity.iter().all(|v| v.abs() < 1e-9) {
            break lines;
        }
        assert!(start.elapsed() < PATIENCE, "{velocity:?}");
    };
    assert!(assert_within_limits(&lines) > 1000);
    assert!(rest_error(&lines) < 1e-3);
}

/// Both are killed while the arm moves; what they leave behind does not hinder the next two.
#[test]
fn left_over_segments_are_cleaned_up() {
    let scene = Scene::new("left-over");
    for number in 0..3 {
        let mut driver = scene.driver(number);
        let mut engine = scene.engine();
        engine.wait_for("Started { command: 0");
        thread::sleep(Duration::from_millis(300));
        for peer in [&mut engine, &mut driver] {
            peer.child.kill().unwrap();
            peer.child.wait().unwrap();
        }
        assert!(assert_within_limits(&read(&scene.log(number))) > 50);
    }
    let start = Instant::now();
    while dead_nodes() > 0 && start.elapsed() < PATIENCE {
        ipc::remove_dead_nodes(&domain()).unwrap();
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(dead_nodes(), 0);
}
