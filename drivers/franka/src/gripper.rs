//! The Franka Hand: its commands block, so they have a thread of their own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, sleep};
use std::time::Duration;

use franka::{FrankaResult, Gripper, GripperState};
use ipc::{ToolAction, ToolCommand, ToolFeedback, ToolFlags, ToolStatus};

use crate::GripperOptions;

/// An opening below which the fingers touch each other (m).
const TOUCH: f64 = 1e-3;

/// Time between two tries to connect.
const AGAIN: Duration = Duration::from_millis(500);

/// What the threads of the gripper know.
#[derive(Debug, Default)]
struct Known {
    status: AtomicU32,
    width: AtomicU64,
    largest: AtomicU64,
    grasped: AtomicBool,
    stop: AtomicBool,
}

/// The kit's end of the gripper.
#[derive(Debug)]
pub(crate) struct Hand {
    known: Arc<Known>,
    orders: Sender<ToolCommand>,
}

impl Hand {
    /// Starts the threads of the gripper at `address`.
    pub(crate) fn start(address: &str, options: GripperOptions) -> Self {
        let known = Arc::new(Known::default());
        let (orders, waiting) = channel();
        let (theirs, address) = (Arc::clone(&known), address.to_owned());
        thread::spawn(move || serve(&address, options, &theirs, &waiting));
        Self { known, orders }
    }

    /// Begins an order.
    pub(crate) fn act(&self, order: &ToolCommand) {
        self.known.set(ToolStatus::Moving);
        if self.orders.send(*order).is_err() {
            self.known.set(ToolStatus::Failed);
        }
    }

    pub(crate) fn feedback(&self) -> ToolFeedback {
        let known = &self.known;
        let object = if known.grasped.load(Ordering::Relaxed) {
            ToolFlags::OBJECT
        } else {
            0
        };
        ToolFeedback {
            status: known.status.load(Ordering::Relaxed),
            position: f64::from_bits(known.width.load(Ordering::Relaxed)),
            flags: ToolFlags::POSITION | ToolFlags::SENSES_OBJECT | object,
            ..ToolFeedback::default()
        }
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        // The threads see it with the next state; nobody waits for them.
        self.known.stop.store(true, Ordering::Relaxed);
    }
}

impl Known {
    fn set(&self, status: ToolStatus) {
        self.status.store(status as u32, Ordering::Relaxed);
    }

    fn take(&self, state: &GripperState) {
        self.width.store(state.width.to_bits(), Ordering::Relaxed);
        self.largest
            .store(state.max_width.to_bits(), Ordering::Relaxed);
        let object = state.is_grasped && state.width > TOUCH;
        self.grasped.store(object, Ordering::Relaxed);
        if self.status.load(Ordering::Relaxed) == ToolStatus::Unknown as u32 {
            self.set(if state.max_width <= 0.0 {
                ToolStatus::NotHomed
            } else if state.width > 0.8 * state.max_width {
                ToolStatus::Open
            } else {
                ToolStatus::Closed
            });
        }
    }
}

/// Connects, and carries out orders, until the hand is dropped.
fn serve(
    address: &str,
    options: GripperOptions,
    known: &Arc<Known>,
    orders: &Receiver<ToolCommand>,
) {
    while !known.stop.load(Ordering::Relaxed) {
        let Ok(gripper) = Gripper::new(address).map(Arc::new) else {
            known.set(ToolStatus::Unknown);
            sleep(AGAIN);
            continue;
        };
        // An order that came while there was no gripper is not carried out later.
        while orders.try_recv().is_ok() {}
        let (reader, seen) = (Arc::clone(&gripper), Arc::clone(known));
        let states = thread::spawn(move || {
            while !seen.stop.load(Ordering::Relaxed) {
                match reader.read_once() {
                    Ok(state) => seen.take(&state),
                    Err(_) => return,
                }
            }
        });
        while !states.is_finished() {
            let Ok(order) = orders.recv_timeout(Duration::from_millis(50)) else {
                continue;
            };
            known.set(match carry_out(&gripper, &order, options, known) {
                Ok(status) => status,
                // The state says more; the engine names the gripper.
                Err(_) => ToolStatus::Failed,
            });
        }
        known.set(ToolStatus::Unknown);
    }
}

/// Carries out an order; returns the status after it.
fn carry_out(
    gripper: &Gripper,
    order: &ToolCommand,
    options: GripperOptions,
    known: &Known,
) -> FrankaResult<ToolStatus> {
    let or = |value: f64, usual: f64| if value > 0.0 { value } else { usual };
    let speed = or(order.velocity, options.speed);
    let largest = f64::from_bits(known.largest.load(Ordering::Relaxed));
    let done = |done: bool, status| if done { status } else { ToolStatus::Failed };
    Ok(match ToolAction::from_number(order.action) {
        Some(ToolAction::Open) => done(gripper.move_gripper(largest, speed)?, ToolStatus::Open),
        Some(ToolAction::Move) => {
            let width = order.position.clamp(0.0, largest);
            done(gripper.move_gripper(width, speed)?, ToolStatus::Reached)
        }
        Some(ToolAction::Home) => done(gripper.homing()?, ToolStatus::Open),
        Some(ToolAction::Close) => {
            let tolerance = or(order.tolerance, largest);
            let force = or(order.force, options.force);
            let width = order.position.max(0.0);
            let held = gripper.grasp(width, speed, force, tolerance, tolerance)?;
            // Without a wanted opening, fingers that close on nothing are closed too.
            done(held || order.tolerance <= 0.0, ToolStatus::Closed)
        }
        Some(ToolAction::None) | None => ToolStatus::Failed,
    })
}
