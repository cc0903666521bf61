//! The simulated driver follows every clause of the protocol; the conformance test detects a driver
//! that does not.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use driver_conformance::{Verdict, test_driver};
use system_tests::servo_arm::{JOINTS, driver_options};

#[test]
fn the_simulated_driver_conforms() {
    let arm = system_tests::domain::arm("conform/sim");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let _stop = crate::StopOnDrop(&stop);
        let options = driver_options(arm.clone());
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        // A machine that stalls for longer than the watchdog fails a clause, but not three times.
        let passed = (0..3).any(|_| {
            let report = test_driver(&arm).unwrap();
            assert_eq!(report.joints, JOINTS);
            let clauses = report.clauses;
            for clause in &clauses {
                println!("{:?} {}: {}", clause.verdict, clause.name, clause.seen);
            }
            assert_eq!(clauses.len(), 25);
            // It serves every period.
            let skipped = "a period beyond its longest is refused";
            clauses
                .iter()
                .all(|clause| clause.verdict == Verdict::Pass || clause.name == skipped)
        });
        assert!(passed);
        stop.store(true, Ordering::Relaxed);
        driver.join().unwrap();
    });
}

/// A driver that is too slow to follow and has no gripper is detected.
#[test]
fn a_lazy_driver_is_seen() {
    let arm = system_tests::domain::arm("conform/lazy");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let _stop = crate::StopOnDrop(&stop);
        let mut options = driver_options(arm.clone());
        options.frequency = 0.5;
        options.delay = 300;
        options.gripper = None;
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        let clauses = test_driver(&arm).unwrap().clauses;
        let verdict = |name: &str| {
            clauses
                .iter()
                .find(|clause| clause.name == name)
                .map(|clause| clause.verdict)
        };
        assert_eq!(verdict("follows a motion"), Some(Verdict::Fail));
        assert_eq!(verdict("the gripper answers"), Some(Verdict::Skip));
        assert_eq!(verdict("wrong protocol is refused"), Some(Verdict::Pass));
        stop.store(true, Ordering::Relaxed);
        driver.join().unwrap();
    });
}
