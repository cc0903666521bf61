//! Tests by the wall clock, with the driver in a thread of the same process.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ipc::Clock;
use servo::{Control, Event, Executor, ExecutorError, Fault};
use system_tests::servo_arm::{driver_options, executor_config, feed, planned};

fn arm(name: &str) -> ipc::Arm {
    system_tests::domain::arm(&format!("wall/{name}"))
}

/// Programs run by the clock: the samples are the plan's, the periods add up.
#[test]
fn the_periods_add_up() {
    let arm = arm("count");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let _stop = crate::StopOnDrop(&stop);
        let options = driver_options(arm.clone());
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        let mut config = executor_config(arm, Clock::Wall);
        // A busy machine may stall both for long; this test is not about that.
        config.watchdog = Duration::from_secs(2);
        config.patience = Duration::from_secs(2);
        config.following.base = 0.5;
        let (executor, mut sender, mut monitor) = Executor::start(config).unwrap();
        for index in 0..3 {
            assert!(feed(&mut sender, index));
        }
        let (mut events, mut samples) = (Vec::new(), Vec::new());
        let start = Instant::now();
        while !events
            .iter()
            .any(|event| matches!(event, Event::Finished { command: 2, .. }))
        {
            samples.extend(std::iter::from_fn(|| monitor.sample()));
            events.extend(std::iter::from_fn(|| monitor.event()));
            assert!(start.elapsed() < Duration::from_secs(60), "{events:?}");
            thread::sleep(Duration::from_millis(5));
        }
        let remote = executor.remote();
        executor.shutdown();
        samples.extend(std::iter::from_fn(|| monitor.sample()));
        let counters = remote.counters();
        let last = samples.last().unwrap().tick;
        assert_eq!(counters.published, samples.len() as u64);
        assert_eq!(counters.ticks, last + 1, "{counters:?}");
        assert_eq!((counters.unsent, counters.lost_reports), (0, 0));
        let mut started = [u64::MAX; 3];
        for event in &events {
            match event {
                Event::Started { command, tick } => started[*command as usize] = *tick,
                Event::Faulted { fault, .. } => panic!("{fault}"),
                _ => {}
            }
        }
        for sample in samples.iter().filter(|sample| sample.tick >= started[0]) {
            // Late periods are left out and delay the plan.
            let passed = (sample.tick - started[sample.command as usize]) as f64 * 0.001;
            assert!(sample.path_time <= passed + 1e-9);
            let plan = planned(sample.command, sample.path_time);
            let distance = (sample.setpoint.position - plan).amax();
            assert!(distance < 1e-9, "{distance} rad from the plan");
        }
        println!(
            "{counters:?}; wake-up p50 {} ns p99 {} ns; work p50 {} ns p99 {} ns",
            remote.latency().quantile(0.5),
            remote.latency().quantile(0.99),
            remote.work().quantile(0.5),
            remote.work().quantile(0.99)
        );
        stop.store(true, Ordering::Relaxed);
        driver.join().unwrap();
    });
}

/// Without a driver the executor says so.
#[test]
fn no_driver() {
    let mut config = executor_config(arm("nobody"), Clock::Wall);
    config.connect = Duration::from_millis(50);
    let error = Executor::start(config).err().unwrap();
    assert!(
        matches!(
            error,
            ExecutorError::Ipc(ipc::IpcError::NoAnswer { role: "driver", .. })
        ),
        "{error}"
    );
}

/// A driver that does not follow causes a following error, which latches and is cleared only by a
/// new session; an abort empties the queue.
#[test]
fn a_following_error_latches_until_recovery() {
    let arm = arm("following");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let _stop = crate::StopOnDrop(&stop);
        let mut options = driver_options(arm.clone());
        options.frequency = 1.0;
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        let mut config = executor_config(arm, Clock::LockStep);
        config.record = false;
        config.following.base = 1e-5;
        config.following.delay = 0.0;
        let (executor, mut sender, mut monitor) = Executor::start(config).unwrap();
        assert!(feed(&mut sender, 0));
        let mut wait_for = |wanted: &dyn Fn(&Event) -> bool| {
            let start = Instant::now();
            loop {
                match monitor.event() {
                    Some(event) if wanted(&event) => return event,
                    Some(_) => {}
                    None => thread::sleep(Duration::from_millis(1)),
                }
                assert!(start.elapsed() < Duration::from_secs(30), "it did not come");
            }
        };
        let faulted = |event: &Event| matches!(event, Event::Faulted { .. });
        let Event::Faulted {
            fault: Fault::Limit(trip),
            ..
        } = wait_for(&faulted)
        else {
            panic!("another fault");
        };
        assert_eq!(trip.quantity, realtime::Quantity::Following);
        let remote = executor.remote();
        while !remote.measured().resting {
            thread::sleep(Duration::from_millis(1));
        }
        remote.control(Control::Resume);
        assert!(remote.measured().faulted);
        remote.recover().unwrap();
        wait_for(&|event| matches!(event, Event::Recovered { .. }));
        assert!(!remote.measured().faulted);
        let now = remote.measured();
        assert!((now.setpoint - now.position).amax() < 1e-3);
        remote.control(Control::Abort);
        wait_for(&|event| matches!(event, Event::Aborted { .. }));
        assert!(remote.measured().resting);
        drop(executor);
        stop.store(true, Ordering::Relaxed);
        driver.join().unwrap();
    });
}
