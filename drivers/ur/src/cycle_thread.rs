//! The thread that answers the controller: it reads a state in each cycle and sends a setpoint.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use driver_kit::{
    About, Reference, Resampler, ResamplerOptions, RobotFault, TimedReferences, pause,
};
use ipc::{bytes_of, text_of};
use rtrb::{Consumer, Producer};
use scheduling::now_ns;

use crate::link::{Link, Refusal};
use crate::rtde::Cycle;
use crate::snapshot::{Alarm, Connection, Modes, Phase, Snapshot};
use crate::stream::Stream;
use crate::{JOINTS, UrOptions, words};

/// Time between two tries to connect.
const AGAIN: Duration = Duration::from_millis(500);

/// The controller is lost when it sends nothing for this time (ns).
const SILENCE: u64 = 500_000_000;

/// How much more than the plan's speeds, accelerations and jerks the setpoints may have: what
/// catching up with the controller's clock needs.
const CATCH_UP: [f64; 3] = [1.02, 1.25, 2.0];

/// States that come together with more others than this show a stall: the program has gone on by
/// itself meanwhile.
const JITTER: u32 = 3;

/// How long the controller's words about an error are waited for (ns).
const WORDS: u64 = 20_000_000;

/// For so many cycles after its connection a program may not be reported as playing yet.
const FIRST: u32 = 100;

/// How many cycles a motion that shall end may take to come to rest.
const PATIENCE: u32 = 1000;

/// Everything that the thread owns.
pub(crate) struct CycleThread {
    pub(crate) options: UrOptions,
    pub(crate) about: About,
    pub(crate) rows: Consumer<TimedReferences<JOINTS>>,
    pub(crate) connections: Consumer<Connection>,
    pub(crate) alarms: Consumer<Alarm>,
    pub(crate) snapshots: Producer<Snapshot>,
    pub(crate) snapshot: Snapshot,
    pub(crate) modes: Arc<Modes>,
}

/// A program that follows.
struct Session {
    stream: Stream,
    resampler: Resampler,
    cycles: u32,
    ending: u32,
    /// The program does not read any more.
    broken: bool,
    /// Since when it does not follow any more (ns).
    failed_ns: Option<u64>,
}

impl CycleThread {
    /// Until the driver ends: connects, serves, connects again.
    pub(crate) fn run(mut self) {
        while !self.ends() {
            let lost = match Link::connect(&self.options, &self.modes) {
                Ok(mut link) => self.serve(&mut link),
                Err(refusal) => refusal,
            };
            self.lose(&lost);
            pause(AGAIN, || self.ends());
        }
    }

    fn ends(&self) -> bool {
        self.modes.stop.load(Ordering::Relaxed)
    }

    /// The connection is lost: during a motion that is a fault.
    fn lose(&mut self, lost: &Refusal) {
        self.modes.connected.store(false, Ordering::Relaxed);
        self.modes.moving.store(false, Ordering::Relaxed);
        self.snapshot.reason = bytes_of(&lost.reason);
        self.snapshot.refused = lost.for_good;
        if self.snapshot.phase == Phase::Moving {
            let text = format!("the connection is lost: {}", lost.reason);
            self.snapshot.fault = Some(RobotFault::new(None, 0, &text));
        }
        self.snapshot.phase = Phase::Disconnected;
        // A program that connected before is not served after it.
        while self.connections.pop().is_ok() {}
        self.tell();
    }

    fn tell(&mut self) {
        // A full ring has a kit that does not run; the newest states will come.
        let _ = self.snapshots.push(self.snapshot);
    }

    /// Answers cycles until the connection is lost; returns why.
    fn serve(&mut self, link: &mut Link) -> Refusal {
        let mut session: Option<Session> = None;
        self.snapshot.phase = Phase::Idle;
        self.snapshot.refused = false;
        let mut heard_ns = now_ns();
        while !self.ends() {
            let mut last = self.snapshot.cycle.timestamp;
            let count = match link.read() {
                Ok(count) => count,
                Err(lost) => return lost,
            };
            let now = now_ns();
            if count > 0 {
                heard_ns = now;
            } else if now.saturating_sub(heard_ns) > SILENCE {
                return Refusal::lost("the controller sends nothing");
            }
            let mut passed = 0;
            for index in 0..count {
                let Some(cycle) = link.cycle(index) else {
                    continue;
                };
                // After a gap the controller may have left out packages.
                let cycles = ((cycle.timestamp - last) / link.period()).round();
                passed += cycles.clamp(1.0, 50.0) as u32;
                last = cycle.timestamp;
                self.snapshot.cycle = cycle;
                self.snapshot.received_ns = now;
                self.modes.take(&cycle);
            }
            if let (Some(session), 1..) = (&mut session, count) {
                session.go_on(&mut self.rows, passed, link.period(), self.options.timeout);
                session.failed_ns = session.failed_ns.or(session.broken.then_some(now));
            }
            if count > 0 {
                session = self.answer(session, link, now);
                self.tell();
            }
        }
        if let Some(session) = &mut session {
            session.stream.end();
        }
        Refusal::lost("the driver ends")
    }

