//! What the robot follows in a period: setpoints, their continuation, or a stop; always within the
//! limits of the joints.

use ipc::{Clock, DriverState, Setpoint, SetpointFlags};

use crate::{Command, Driver, Outputs, Reference, Robot};

/// Time in which a feed-forward effort fades where the engine sends none (s).
const FADE: f64 = 0.02;

/// The setpoint of a period.
enum Heard<'a> {
    Nothing,
    /// The newest one.
    Last,
    One(&'a Setpoint),
}

impl<R: Robot> Driver<R> {
    /// The references of this period of `period_ns`, which ends at `now_ns`. A robot whose
    /// controller has a clock of its own gets one for each period since the last, any other robot
    /// gets the newest.
    pub(crate) fn refer(&mut self, now_ns: u64, period_ns: u64) {
        let wall = self.clock() != Some(Clock::LockStep);
        if !self.is_following() {
            self.waiting.clear();
            self.came = false;
            return self.rest_or_stop(now_ns, period_ns, wall);
        }
        let came = core::mem::take(&mut self.came);
        if self.about.own_clock && wall {
            return self.refer_each(now_ns, period_ns);
        }
        self.waiting.clear();
        let label = came.then(|| self.label(&self.last, now_ns));
        let next = self.at_ns.saturating_add(period_ns);
        let at_ns = label.filter(|label| self.at_ns == 0 || *label > self.at_ns + period_ns / 2);
        self.at_ns = at_ns.unwrap_or(next);
        self.approach(if came { Heard::Last } else { Heard::Nothing }, period_ns);
    }

    /// One reference for each period since the last one.
    fn refer_each(&mut self, now_ns: u64, period_ns: u64) {
        let most = self.watchdog_ns().unwrap_or(0) / period_ns + 1;
        let mut made = false;
        while let Some(setpoint) = self.waiting.pop_front() {
            let label = self.label(&setpoint, now_ns);
            if self.at_ns == 0 {
                self.at_ns = label.saturating_sub(period_ns);
            }
            let since = label
                .saturating_add(period_ns / 2)
                .saturating_sub(self.at_ns);
            let periods = (since / period_ns).min(most);
            if periods == 0 {
                self.take_late(&setpoint, label, period_ns);
                continue;
            }
            for _ in 1..periods {
                self.at_ns += period_ns;
                self.approach(Heard::Nothing, period_ns);
            }
            self.at_ns = label.max(self.at_ns + 1);
            self.approach(Heard::One(&setpoint), period_ns);
            made = true;
        }
        if !made {
            let late = now_ns.saturating_sub(self.at_ns) / period_ns;
            for _ in 0..late.min(most) {
                self.at_ns += period_ns;
                self.approach(Heard::Nothing, period_ns);
            }
        }
    }

    /// The time of a setpoint (ns); a time that makes no sense is brought near to now.
    fn label(&self, setpoint: &Setpoint, now_ns: u64) -> u64 {
        match self.session.as_ref() {
            Some(session) if session.clock == Clock::Wall => {
                let (least, most) = (
                    now_ns.saturating_sub(session.watchdog_ns),
                    now_ns.saturating_add(session.watchdog_ns),
                );
                setpoint.tick_ns.clamp(least, most)
            }
            _ => setpoint.tick_ns,
        }
    }

    /// A setpoint whose period has passed without it: the continuation starts from it.
    fn take_late(&mut self, setpoint: &Setpoint, label: u64, period_ns: u64) {
        let period = period_ns as f64 * 1e-9;
        let late = (self.at_ns.saturating_sub(label) + period_ns / 2) / period_ns;
        let joints = self.limiters.iter().zip(&mut self.targets).enumerate();
        for (joint, (limiter, target)) in joints {
            *target = wanted(setpoint, joint);
            for _ in 0..late.min(16) {
                *target = limiter.go_on(target, period);
            }
        }
    }

