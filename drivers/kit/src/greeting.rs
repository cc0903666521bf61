//! Opens or refuses a session.

use ipc::{
    Clock, DriverState, FaultCode, Hello, HelloAck, MAX_TOOLS, Setpoint, Verdict, bytes_of, text_of,
};

use crate::driver::Session;
use crate::{Driver, Reference, Robot};

impl<R: Robot> Driver<R> {
    /// Answers a request for a session at `now_ns`.
    pub fn greet(&mut self, hello: &Hello, now_ns: u64) -> HelloAck {
        let joints = self.joints();
        if let Some((verdict, reason)) = self.objection(hello) {
            let mut ack = HelloAck::refusal(joints, verdict, &reason);
            ack.name = bytes_of(&self.about.name);
            return ack;
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
        self.fresh = false;
        self.last = Setpoint::default();
        self.missed = 0;
        self.received_ns = now_ns;
        self.newest_ns = now_ns;
        self.stepped_ns = 0;
        for (joint, reference) in self.measured.iter().zip(&mut self.references) {
            *reference = Reference::rest(joint.position);
        }
        self.targets.clone_from(&self.references);
        self.orders = [0; MAX_TOOLS];
        self.welcome(number, hello.watchdog_ns)
    }

    fn welcome(&self, session: u64, watchdog_ns: u64) -> HelloAck {
        let mut ack = HelloAck::refusal(self.joints(), Verdict::Welcome, "");
        ack.session = session;
        ack.watchdog_ns = watchdog_ns;
        ack.name = bytes_of(&self.about.name);
        for (joint, measured) in self.measured.iter().enumerate() {
            ack.position[joint] = measured.position;
            ack.lower[joint] = self.about.lower[joint];
            ack.upper[joint] = self.about.upper[joint];
            ack.velocity[joint] = self.about.velocity[joint];
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
                Some((
                    Verdict::Busy,
                    format!("driven by {owner} (process {process})"),
                ))
            }
            _ if self.leaving => Some((Verdict::NotReady, "the driver ends".to_owned())),
            _ if !self.is_resting() => Some((Verdict::NotReady, "the arm still moves".to_owned())),
            _ => None,
        }
    }
}
