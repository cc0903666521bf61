//! A simulated driver in a thread of the test.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, spawn};

use driver_sim::Options;
use ipc::Arm;
use planner::robot::Robot;

/// A simulated driver, which ends and is waited for when this is dropped.
#[derive(Debug)]
pub struct DriverThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl DriverThread {
    /// Starts the driver.
    pub fn start(options: Options) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let run = move || {
            driver_sim::run(options, &seen).expect("the driver runs");
        };
        Self {
            stop,
            thread: Some(spawn(run)),
        }
    }
}

impl Drop for DriverThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

/// Options of a simulated driver of a robot, which stands in its home position.
pub fn options_of(robot: &Robot, arm: &Arm) -> Options {
    Options {
        position: robot.home.clone(),
        model: ipc::model_hash(robot.urdf.as_bytes()),
        ..Options::new(arm.clone(), robot.dof())
    }
}
