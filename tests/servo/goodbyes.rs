//! The end of a session: the engine says goodbye when the driver rests too, so that a driver that was
//! late has nothing left to brake.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use driver_kit::{
    About, Command, DriverReport, Measured, Measurement, Reference, Robot, RunOptions,
};
use ipc::Clock;
use scheduling::RealTimeRequest;
use servo::{Control, Event, Executor};
use system_tests::servo_arm::{
    JOINTS, Joints, driver_options, executor_config, feed, home, planned,
};

/// What is wrong with the driver.
#[derive(Clone, Copy, PartialEq)]
enum Ill {
    /// It does not run for 60 ms, 0.1 s before the end of the motion.
    Stalls,
    /// What its controller commands never stands.
    Trembles,
}

/// Six joints that are at once where they shall be.
struct Late {
    ill: Ill,
    joints: [Measured; JOINTS],
    /// Periods since the arm began to move.
    moved: u32,
    periods: u32,
}

impl Robot for Late {
    fn about(&self) -> About {
        let options = driver_options(arm("about"));
        About {
            name: "late".to_owned(),
            lower: options.lower,
            upper: options.upper,
            velocity: options.velocity,
            acceleration: options.acceleration,
            jerk: options.jerk,
            ..About::default()
        }
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        joints.copy_from_slice(&self.joints);
        self.periods += 1;
        Measurement::Now
    }

    fn commanded(&self, joints: &mut [f64]) -> bool {
        for (to, from) in joints.iter_mut().zip(&self.joints) {
            *to = from.position;
        }
        if self.ill == Ill::Trembles && self.moved > 0 {
            joints[2] += [1e-4, -1e-4][self.periods as usize % 2];
        }
        self.ill == Ill::Trembles
    }

    fn follow(&mut self, command: &Command<'_>) {
        self.joints = core::array::from_fn(|joint| command.joints[joint].into());
        let moves = self.joints.iter().any(|joint| joint.velocity != 0.0);
        self.moved += u32::from(moves || self.moved > 0);
        if self.ill == Ill::Stalls && self.moved == 880 {
            thread::sleep(Duration::from_millis(60));
        }
    }
}

fn arm(name: &str) -> ipc::Arm {
    system_tests::domain::arm(&format!("goodbye/{name}"))
}

/// Runs the motion of a second, and ends the session as soon as the engine reports its end; gives what
/// the driver reports, all events, and how long the end took. `stop` is given before the end.
fn run(ill: Ill, name: &str, stop: Option<Control>) -> (DriverReport, Vec<Event>, Duration) {
    let arm = arm(name);
    let robot = Late {
        ill,
        joints: core::array::from_fn(|joint| Reference::rest(home()[joint]).into()),
        moved: 0,
        periods: 0,
    };
    let ends = AtomicBool::new(false);
    thread::scope(|scope| {
        let _ends = crate::StopOnDrop(&ends);
        let options = RunOptions {
            log: None,
            real_time: RealTimeRequest::default(),
        };
        let of_driver = arm.clone();
        let ended = &ends;
        let driver =
            scope.spawn(move || driver_kit::run(&of_driver, robot, &options, ended).unwrap());
        let mut config = executor_config(arm, Clock::Wall);
        config.record = false;
        // A busy machine may stall both for long; this test is not about that.
        config.watchdog = Duration::from_secs(2);
        config.patience = Duration::from_secs(2);
        config.following.base = 0.5;
        // The command is over with its plan: that the arm is there is not waited for.
        config.arrival.tolerance = if ill == Ill::Stalls { 1.0 } else { 1e-3 };
        let (executor, mut sender, mut monitor) = Executor::start(config).unwrap();
        assert!(feed(&mut sender, 0));
        let (mut events, start) = (Vec::new(), Instant::now());
        while !events
            .iter()
            .any(|event| matches!(event, Event::Finished { command: 0, .. }))
        {
            events.extend(std::iter::from_fn(|| monitor.event()));
            assert!(start.elapsed() < Duration::from_secs(60), "{events:?}");
            thread::sleep(Duration::from_millis(1));
        }
        let remote = executor.remote();
        stop.map(|stop| remote.control(stop));
        let end = Instant::now();
        executor.shutdown();
        let took = end.elapsed();
        ends.store(true, Ordering::Relaxed);
        let report = driver.join().unwrap();
        events.extend(std::iter::from_fn(|| monitor.event()));
        let now = remote.measured();
        assert!((now.setpoint - planned(0, 2.0)).amax() < 1e-9);
        if ill == Ill::Stalls {
            let apart: Joints = now.position - now.setpoint;
            assert!(apart.amax() < 1e-9, "the arm is {apart:?} from its end");
        }
        (report, events, took)
    })
}

fn not_settled(events: &[Event]) -> Option<(u32, f64)> {
    events.iter().find_map(|event| match event {
        Event::NotSettled { joint, error, .. } => Some((*joint, *error)),
        _ => None,
    })
}

/// A driver that was away for 60 ms shortly before the end has nothing to brake when it is told to end.
#[test]
fn a_late_driver_settles_before_the_goodbye() {
    let (report, events, _) = run(Ill::Stalls, "late", None);
    assert_eq!(report.braked, None);
    assert_eq!(not_settled(&events), None, "{events:?}");
}

/// A driver that never rests is named after the patience of an arrival, half a second.
#[test]
fn a_driver_that_does_not_settle_is_named() {
    let (_, events, took) = run(Ill::Trembles, "trembles", None);
    let (joint, error) = not_settled(&events).expect("a name");
    assert_eq!(joint, 2);
    assert!((error - 1e-4).abs() < 1e-6, "{error}");
    assert!(took >= Duration::from_millis(500), "{took:?}");
}

/// Who asks for the fastest stop does not wait for the driver.
#[test]
fn a_fast_stop_waits_for_nobody() {
    let stop = Some(Control::Stop { fast: true });
    let (_, events, _) = run(Ill::Trembles, "fast", stop);
    assert_eq!(not_settled(&events), None, "{events:?}");
}
