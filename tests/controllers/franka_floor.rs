//! How many cycles the controller of the tests misses with a client that does nothing but answer: those are its own, and
//! the machine's.

use std::time::{Duration, Instant};

use franka::{
    JointPositions, MoveControllerMode, RealtimeConfig, Robot, RobotOptions, motion_finished,
};
use scheduling::{RealTimeRequest, request_real_time};

use crate::franka::Controller;

/// Answers each state with what the controller commands already, for a minute.
pub(crate) fn cycles_that_any_client_misses() {
    const LENGTH: Duration = Duration::from_secs(60);
    let mut controller = Controller::start();
    let address = format!("127.0.0.1:{}", controller.port);
    let thread = std::thread::spawn(move || {
        let granted = request_real_time(RealTimeRequest {
            priority: 80,
            ..RealTimeRequest::default()
        });
        println!("{}", granted.warning().unwrap_or_default());
        let options = RobotOptions::new(RealtimeConfig::Ignore).with_log_size(0);
        let robot = Robot::with_options(&address, options).unwrap();
        let mut control = robot
            .start_joint_position_control(MoveControllerMode::JointImpedance)
            .unwrap();
        let (start, mut least, mut sum, mut states) = (Instant::now(), 1.0_f64, 0.0, 0.0);
        loop {
            let (state, _) = control.read_once().unwrap();
            let held = JointPositions::new(state.q_d);
            if start.elapsed() > LENGTH {
                control.write_once(&motion_finished(held), None).unwrap();
                break;
            }
            control.write_once(&held, None).unwrap();
            // The first rates are those of less than a hundred cycles.
            if start.elapsed() > Duration::from_secs(1) {
                least = least.min(state.control_command_success_rate);
                sum += state.control_command_success_rate;
                states += 1.0;
            }
        }
        println!(
            "success rate mean {:.4}, least {least:.2} ({states} states)",
            sum / states
        );
    });
    thread.join().unwrap();
    println!("{:?}", controller.record());
}
