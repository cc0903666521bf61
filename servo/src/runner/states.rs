//! What the driver says in a period: states, faults, the speed that the arm asks for.

use core::sync::atomic::Ordering;

use ipc::{DriverState, StateFlags};
use nalgebra::SVector;
use realtime::{Following, Quantity, Trip};

use super::message::first;
use super::{Runner, Tick};
use crate::event::{Event, Fault, ShortText};

/// The arm asks for less speed below the first share; above the second it no longer does.
const LESS_SPEED: f64 = 0.98;
const FULL_SPEED: f64 = 0.995;

/// A share of the speed below which an arm gets no more time to follow.
const LEAST_SHARE: f64 = 0.2;

impl<const N: usize> Runner<N> {
    /// Looks at what the driver says, if a state came.
    pub(super) fn take_state(&mut self, came: bool, tick: Tick) {
        let is_new =
            self.incoming.session == self.session && self.incoming.sequence > self.state.sequence;
        if !(came && is_new) {
            self.quiet += 1;
            let silent = self.quiet as f64 * self.period;
            if silent > self.config.patience.as_secs_f64() {
                self.latch(Fault::DriverLost {
                    silent_ms: (silent * 1e3) as u64,
                });
            }
            return;
        }
        if let Err(cause) = self.incoming.check(N) {
            self.latch(Fault::BadState(cause));
            return;
        }
        self.quiet = 0;
        core::mem::swap(&mut self.state, &mut self.incoming);
        self.heed(tick);
    }

    /// Acts on a good state.
    fn heed(&mut self, tick: Tick) {
        let state = &self.state;
        self.shared
            .driver_missed
            .store(state.missed, Ordering::Relaxed);
        if tick.now_ns >= state.published_ns {
            self.shared
                .state_age
                .count(tick.now_ns - state.published_ns);
        }
        match state.driver() {
            DriverState::Stopping | DriverState::Fault => {
                let joint = (state.fault_joint < N as u32).then_some(state.fault_joint);
                let fault = Fault::DriverFault {
                    code: state.fault_code(),
                    joint,
                    number: state.fault_code,
                    text: ShortText(state.fault_bytes()),
                };
                self.latch(fault);
            }
            DriverState::Active => self.ready = true,
            _ => {}
        }
        self.watch_speed();
        if self.is_blind() {
            return;
        }
        if self.ready
            && self.fault.is_none()
            && let Some(trip) = self.check_following()
        {
            self.latch(Fault::Limit(trip));
        }
    }

    /// Whether the driver does not know where the arm is; for too long it is a fault.
    fn is_blind(&mut self) -> bool {
        if self.state.flags & StateFlags::UNKNOWN == 0 {
            self.blind = 0;
            return false;
        }
        self.blind += 1;
        let silent = self.blind as f64 * self.period;
        if silent > self.config.patience.as_secs_f64() {
            self.latch(Fault::Unmeasured {
                silent_ms: (silent * 1e3) as u64,
            });
        }
        true
    }

    /// Reports that the arm begins or ends to ask for less speed.
    fn watch_speed(&mut self) {
        let share = self.state.speed_scaling;
        let slowed = share < if self.slowed { FULL_SPEED } else { LESS_SPEED };
        if slowed != self.slowed {
            self.slowed = slowed;
            self.report(Event::SpeedAsked {
                share,
                tick: self.tick,
            });
        }
    }

    /// Whether the arm follows what the driver commands, and the driver the setpoints.
    ///
    /// An arm that does not follow is held or too weak: that must be seen soon. A driver may be a stall
    /// away from the setpoints and then returns to them within the limits of the joints: behind them
    /// after a stall of its own, ahead of them after one of this thread. It stops by itself when a stall
    /// is longer than the watchdog, so the way of that time is the most that is allowed for.
    fn check_following(&self) -> Option<Trip> {
        let allowed = self.config.following;
        let share = self.state.speed_scaling.clamp(LEAST_SHARE, 1.0);
        let late = |delay: f64| Following {
            base: allowed.base,
            delay,
        };
        let told = self.state.flags & StateFlags::COMMANDED != 0;
        // Where the controller does not say what it commands, the state has what the driver told it: the arm
        // follows that later, by the driver's own delay.
        let of_arm = allowed.delay + if told { 0.0 } else { self.delay };
        // An arm that slows its own time down is later still, until the engine has slowed down too.
        let of_driver = (allowed.delay + self.delay) / share + self.config.watchdog.as_secs_f64();
        let commanded: SVector<f64, N> = first(&self.state.commanded);
        let (measured, speed) = (self.measured(), &self.speed);
        let arm = || late(of_arm).check(&commanded, &measured, speed);
        let deviates = late(of_driver).check(&self.published.position, &commanded, speed);
        let quantity = Quantity::Commanded;
        deviates.map(|trip| Trip { quantity, ..trip }).or_else(arm)
    }
}