    /// What comes after the newest cycle: the setpoint is sent, a program begins or ends.
    fn answer(&mut self, session: Option<Session>, link: &Link, now: u64) -> Option<Session> {
        let Some(mut session) = session else {
            return self.welcome(link);
        };
        self.snapshot.delay = session.resampler.delay();
        if let Some(failed) = session.failed_ns {
            return self.find_words(session, failed, now);
        }
        let cycle = self.snapshot.cycle;
        session.cycles += 1;
        if session.stream.is_closed() || has_failed(&cycle, session.cycles) {
            session.failed_ns = Some(now);
            return Some(session);
        }
        if self.modes.ending.load(Ordering::Relaxed) {
            session.ending += 1;
        }
        if session.ending > 0 && (session.resampler.is_resting() || session.ending > PATIENCE) {
            session.stream.end();
            self.modes.moving.store(false, Ordering::Relaxed);
            self.snapshot.phase = Phase::Idle;
            return None;
        }
        Some(session)
    }

    /// A program that has connected begins where the controller holds the arm.
    fn welcome(&mut self, link: &Link) -> Option<Session> {
        let connection = self.connections.pop().ok()?;
        let mut resampler = self.resampler(link.period())?;
        while self.rows.pop().is_ok() {}
        while self.alarms.pop().is_ok() {}
        let at = self.snapshot.cycle.target_q;
        resampler.begin(&at);
        self.snapshot.fault = None;
        self.snapshot.phase = Phase::Moving;
        self.modes.moving.store(true, Ordering::Relaxed);
        Some(Session {
            stream: Stream::new(connection.stream, at),
            resampler,
            cycles: 0,
            ending: 0,
            broken: false,
            failed_ns: None,
        })
    }

    fn resampler(&self, period: f64) -> Option<Resampler> {
        let delay = self.options.delay;
        let options = ResamplerOptions::of_shares(&self.about, delay, period, CATCH_UP);
        // The options were checked before the thread began.
        Resampler::new(&self.about, options).ok()
    }

    /// The program does not follow any more: says why, as soon as that is known.
    fn find_words(&mut self, session: Session, failed: u64, now: u64) -> Option<Session> {
        let alarm = self.alarms.pop().ok();
        if alarm.is_none() && now.saturating_sub(failed) < WORDS {
            return Some(session);
        }
        let cause = words::cause(&self.snapshot.cycle);
        let said = alarm.map(|alarm| {
            let text = text_of(&alarm.text);
            if alarm.code > 0 {
                format!("C{}A{}: {text}; ", alarm.code, alarm.argument)
            } else {
                format!("{text}; ")
            }
        });
        let code = alarm.map_or(0, |alarm| alarm.code.max(0) as u32);
        let text = format!("{}{cause}", said.unwrap_or_default());
        self.snapshot.fault = Some(RobotFault::new(None, code, &text));
        self.snapshot.phase = Phase::Faulted;
        self.modes.moving.store(false, Ordering::Relaxed);
        None
    }
}

impl Session {
    /// Moves on by `passed` cycles of `period` (s), and sends a setpoint for each.
    fn go_on(
        &mut self,
        rows: &mut Consumer<TimedReferences<JOINTS>>,
        passed: u32,
        period: f64,
        timeout: f64,
    ) {
        while let Ok(row) = rows.pop() {
            self.resampler.push(row.at_ns, &row.joints);
        }
        if self.failed_ns.is_some() {
            return;
        }
        let mut sent = Ok(());
        for number in 1..=passed {
            if passed > JITTER {
                if number < passed {
                    self.resampler.next(period);
                    sent = sent.and(self.stream.confirm(timeout));
                    continue;
                }
                let (at, speed) = self.stream.gone_on();
                let there: [Reference; JOINTS] = core::array::from_fn(|joint| Reference {
                    position: at[joint],
                    velocity: speed[joint] / period,
                    acceleration: 0.0,
                });
                self.resampler.rejoin(&there);
            }
            let command = self.resampler.next(period);
            let joints: [f64; JOINTS] =
                core::array::from_fn(|joint| command.get(joint).map_or(0.0, |at| at.position));
            sent = sent.and(self.stream.send(&joints, timeout));
        }
        self.broken |= sent.is_err();
    }
}

/// Whether the controller does not move the arm for the program any more.
fn has_failed(cycle: &Cycle, cycles: u32) -> bool {
    !words::is_safe(cycle.safety_mode)
        || cycle.robot_mode != words::RUNNING
        || (cycles > FIRST && cycle.runtime_state != words::PLAYING)
}
