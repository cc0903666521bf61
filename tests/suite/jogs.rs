//! A stop that comes while the arm jogs holds, however the jog ends.

use std::time::{Duration, Instant};

use engine::session::{Jog, JogError, JogSpace, Session, SessionConfig};
use planner::robot::load;
use servo::Control;
use system_tests::driver_thread::{DriverThread, options_of};

/// A jog of the first joint that goes on for `timeout` without a further request.
fn jog(timeout: Duration) -> Jog {
    let mut speeds = vec![0.0; 6];
    speeds[0] = 0.1;
    Jog {
        space: JogSpace::Joint,
        speeds,
        timeout,
        distance: None,
        goal: Vec::new(),
    }
}

fn wait(session: &Session, what: &str, done: impl Fn(&Session) -> bool) {
    let end = Instant::now() + Duration::from_secs(30);
    while !done(session) {
        assert!(Instant::now() < end, "{what}: {:?}", session.status());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The jog's time runs out before, while and after the arm brakes for a stop, gentle and fast. Each
/// time the arm is held until a resume.
#[test]
fn a_stop_outlives_the_jog() {
    let robot = load("ur5e").unwrap();
    let arm = system_tests::domain::arm("jogs/stop");
    let _driver = DriverThread::start(options_of(&robot, &arm));
    let mut session = Session::start(&robot, &SessionConfig::new(arm)).unwrap();
    for (timeout, fast) in [100, 130, 160, 300]
        .into_iter()
        .flat_map(|timeout| [(timeout, false), (timeout, true)])
    {
        let request = jog(Duration::from_millis(timeout));
        session.jog(request.clone()).unwrap();
        wait(&session, "the arm jogs", |session| {
            let now = session.status();
            !now.idle && now.time_scaling > 0.0
        });
        std::thread::sleep(Duration::from_millis(60));
        session.control(Control::Stop { fast });
        wait(&session, "the jog is over", |session| session.status().idle);
        let case = format!("a jog of {timeout} ms, fast: {fast}");
        assert!(session.status().held, "{case}");
        assert_eq!(session.jog(request), Err(JogError::Held), "{case}");
        session.control(Control::Resume);
        wait(&session, "the arm is free", |session| {
            !session.status().held
        });
        assert!(session.status().idle, "{case}: the jog is over");
    }
    session.close();
}
