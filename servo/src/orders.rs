//! Orders to the real-time thread and its progress, in atomics only.
//!
//! An order is one atomic operation. It goes through no thread that plans, prints or serves, it
//! needs no lock, and the real-time thread reads it in its next period. Orders are numbered, so
//! that the thread that gave one can see when it acts: [`Steering::progress`].

use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering, fence};
use std::sync::Arc;

use realtime::{Demand, StopCategory};
use thiserror::Error;

use super::control::Control;

/// The demanded behaviour of the arm, as two bits of the word of orders.
const RUN: u64 = 0;
const GENTLE: u64 = 1;
const FAST: u64 = 2;
const DEMAND: u64 = 3;

/// Whether the last abort found a fast stop in force.
const ABORT_FAST: u64 = 4;

/// The count of aborts: bits 8 to 31. The number of the order: bits 32 to 63.
const ABORT: u64 = 1 << 8;
const ABORTS: u64 = 0x00ff_ff00;
const ORDER: u64 = 1 << 32;

/// The orders, as the real-time thread reads them once per period: all at once, so that no order is
/// lost between two others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Asked {
    word: u64,
    share: f64,
}

impl Asked {
    /// The number of the newest order.
    pub(super) fn order(self) -> u32 {
        (self.word >> 32) as u32
    }

    /// How many aborts were asked for.
    pub(super) fn aborts(self) -> u32 {
        ((self.word & ABORTS) >> 8) as u32
    }

    /// How the last abort comes to rest.
    pub(super) fn abort_category(self) -> StopCategory {
        if self.word & ABORT_FAST == 0 {
            StopCategory::Gentle
        } else {
            StopCategory::Fast
        }
    }

    /// Whether a pause or stop is in force.
    pub(super) fn holds(self) -> bool {
        self.word & DEMAND != RUN
    }

    pub(super) fn demand(self) -> Demand {
        match self.word & DEMAND {
            RUN => Demand::Run(self.share),
            GENTLE => Demand::Stop(StopCategory::Gentle),
            _ => Demand::Stop(StopCategory::Fast),
        }
    }
}

/// Where the motion is after a period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Number of the newest order that acts; see [`Steering::control`].
    pub order: u32,
    /// The period since the start.
    pub tick: u64,
    /// Share of the planned speed; 0 at rest.
    pub time_scaling: f64,
    /// Whether the last setpoint rests.
    pub resting: bool,
    /// Whether a pause or stop holds the arm.
    pub held: bool,
    /// Whether nothing is left to execute in the real-time thread.
    pub idle: bool,
    /// Number of the latched fault, from 1; 0 without one.
    pub fault: u32,
    /// Whether the thread has ended.
    pub ended: bool,
}

impl Progress {
    /// Whether the order of this number acts.
    pub fn has(&self, order: u32) -> bool {
        self.order.wrapping_sub(order) <= u32::MAX / 2
    }
}

/// There is nothing to recover from.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("no fault is latched, there is nothing to recover from")]
pub struct NoFault;

/// The numbers that both sides see.
#[derive(Debug, Default)]
pub(super) struct Orders {
    word: AtomicU64,
    /// Fraction of the planned speed, as its distance from 1 in bits: 0 is full speed.
    share: AtomicU64,
    /// Number of the last order that resumes the motion.
    resumed: AtomicU32,
    /// Number of the latched fault, the number of faults so far, and which one should be cleared.
    fault: AtomicU32,
    faults: AtomicU32,
    recover: AtomicU32,
    shutdown: AtomicBool,
    ended: AtomicBool,
    version: AtomicU32,
    seen: AtomicU32,
    tick: AtomicU64,
    time_scaling: AtomicU64,
    flags: AtomicU32,
}

/// Share of full speed.
const FULL: u64 = 1.0_f64.to_bits();

impl Orders {
    /// What is asked for now.
    pub(super) fn asked(&self) -> Asked {
        // The share is stored before the order's number: a thread that sees the number also sees
        // the share.
        let word = self.word.load(Ordering::Acquire);
        let share = f64::from_bits(self.share.load(Ordering::Acquire) ^ FULL);
        Asked { word, share }
    }

    /// Whether something was asked for after `asked`.
    pub(super) fn is_newer(&self, asked: Asked) -> bool {
        self.word.load(Ordering::Acquire) != asked.word
    }

    /// Latches a fault: until it is cleared there is something to recover from.
    pub(super) fn latch(&self) {
        let number = self.faults.fetch_add(1, Ordering::AcqRel).wrapping_add(1);
        self.fault.store(number.max(1), Ordering::Release);
    }

