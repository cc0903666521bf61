//! Output of the real-time thread in a period: the setpoint, and the progress of the motion.

use ipc::{MAX_JOINTS, Setpoint, SetpointFlags};
use nalgebra::SVector;
use realtime::Demand;

use super::{Runner, Tick};
use crate::orders::Progress;
use crate::remote::Measured;

impl<const N: usize> Runner<N> {
    pub(super) fn share_position(&self) {
        let resting = self.cycle.is_resting();
        let time_scaling = if resting {
            0.0
        } else {
            self.cycle.time_scaling()
        };
        let idle = self.cycle.is_idle()
            && self.items.is_empty()
            && self.tool.is_none()
            && self.awaited.is_empty()
            && self.watch.is_none();
        self.shared.write(&Measured {
            position: self.measured(),
            velocity: first(&self.state.velocity),
            setpoint: self.published.position,
            time_scaling,
            resting,
            idle,
            faulted: self.fault.is_some(),
            held: false,
            tools: self.state.tools.map(|tool| tool.status),
            speed_asked: self.state.speed_scaling,
            command: self.cycle.command(),
            path_time: self.cycle.path_time(),
        });
        self.shared.orders.tell(&Progress {
            order: self.asked.order(),
            tick: self.tick,
            time_scaling,
            resting,
            held: self.asked.holds(),
            idle,
            ..Progress::default()
        });
    }

    /// What is the same in all messages of a session.
    pub(super) fn begin_messages(&mut self) {
        self.message = Setpoint {
            joints: N as u32,
            session: self.session,
            period_ns: self.config.period_ns(),
            watchdog_ns: self.config.watchdog.as_nanos() as u64,
            valid: (1_u32 << N) - 1,
            payload: self.payload,
            revision: 1,
            ..Setpoint::default()
        };
    }

    /// Tools or payload of the message are others now.
    pub(super) fn revise(&mut self) {
        self.message.payload = self.payload;
        self.message.revision = self.message.revision.wrapping_add(1).max(1);
    }

    /// Writes the message of the period over the last one.
    pub(super) fn write_message(&mut self, tick: Tick) {
        let resting = self.cycle.is_resting();
        let stopping = !resting && matches!(self.demand(), Demand::Stop(_));
        let message = &mut self.message;
        message.sequence += 1;
        message.tick = tick.number;
        message.published_ns = tick.now_ns;
        message.tick_ns = tick.begin_ns;
        message.state_sequence = self.state.sequence;
        message.command = self.cycle.command();
        message.flags = if resting {
            SetpointFlags::HOLD
        } else if stopping {
            SetpointFlags::STOPPING
        } else {
            0
        };
        message.path_time = self.cycle.path_time();
        message.time_scaling = self.cycle.time_scaling();
        let published = &self.published;
        put(&mut message.position, &published.position);
        put(&mut message.velocity, &published.velocity);
        put(&mut message.acceleration, &published.acceleration);
        if let Some(feed_forward) = &self.config.feed_forward {
            let joints = [
                published.position,
                published.velocity,
                published.acceleration,
            ];
            put(&mut message.effort, &feed_forward.efforts(&joints));
            message.flags |= SetpointFlags::EFFORT;
        }
    }
}

/// Reads the numbers of the arm's joints from a message.
pub(super) fn first<const N: usize>(all: &[f64; MAX_JOINTS]) -> SVector<f64, N> {
    SVector::from_fn(|joint, _| all.get(joint).copied().unwrap_or(0.0))
}

/// Writes the numbers of the arm's joints into a message.
fn put<const N: usize>(all: &mut [f64; MAX_JOINTS], joints: &SVector<f64, N>) {
    for (to, from) in all.iter_mut().zip(joints.as_slice()) {
        *to = *from;
    }
}
