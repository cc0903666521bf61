//! The thread that owns the socket: it answers each telegram of the controller.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use driver_kit::{About, Resampler, ResamplerOptions, TimedReferences};
use rtrb::{Consumer, Producer};
use scheduling::now_ns;

use crate::telegram::{Telegram, answer, read};
use crate::{JOINTS, KukaOptions};

/// The longest telegram that is read (bytes).
const LONGEST: usize = 4096;

/// After this silence the next telegram begins a new connection (ns): RSI was switched off.
pub(crate) const SILENCE: u64 = 500_000_000;

/// How much of a cycle's length counts in the estimate of all, and how far that may be from the length
/// that was set, as a share.
const ESTIMATE: f64 = 0.004;
const CYCLES: [f64; 2] = [0.8, 2.5];

/// Cycles in a row whose length counts; after more the telegrams were late.
const TOGETHER: f64 = 3.0;

/// One telegram, and what was answered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Snapshot {
    /// When it was received (ns of `CLOCK_MONOTONIC`); 0 before the first.
    pub(crate) received_ns: u64,
    pub(crate) telegram: Telegram,
    /// What the arm was told (rad).
    pub(crate) commanded: [f64; JOINTS],
    /// Counts the connections of the controller.
    pub(crate) connections: u32,
    /// Telegrams of this connection.
    pub(crate) cycles: u64,
    /// Whether the references are followed.
    pub(crate) follows: bool,
    /// How far the corrections are behind the newest reference (s).
    pub(crate) delay: f64,
}

/// Everything that the thread owns.
pub(crate) struct SocketThread {
    pub(crate) options: KukaOptions,
    pub(crate) socket: UdpSocket,
    pub(crate) about: About,
    /// The maker's limits for the resampler; its period is that of the estimate.
    pub(crate) limits: ResamplerOptions,
    pub(crate) resampler: Resampler,
    /// Length of a cycle, estimated from the arrivals (s).
    pub(crate) cycle: f64,
    pub(crate) rows: Consumer<TimedReferences<JOINTS>>,
    /// Whether the references shall be followed.
    pub(crate) follow: Arc<AtomicBool>,
    pub(crate) snapshots: Producer<Snapshot>,
    pub(crate) snapshot: Snapshot,
    /// Where the joints were when RSI was switched on (rad).
    pub(crate) origin: [f64; JOINTS],
    pub(crate) stop: Arc<AtomicBool>,
}

impl SocketThread {
    /// Answers until the driver ends.
    pub(crate) fn run(mut self) {
        let mut bytes = [0; LONGEST];
        let mut text = String::with_capacity(LONGEST);
        while !self.stop.load(Ordering::Relaxed) {
            let (length, from) = match self.socket.recv_from(&mut bytes) {
                Ok(received) => received,
                // Nothing came for a while, or an answer that nobody took came back.
                Err(_) => continue,
            };
            let telegram = bytes
                .get(..length)
                .and_then(|bytes| core::str::from_utf8(bytes).ok());
            let Some(telegram) = telegram.and_then(read) else {
                continue;
            };
            let commanded = self.command(&telegram);
            let corrections: [f64; JOINTS] =
                core::array::from_fn(|joint| commanded[joint] - self.origin[joint]);
            answer(&mut text, &corrections, telegram.ipoc);
            // A lost answer is counted by the controller.
            let _ = self.socket.send_to(text.as_bytes(), from);
            // A full ring has a kit that does not run; the newest telegrams will come.
            let _ = self.snapshots.push(self.snapshot);
        }
    }

    /// What the joints shall do in this cycle (rad).
    fn command(&mut self, telegram: &Telegram) -> [f64; JOINTS] {
        let now = now_ns();
        let last = self.snapshot;
        let silent = now.saturating_sub(last.received_ns) > SILENCE;
        if silent || telegram.ipoc <= last.telegram.ipoc {
            self.origin = telegram.angles;
            self.snapshot.commanded = telegram.angles;
            self.snapshot.connections = last.connections.wrapping_add(1);
            self.snapshot.cycles = 0;
            self.snapshot.follows = false;
            // A new connection is followed only when it is asked for again.
            self.follow.store(false, Ordering::Relaxed);
        }
        self.snapshot.received_ns = now;
        self.snapshot.telegram = *telegram;
        self.snapshot.cycles += 1;
        let passed = self.passed(&last, now);
        let follow = self.follow.load(Ordering::Relaxed);
        if follow && !self.snapshot.follows {
            self.begin();
        }
        while let Ok(row) = self.rows.pop() {
            if follow {
                self.resampler.push(row.at_ns, &row.joints);
            }
        }
        self.snapshot.follows = follow;
        if follow {
            let advance = if last.follows {
                passed * self.cycle
            } else {
                0.0
            };
            let command = self.resampler.next(advance);
            for (to, from) in self.snapshot.commanded.iter_mut().zip(command) {
                *to = from.position;
            }
            self.snapshot.delay = self.resampler.delay();
        }
        self.snapshot.commanded
    }

    /// How many cycles of the controller have passed; learns how long they are. The time stamps count
    /// cycles of the length that was set; the arm moves in cycles as they are.
    fn passed(&mut self, last: &Snapshot, now: u64) -> f64 {
        let set = self.options.cycle;
        let newest = self.snapshot.telegram.ipoc;
        let passed = newest.saturating_sub(last.telegram.ipoc) as f64 * 1e-3 / set;
        let passed = passed.round().clamp(1.0, 25.0);
        if self.snapshot.cycles > 1 && passed <= TOGETHER {
            let length = now.saturating_sub(last.received_ns) as f64 * 1e-9 / passed;
            self.cycle += (length - self.cycle) * ESTIMATE;
            self.cycle = self.cycle.clamp(CYCLES[0] * set, CYCLES[1] * set);
        }
        passed
    }

    /// Begins to follow, where the arm was told to be.
    fn begin(&mut self) {
        let limits = ResamplerOptions {
            period: self.cycle,
            ..self.limits.clone()
        };
        // They were checked before the thread began.
        if let Ok(resampler) = Resampler::new(&self.about, limits) {
            self.resampler = resampler;
        }
        self.resampler.begin(&self.snapshot.commanded);
    }
}