    /// The fault is cleared.
    pub(super) fn clear(&self) {
        self.fault.store(0, Ordering::Release);
    }

    /// Whether the latched fault should be cleared. An order about another fault has no effect.
    pub(super) fn wants_recovery(&self) -> bool {
        let fault = self.fault.load(Ordering::Acquire);
        fault != 0 && self.recover.load(Ordering::Acquire) == fault
    }

    pub(super) fn is_shutting_down(&self) -> bool {
        self.shutdown.load(Ordering::Acquire)
    }

    /// The thread has ended.
    pub(super) fn end(&self) {
        self.ended.store(true, Ordering::Release);
    }

    /// Publishes the progress of the motion after a period; only the real-time thread calls it.
    pub(super) fn tell(&self, now: &Progress) {
        let version = self.version.load(Ordering::Relaxed);
        self.version
            .store(version.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        self.seen.store(now.order, Ordering::Relaxed);
        self.tick.store(now.tick, Ordering::Relaxed);
        self.time_scaling
            .store(now.time_scaling.to_bits(), Ordering::Relaxed);
        let flags = [now.resting, now.held, now.idle].into_iter().enumerate();
        let bits = flags.fold(0, |bits, (at, flag)| bits | u32::from(flag) << at);
        self.flags.store(bits, Ordering::Relaxed);
        self.version
            .store(version.wrapping_add(2), Ordering::Release);
    }

    fn give(&self, change: impl Fn(u64) -> u64) -> u32 {
        let next = |word: u64| change(word).wrapping_add(ORDER);
        // The closure never declines, so there is always a word that was replaced.
        let (Ok(before) | Err(before)) =
            self.word
                .fetch_update(Ordering::AcqRel, Ordering::Acquire, |word| Some(next(word)));
        (next(before) >> 32) as u32
    }

    fn control(&self, control: Control) -> u32 {
        let set = |demand| move |word: u64| (word & !DEMAND) | demand;
        match control {
            Control::Pause | Control::Stop { fast: false } => self.give(set(GENTLE)),
            Control::Stop { fast: true } => self.give(set(FAST)),
            Control::Resume => {
                let order = self.give(set(RUN));
                self.resumed.fetch_max(order, Ordering::AcqRel);
                order
            }
            Control::Override(share) => {
                if share.is_finite() {
                    let bits = share.clamp(0.0, 1.0).to_bits() ^ FULL;
                    self.share.store(bits, Ordering::Release);
                }
                self.give(|word| word)
            }
            Control::Abort => self.give(|word| aborted(word, false) & !DEMAND),
            Control::Discard { fast } => self.give(|word| aborted(word, fast)),
        }
    }

    fn progress(&self) -> Progress {
        loop {
            let before = self.version.load(Ordering::Acquire);
            let flags = self.flags.load(Ordering::Relaxed);
            let now = Progress {
                order: self.seen.load(Ordering::Relaxed),
                tick: self.tick.load(Ordering::Relaxed),
                time_scaling: f64::from_bits(self.time_scaling.load(Ordering::Relaxed)),
                resting: flags & 1 != 0,
                held: flags & 2 != 0,
                idle: flags & 4 != 0,
                fault: self.fault.load(Ordering::Acquire),
                ended: self.ended.load(Ordering::Acquire),
            };
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.version.load(Ordering::Relaxed) == before {
                return now;
            }
            std::thread::yield_now();
        }
    }
}

/// The word with one more abort, which is fast where that is asked for or a fast stop is in force.
fn aborted(word: u64, fast: bool) -> u64 {
    let fast = if fast || word & DEMAND == FAST {
        ABORT_FAST
    } else {
        0
    };
    (word & !(ABORTS | ABORT_FAST)) | fast | (word.wrapping_add(ABORT) & ABORTS)
}

/// A handle to control the motion, for an arm with any number of joints. Cheap to clone, usable
/// from any thread; each call is a few atomic operations, whatever other threads do.
#[derive(Clone, Debug)]
pub struct Steering {
    pub(super) orders: Arc<Orders>,
}

impl Steering {
    /// Gives an order, which acts in the next period. Returns the number of the order, for
    /// [`Progress::has`].
    pub fn control(&self, control: Control) -> u32 {
        self.orders.control(control)
    }

