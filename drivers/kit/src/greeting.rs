//! Opens or refuses a session.

use std::path::Path;

use ipc::{
    Clock, DriverFeatures, DriverState, FaultCode, Hello, HelloAck, MAX_TOOLS, Setpoint, Verdict,
    bytes_of, text_of,
};

use crate::driver::Session;
use crate::{Driver, Outputs, Readiness, Reference, Robot};

impl<R: Robot> Driver<R> {
    /// Answers a request for a session at `now_ns`.
    pub fn greet(&mut self, hello: &Hello, now_ns: u64) -> HelloAck {
        if let Some((verdict, reason)) = self.objection(hello) {
            return self.answer(verdict, &reason);
        }
        self.begun_ns = Some(now_ns);
        match self.robot.begin() {
            Readiness::Ready => {}
            Readiness::Wait(reason) => return self.answer(Verdict::Wait, &reason),
            Readiness::NotReady(reason) => {
                self.close();
                return self.answer(Verdict::NotReady, &reason);
            }
        }
        self.sessions += 1;
        // Different from any earlier session, so that old setpoints are not accepted.
        let number = (now_ns | 1).wrapping_add(self.sessions << 1).max(1);
        self.session = Some(Session {
            number,
            owner: text_of(&hello.name),
            process: hello.process,
            period_ns: hello.period_ns,
            watchdog_ns: hello.watchdog_ns,
            clock: Clock::from_number(hello.clock).unwrap_or(Clock::Wall),
        });
        self.state = DriverState::Synced;
        self.fault = FaultCode::None;
        self.fault_joint = u32::MAX;
        self.fault_code = 0;
        self.fault_text = [0; 96];
        self.lost = false;
        self.waiting.clear();
        self.came = false;
        self.last = Setpoint::default();
        self.missed = 0;
        self.received_ns = now_ns;
        self.newest_ns = now_ns;
        self.stepped_ns = 0;
        // The arm may have moved a little while it got ready: a motion begins where its controller
        // holds it.
        self.says_commanded = self.robot.commanded(&mut self.commanded);
        for (joint, reference) in self.references.iter_mut().enumerate() {
            if !self.says_commanded {
                self.commanded[joint] = self.measured[joint].position;
            }
            *reference = Reference::rest(self.commanded[joint]);
        }
        self.targets.clone_from(&self.references);
        self.efforts.fill(0.0);
        self.at_ns = 0;
        self.orders = [0; MAX_TOOLS];
        self.payload = 0;
        self.outputs = Outputs::default();
        let mut ack = self.answer(Verdict::Welcome, "");
        ack.session = number;
        ack.watchdog_ns = hello.watchdog_ns;
        ack
    }

    /// An answer with what the driver can do and where the arm is.
    fn answer(&self, verdict: Verdict, reason: &str) -> HelloAck {
        let about = &self.about;
        let mut ack = HelloAck::refusal(self.joints(), verdict, reason);
        ack.name = bytes_of(&about.name);
        ack.periods_ns = about.periods_ns;
        ack.delay_ns = about.delay_ns;
        let features = [
            (DriverFeatures::WALL, true),
            (DriverFeatures::LOCK_STEP, about.lock_step),
            (DriverFeatures::OWN_CLOCK, about.own_clock),
            (DriverFeatures::REAL, about.real),
        ];
        let given = features.iter().filter(|(_, given)| *given);
        ack.features = given.fold(0, |bits, (bit, _)| bits | bit);
        for joint in 0..self.joints() {
            ack.position[joint] = self.measured[joint].position;
            ack.commanded[joint] = self.commanded[joint];
            ack.lower[joint] = about.lower[joint];
            ack.upper[joint] = about.upper[joint];
            ack.velocity[joint] = about.velocity[joint];
            ack.acceleration[joint] = about.acceleration[joint];
            ack.jerk[joint] = about.jerk[joint];
        }
        ack
    }

    /// Why there can be no session now.
    fn objection(&self, hello: &Hello) -> Option<(Verdict, String)> {
        if let Err(cause) = hello.check(self.joints()) {
            let verdict = match cause {
                ipc::MessageError::Protocol { .. } => Verdict::WrongProtocol,
                ipc::MessageError::Schema { .. } => Verdict::WrongSchema,
                ipc::MessageError::Joints { .. } => Verdict::WrongJoints,
                ipc::MessageError::Choice { .. } => Verdict::WrongClock,
                _ => Verdict::WrongPeriod,
            };
            return Some((verdict, cause.to_string()));
        }
        if hello.clock == Clock::LockStep as u32 && !self.about.lock_step {
            return Some((
                Verdict::WrongClock,
                "a real arm has its own time: it cannot be driven in lock-step".to_owned(),
            ));
        }
        let [least, most] = self.about.periods_ns;
        if hello.period_ns < least || hello.period_ns > most {
            let period = hello.period_ns as f64 * 1e-6;
            let (least, most) = (least as f64 * 1e-6, most as f64 * 1e-6);
            return Some((
                Verdict::WrongPeriod,
                format!("a period of {period} ms; this arm needs {least} to {most} ms"),
            ));
        }
        if self.about.model != 0 && hello.model != 0 && self.about.model != hello.model {
            return Some((
                Verdict::WrongModel,
                format!(
                    "robot model {:#x} here, {:#x} there",
                    self.about.model, hello.model
                ),
            ));
        }
        match (&self.session, self.state) {
            (Some(session), DriverState::Armed | DriverState::Active)
                if session.process != hello.process =>
            {
                let (owner, process) = (&session.owner, session.process);
                Some(if is_seen(process) {
                    (
                        Verdict::Busy,
                        format!("driven by {owner} (process {process})"),
                    )
                } else {
                    (
                        Verdict::Wait,
                        format!("{owner} (process {process}) is gone: the arm comes to rest"),
                    )
                })
            }
            _ if self.leaving => Some((Verdict::NotReady, "the driver ends".to_owned())),
            _ if !self.is_resting() => Some((Verdict::Wait, "the arm comes to rest".to_owned())),
            _ => None,
        }
    }
}

/// Whether a process runs, as far as the kernel tells this one. One that was killed is gone before the
/// watchdog ends its session.
fn is_seen(process: u32) -> bool {
    Path::new("/proc").join(process.to_string()).exists()
}
