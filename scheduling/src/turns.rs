//! Waiting for the other process in lock-step, where two processes take turns many thousand times
//! per second.

use core::time::Duration;
use std::thread;

use crate::now_ns;

/// Most polls before the processor is given away.
const SPINS: u32 = 4000;
/// Most times the processor is given away before the thread sleeps.
const YIELDS: u32 = 4000;
/// If the processor was given away so often in a turn, the other process has its own.
const ALONE: u32 = 4;
/// Giving the processor away may take this long (ns); then another process has used it.
const TAKEN_NS: u64 = 60_000;
/// For so many turns after that, the thread sleeps instead.
const BUSY: u32 = 32;
/// A sleep: as short as the timer allows.
const NAP: Duration = Duration::from_micros(5);

/// Takes away the slack of the calling thread's timer (ns).
fn exact_timer() {
    // SAFETY: this option takes a number and no pointer; it concerns the calling thread only.
    #[expect(unsafe_code, reason = "the standard library has no timer slack")]
    unsafe {
        libc::prctl(libc::PR_SET_TIMERSLACK, 1);
    }
}

/// How a thread waits for its turn. What was right in the turns before is tried first:
///
/// - The other process has a processor of its own: polling, which answers within a microsecond.
/// - Both share a processor: giving it away, so that the other runs at once. Polling would keep it
///   from running.
/// - Further processes want the processor: a short sleep, because a processor that is given away
///   comes back only after a time slice, but a thread that wakes up gets it soon.
///
/// ```
/// let mut turns = scheduling::Turns::new();
/// for turn in 0..3 {
///     let mut polls = 0;
///     while polls < 100 {
///         polls += 1;
///         turns.wait();
///     }
///     turns.next();
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Turns {
    /// Polls of a turn before the processor is given away.
    spins: u32,
    /// For how many turns the processor is not given away.
    busy: u32,
    /// Waits in this turn so far.
    waits: u32,
}

impl Default for Turns {
    fn default() -> Self {
        Self::new()
    }
}

impl Turns {
    /// Begins with polling. From now on, sleeps of the calling thread end as soon as the timer of the
    /// machine allows, not up to 50 us later.
    pub fn new() -> Self {
        exact_timer();
        Self {
            spins: SPINS,
            busy: 0,
            waits: 0,
        }
    }

    /// Waits a little; called after every poll that found nothing. Returns whether the turn has
    /// lasted so long that other things may be looked at.
    pub fn wait(&mut self) -> bool {
        self.waits = self.waits.saturating_add(1);
        if self.waits <= self.spins {
            core::hint::spin_loop();
            return false;
        }
        if self.busy == 0 && self.waits - self.spins <= YIELDS {
            let before = now_ns();
            thread::yield_now();
            if now_ns().saturating_sub(before) > TAKEN_NS {
                self.busy = BUSY;
            }
            return false;
        }
        thread::sleep(NAP);
        true
    }

    /// The message has come: the next turn begins.
    pub fn next(&mut self) {
        let yields = self.waits.saturating_sub(self.spins);
        self.spins = match (self.waits, yields) {
            // It was there already, which tells nothing.
            (0, _) => self.spins,
            // It came while the thread polled, or giving the processor away did not help.
            (_, 0 | ALONE..) if self.busy == 0 => (2 * self.spins).clamp(16, SPINS),
            // The other process could not run while this one polled.
            _ => self.spins / 4,
        };
        self.busy = self.busy.saturating_sub(1);
        self.waits = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message that comes while the thread polls is waited for by polling.
    #[test]
    fn polls_as_long_as_it_helps() {
        let mut turns = Turns::new();
        for _ in 0..10 {
            assert!(!turns.wait());
            turns.next();
        }
        assert_eq!(turns.spins, SPINS);
    }

    /// If the message does not come while the thread polls, it polls less.
    #[test]
    fn gives_the_processor_away_when_polling_finds_nothing() {
        let mut turns = Turns::new();
        for _ in 0..10 {
            for _ in 0..=turns.spins {
                turns.wait();
            }
            turns.next();
        }
        assert!(turns.spins == 0 || turns.busy > 0);
        // And back, when the other process has its own processor again.
        turns.busy = 0;
        for _ in 0..turns.spins + ALONE {
            turns.wait();
        }
        turns.busy = 0;
        turns.next();
        assert!(turns.spins >= 16);
    }

    /// Every wait ends: after polls and yields the thread sleeps.
    #[test]
    fn sleeps_in_the_end() {
        let mut turns = Turns::new();
        let most = SPINS + YIELDS + 1;
        assert!((0..most).any(|_| turns.wait()));
    }
}