    /// Asks for a new session with the driver, which clears the fault that is latched now and drops
    /// everything that was pushed. The answer is an event: [`super::Event::Recovered`], or
    /// [`super::Event::Faulted`] again. Returns the number of the fault, which [`Progress::fault`]
    /// shows until it is cleared.
    ///
    /// # Errors
    /// [`NoFault`]; the request then has no later effect.
    pub fn recover(&self) -> Result<u32, NoFault> {
        match self.orders.fault.load(Ordering::Acquire) {
            0 => Err(NoFault),
            fault => {
                self.orders.recover.store(fault, Ordering::Release);
                Ok(fault)
            }
        }
    }

    /// The progress of the motion, as of the last period.
    pub fn progress(&self) -> Progress {
        self.orders.progress()
    }

    /// Number of aborts asked for. An abort drops the commands given before it.
    pub fn aborts(&self) -> u32 {
        self.orders.asked().aborts()
    }

    /// The number of the newest order.
    pub fn newest(&self) -> u32 {
        self.orders.asked().order()
    }

    /// Whether a [`Control::Resume`] came after the order of this number.
    pub fn was_resumed_after(&self, order: u32) -> bool {
        self.orders.resumed.load(Ordering::Acquire) > order
    }

    /// Asks the thread to come to rest on the path, to say goodbye to the driver and to end.
    pub fn shut_down(&self) {
        self.orders.shutdown.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steering() -> Steering {
        Steering {
            orders: Arc::new(Orders::default()),
        }
    }

    #[test]
    fn orders_are_numbered_and_the_newest_counts() {
        let hand = steering();
        assert_eq!(hand.orders.asked().demand(), Demand::Run(1.0));
        assert_eq!(hand.control(Control::Override(0.3)), 1);
        assert_eq!(hand.orders.asked().demand(), Demand::Run(0.3));
        let fast = hand.control(Control::Stop { fast: true });
        assert_eq!(
            hand.orders.asked().demand(),
            Demand::Stop(StopCategory::Fast)
        );
        let progress = Progress {
            order: fast,
            ..Progress::default()
        };
        assert!(progress.has(1) && progress.has(fast) && !progress.has(fast + 1));
        // An abort cancels the stop, keeps its stop category, and is one order.
        let abort = hand.control(Control::Abort);
        let asked = hand.orders.asked();
        assert_eq!((asked.order(), asked.aborts()), (abort, 1));
        assert_eq!(asked.abort_category(), StopCategory::Fast);
        assert!(!asked.holds());
        // A stop after the abort holds, although the abort cancelled the one before.
        hand.control(Control::Pause);
        let asked = hand.orders.asked();
        assert_eq!((asked.aborts(), asked.holds()), (1, true));
        // What ends by itself does not end the stop, and stops nothing that comes later.
        for (fast, category) in [(false, StopCategory::Gentle), (true, StopCategory::Fast)] {
            hand.control(Control::Discard { fast });
            let asked = hand.orders.asked();
            assert!(asked.holds());
            assert_eq!(asked.abort_category(), category);
        }
        assert_eq!(hand.orders.asked().aborts(), 3);
        hand.control(Control::Override(f64::NAN));
        hand.control(Control::Resume);
        assert_eq!(hand.orders.asked().demand(), Demand::Run(0.3));
        assert!(hand.was_resumed_after(abort) && !hand.was_resumed_after(hand.newest()));
    }

    #[test]
    fn a_free_arm_is_free_after_a_discard() {
        let hand = steering();
        hand.control(Control::Discard { fast: true });
        let asked = hand.orders.asked();
        assert_eq!((asked.aborts(), asked.holds()), (1, false));
        assert_eq!(asked.demand(), Demand::Run(1.0));
    }

    #[test]
    fn a_recovery_is_of_one_fault() {
        let hand = steering();
        assert_eq!(hand.recover(), Err(NoFault));
        hand.orders.latch();
        assert!(
            !hand.orders.wants_recovery(),
            "the refused order acts later"
        );
        assert_eq!(hand.recover(), Ok(1));
        assert!(hand.orders.wants_recovery());
        // Asked for twice, it is done once.
        assert_eq!(hand.recover(), Ok(1));
        hand.orders.clear();
        assert!(!hand.orders.wants_recovery());
        hand.orders.latch();
        assert!(!hand.orders.wants_recovery(), "it was about another fault");
        assert_eq!(hand.progress().fault, 2);
    }

    #[test]
    fn the_counts_wrap() {
        let hand = steering();
        hand.orders
            .word
            .store(!(DEMAND | ABORT_FAST), Ordering::Relaxed);
        assert_eq!(hand.orders.asked().order(), u32::MAX);
        assert_eq!(hand.control(Control::Abort), 0);
        let asked = hand.orders.asked();
        assert_eq!(
            (asked.order(), asked.aborts(), asked.holds()),
            (0, 0, false)
        );
    }
}