    /// One period towards a setpoint, or towards the continuation of the last one.
    fn approach(&mut self, heard: Heard<'_>, period_ns: u64) {
        let period = period_ns as f64 * 1e-9;
        let setpoint = match heard {
            Heard::Nothing => None,
            Heard::Last => Some(&self.last),
            Heard::One(setpoint) => Some(setpoint),
        };
        let joints = self.references.iter_mut().zip(&mut self.targets);
        for (joint, (limiter, (reference, target))) in self.limiters.iter().zip(joints).enumerate()
        {
            *target = match setpoint {
                Some(setpoint) => wanted(setpoint, joint),
                None => limiter.go_on(target, period),
            };
            *reference = limiter.approach(reference, target, period);
        }
        let forward = setpoint.filter(|setpoint| setpoint.flags & SetpointFlags::EFFORT != 0);
        for (joint, effort) in self.efforts.iter_mut().enumerate() {
            *effort = match forward {
                Some(setpoint) => setpoint.effort[joint],
                None => *effort * (1.0 - (period / FADE).min(1.0)),
            };
        }
        self.send(self.at_ns, period);
    }

    /// A period without an engine that moves the arm: a stop, or rest.
    fn rest_or_stop(&mut self, now_ns: u64, period_ns: u64, wall: bool) {
        let stops = matches!(
            self.state,
            DriverState::Stopping | DriverState::Disconnected
        );
        if !stops || self.at_ns == 0 {
            // The next session has times of its own.
            self.at_ns = 0;
            return self.one_at_rest(false, now_ns, period_ns);
        }
        let most = self.watchdog_ns().unwrap_or(0) / period_ns + 1;
        let late = now_ns.saturating_sub(self.at_ns) / period_ns;
        let periods = if self.about.own_clock && wall {
            late.clamp(1, most)
        } else {
            1
        };
        for _ in 0..periods {
            self.at_ns = self.at_ns.saturating_add(period_ns);
            self.one_at_rest(true, self.at_ns, period_ns);
        }
    }

    /// One period of a stop, or of rest.
    fn one_at_rest(&mut self, stops: bool, at_ns: u64, period_ns: u64) {
        let period = period_ns as f64 * 1e-9;
        for (joint, limiter) in self.limiters.iter().enumerate() {
            let reference = &mut self.references[joint];
            *reference = if self.lost {
                Reference::rest(self.commanded[joint])
            } else if stops {
                limiter.stop(reference, period)
            } else {
                Reference::rest(reference.position)
            };
            self.efforts[joint] *= 1.0 - (period / FADE).min(1.0);
        }
        self.send(at_ns, period);
    }

    fn send(&mut self, at_ns: u64, period: f64) {
        // A controller with a clock of its own holds the arm by itself: outside a session it is told
        // nothing, because the references are those of another one.
        let holds = !self.is_following() && self.state != DriverState::Stopping;
        if self.about.own_clock && holds {
            return;
        }
        self.robot.follow(&Command {
            joints: &self.references,
            effort: &self.efforts,
            at_ns,
            period,
        });
    }

    /// Passes on orders to tools, payload and outputs that are new.
    pub(crate) fn give_orders(&mut self) {
        for (tool, order) in self.last.tools.iter().enumerate() {
            if order.order == self.orders[tool] {
                continue;
            }
            self.orders[tool] = order.order;
            if order.action != ipc::ToolAction::None as u32 {
                self.robot.act(tool, order);
            }
        }
        let last = &self.last;
        if last.payload.number != self.payload {
            self.payload = last.payload.number;
            self.robot.carry(&last.payload);
        }
        let outputs = Outputs {
            digital: last.digital_outputs,
            digital_mask: last.digital_mask,
            analogue: last.analogue_outputs,
            analogue_mask: last.analogue_mask,
        };
        if outputs != self.outputs {
            self.outputs = outputs;
            self.robot.set_outputs(&outputs);
        }
    }
}

/// What a setpoint wants of a joint.
fn wanted(setpoint: &Setpoint, joint: usize) -> Reference {
    Reference {
        position: setpoint.position[joint],
        velocity: setpoint.velocity[joint],
        acceleration: setpoint.acceleration[joint],
    }
}
