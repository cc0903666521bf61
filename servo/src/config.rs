//! Configuration of the real-time thread, and why it cannot start.

use core::time::Duration;

use ipc::{Arm, Clock, IpcError, Payload};
use realtime::{Following, JointLimits};
use scheduling::RealTimeRequest;
use thiserror::Error;

use super::feed_forward::FeedForward;

/// When a command is done: the measured arm has arrived where the command ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// How far each joint may be from the end (rad, m).
    pub tolerance: f64,
    /// After this time the command is done with a warning.
    pub patience: Duration,
}

impl Default for Arrival {
    /// A milliradian, half a second.
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            patience: Duration::from_millis(500),
        }
    }
}

/// What the real-time thread needs to know.
#[derive(Clone, Debug)]
pub struct ExecutorConfig<const N: usize> {
    /// The arm, as its driver is named.
    pub arm: Arm,
    /// Setpoints a second, 100 to 4000.
    pub rate_hz: f64,
    /// By the wall clock, or in lock-step with the driver.
    pub clock: Clock,
    /// Limits of the joints, for the last check of each setpoint.
    pub limits: JointLimits<N>,
    /// How far the measured position may be from the setpoint.
    pub following: Following,
    /// The driver stops by itself after this time without setpoints.
    pub watchdog: Duration,
    /// No state for this long means that the driver is lost.
    pub patience: Duration,
    /// How long to look for a driver at the start.
    pub connect: Duration,
    /// How long the driver may take to get ready: brakes open, a program starts.
    pub get_ready: Duration,
    /// Gets what the driver waits for, each time that it changes.
    pub on_wait: fn(&str),
    /// When a command is done.
    pub arrival: Arrival,
    /// [`ipc::model_hash`] of the robot; 0 is any.
    pub model: u64,
    /// What the thread asks of the operating system; nothing of it in lock-step.
    pub real_time: RealTimeRequest,
    /// In lock-step: simulated time is stopped while the planner works or there is nothing to do,
    /// so that the same program gives the same periods. The planner must call
    /// [`super::SegmentSender::settle`].
    pub wait_for_planner: bool,
    /// Whether each setpoint and measured position is recorded for [`super::Samples`].
    pub record: bool,
    /// The efforts that setpoints carry as feed-forward; zeros without.
    pub feed_forward: Option<FeedForward<N>>,
    /// What the arm carries at the start, where it is known; its number is given by the thread.
    pub payload: Option<Payload>,
}

impl<const N: usize> ExecutorConfig<N> {
    /// The usual choice for an arm: 1000 Hz by the clock, watchdog and patience 100 ms.
    pub fn new(arm: Arm, limits: JointLimits<N>) -> Self {
        Self {
            arm,
            rate_hz: 1000.0,
            clock: Clock::Wall,
            limits,
            following: Following {
                base: 0.02,
                delay: 0.03,
            },
            watchdog: Duration::from_millis(100),
            patience: Duration::from_millis(100),
            connect: Duration::from_secs(3),
            get_ready: ipc::READY,
            on_wait: |_| {},
            arrival: Arrival::default(),
            model: 0,
            real_time: RealTimeRequest::default(),
            wait_for_planner: false,
            record: false,
            feed_forward: None,
            payload: None,
        }
    }

    /// Length of a period (ns).
    pub fn period_ns(&self) -> u64 {
        (1e9 / self.rate_hz).round() as u64
    }

    /// Length of a period (s), exactly that of [`Self::period_ns`].
    pub fn period(&self) -> f64 {
        self.period_ns() as f64 * 1e-9
    }

    pub(super) fn check(&self) -> Result<(), ExecutorError> {
        if !(100.0..=4000.0).contains(&self.rate_hz) {
            return Err(ExecutorError::Rate {
                rate_hz: self.rate_hz,
            });
        }
        let limits = &self.limits;
        let named = [
            ("velocity", &limits.velocity),
            ("acceleration", &limits.acceleration),
            ("jerk", &limits.jerk),
        ];
        for (quantity, values) in named {
            for (joint, value) in values.iter().enumerate() {
                if !(value.is_finite() && *value > 0.0) {
                    return Err(ExecutorError::Limit {
                        joint,
                        quantity,
                        value: *value,
                    });
                }
            }
        }
        Ok(())
    }
}

/// Why the executor cannot start.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ExecutorError {
    /// A rate that is not offered.
    #[error("the servo rate must be 100 to 4000 Hz, got {rate_hz}")]
    Rate {
        /// The rate asked for (Hz).
        rate_hz: f64,
    },
    /// A limit that is not positive and finite.
    #[error("joint {joint}: {quantity} limit must be positive and finite, got {value}")]
    Limit {
        /// The joint, from 0.
        joint: usize,
        /// Which limit.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// The driver, or shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The driver agreed to a session but sent no state.
    #[error("{arm}: the driver sent no state within {waited_ms} ms of the handshake")]
    Silent {
        /// The arm.
        arm: String,
        /// How long was waited (ms).
        waited_ms: u64,
    },
    /// The operating system gave no thread.
    #[error("cannot start the real-time thread: {cause}")]
    Thread {
        /// What the operating system said.
        cause: String,
    },
}
