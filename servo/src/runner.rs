//! One period of the real-time thread, without a clock and without a channel.

mod arrival;
mod feed;
mod guards;
mod leaving;
mod message;
mod splices;
mod states;
mod tools;

use core::sync::atomic::Ordering;
use std::collections::VecDeque;
use std::sync::Arc;

use ipc::{HelloAck, Payload, Setpoint, State};
use nalgebra::SVector;
use realtime::{Cycle, Demand, Sample, Step, StopCategory};
use rtrb::{Consumer, Producer, RingBuffer};

use super::config::ExecutorConfig;
use super::end_tolerance::EndTolerance;
use super::event::{Event, Fault, Recorded};
use super::guard::{Guarded, Watch};
use super::monitor::Monitor;
use super::orders::Asked;
use super::remote::{Remote, Shared};
use super::segment_sender::{Item, SegmentSender, ToolOrder};

use arrival::{Awaited, ENDS, WAITING};
use leaving::Leaving;
use message::first;

/// Number of planned segments in the cycle's buffer.
const AT_HAND: usize = 512;

/// Items from the planner.
const RING: usize = 4096;

/// Events and samples that wait for their reader.
const REPORTS: usize = 1 << 14;

/// Guarded commands that wait for their reader.
const GUARDED: usize = 64;

/// How long the speed of a joint counts in its following error (s): an arm that follows late may be far
/// from a plan that rests already.
const MEMORY: f64 = 1.0;

/// When a period runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Its number since the start.
    pub number: u64,
    /// When it should have begun (ns).
    pub begin_ns: u64,
    /// When it began (ns).
    pub now_ns: u64,
    /// Periods before it that were left out.
    pub skipped: u64,
}

/// The current tool order.
#[derive(Clone, Copy, Debug)]
struct Working {
    order: ToolOrder,
    number: u32,
    left: u64,
}

/// The largest delay of a driver that following errors are forgiven for (s).
const LARGEST_DELAY: f64 = 0.2;

/// The work of the real-time thread in a period: it gets states and planned work, and returns
/// setpoints and events. After [`Runner::open`] nothing allocates or waits.
#[derive(Debug)]
pub struct Runner<const N: usize> {
    config: ExecutorConfig<N>,
    period: f64,
    cycle: Box<Cycle<N, AT_HAND>>,
    items: Consumer<Item<N>>,
    events: Producer<Event>,
    samples: Option<Producer<Recorded<N>>>,
    guarded: Producer<Guarded<N>>,
    shared: Arc<Shared<N>>,
    epoch: u32,
    session: u64,
    /// The last setpoint: the message of a period is written over it.
    message: Setpoint,
    /// Where the next state is received.
    incoming: Box<State>,
    /// The last good state of the session.
    state: Box<State>,
    quiet: u64,
    /// Periods since the driver knew where the arm is.
    blind: u64,
    ready: bool,
    /// What is reported when the measured arm has arrived, in order.
    awaited: VecDeque<Awaited<N>>,
    /// How near the arm must come to the ends of commands that are planned, in order.
    ends: VecDeque<EndTolerance<N>>,
    /// How late the arm is by the driver's own delay (s).
    delay: f64,
    /// Whether the arm asks for less speed.
    slowed: bool,
    asked: Asked,
    aborting: Option<StopCategory>,
    leaving: Option<Leaving<N>>,
    stopped: bool,
    fault: Option<Fault>,
    tool: Option<Working>,
    /// The guards of the command that moves.
    watch: Option<Watch<N>>,
    /// A command that a guard has ended: the rest of its segments is dropped.
    dropping: Option<u32>,
    /// A command that came too late to take the place of another: its segments are dropped.
    refused: Option<u32>,
    orders: u32,
    /// What the arm carries, with its number in this session; number 0 where it is not known.
    payload: Payload,
    published: Sample<N>,
    /// How fast the joints moved lately (rad/s): the largest speed, which fades with [`MEMORY`].
    speed: SVector<f64, N>,
    pending: Option<Recorded<N>>,
    tick: u64,
}

impl<const N: usize> Runner<N> {
    /// A runner with its three handles. It needs a session before it moves: [`Runner::open`].
    pub fn new(config: ExecutorConfig<N>) -> (Self, SegmentSender<N>, Remote<N>, Monitor<N>) {
        let shared = Arc::new(Shared::new());
        let (ring, items) = RingBuffer::new(RING);
        let (events, event_reader) = RingBuffer::new(REPORTS);
        let (samples, sample_reader) = RingBuffer::new(if config.record { REPORTS } else { 1 });
        let (guarded, guarded_reader) = RingBuffer::new(GUARDED);
        let rest = SVector::zeros();
        let runner = Self {
            period: config.period(),
            cycle: Box::new(Cycle::new(rest, config.limits, config.period())),
            items,
            events,
            samples: config.record.then_some(samples),
            guarded,
            shared: Arc::clone(&shared),
            epoch: 0,
            session: 0,
            message: Setpoint::default(),
            incoming: Box::default(),
            state: Box::default(),
            quiet: 0,
            blind: 0,
            ready: false,
            awaited: VecDeque::with_capacity(WAITING),
            ends: VecDeque::with_capacity(ENDS),
            delay: 0.0,
            slowed: false,
            asked: shared.orders.asked(),
            aborting: None,
            leaving: None,
            stopped: false,
            fault: None,
            tool: None,
            watch: None,
            dropping: None,
            refused: None,
            orders: 0,
            payload: Payload {
                number: u32::from(config.payload.is_some()),
                ..config.payload.unwrap_or_default()
            },
            published: Sample::rest(rest),
            speed: rest,
            pending: None,
            tick: 0,
            config,
        };
        let sender = SegmentSender {
            ring,
            shared: Arc::clone(&shared),
            epoch: 0,
        };
        let monitor = Monitor::new(event_reader, guarded_reader, sample_reader);
        (runner, sender, Remote { shared }, monitor)
    }

    /// Begins a session at the position that the arm's controller commands; drops the plan and
    /// clears a fault.
    pub fn open(&mut self, ack: &HelloAck) {
        let position = first(&ack.commanded);
        self.cycle.reset(position);
        self.published = Sample::rest(position);
        self.session = ack.session;
        *self.state = State {
            position: ack.position,
            ..State::default()
        };
        // Nothing of another driver, which counts its revisions anew.
        *self.incoming = State::default();
        (self.quiet, self.blind) = (0, 0);
        self.ready = false;
        self.delay = (ack.delay_ns as f64 * 1e-9).min(LARGEST_DELAY);
        self.slowed = false;
        self.forget_ends();
        self.fault = None;
        self.shared.orders.clear();
        self.tool = None;
        self.forget_guards();
        self.orders = 0;
        // A session begins without any.
        self.payload.number = self.payload.number.min(1);
        self.begin_messages();
        self.speed = SVector::zeros();
        self.pending = None;
        self.share_position();
    }

    /// Drops the epoch and reports the new session.
    pub(super) fn recovered(&mut self) {
        self.epoch = self.shared.new_epoch();
        self.report(Event::Recovered { tick: self.tick });
    }

    /// The numbers that both sides see.
    pub(super) fn shared(&self) -> Arc<Shared<N>> {
        Arc::clone(&self.shared)
    }

    /// Latches a fault, also where another is latched already.
    pub(super) fn fail(&mut self, fault: Fault) {
        self.fault = None;
        self.latch(fault);
    }

    /// The current session.
    pub(super) fn session(&self) -> u64 {
        self.session
    }

    /// Whether the operator asked for a new session, and the arm rests so that there may be one.
    pub(super) fn wants_session(&self) -> bool {
        self.shared.orders.wants_recovery() && self.cycle.is_resting()
    }

    /// Whether the reader of samples must catch up before the next period; only lock-step waits.
    pub(super) fn samples_wait(&self) -> bool {
        self.samples
            .as_ref()
            .is_some_and(|samples| samples.slots() == 0 && !samples.is_abandoned())
    }

    /// Whether virtual time may stop: the planner works, or there is nothing to do.
    pub(super) fn may_stand(&self) -> bool {
        if self.aborting.is_some() || self.shared.orders.is_newer(self.asked) {
            return false;
        }
        let held = self.asked.holds();
        let begun = self.ready || self.fault.is_some();
        let at_rest = self.cycle.is_resting() && self.tool.is_none() && self.awaited.is_empty();
        let nothing_to_do = if held {
            self.stopped
        } else {
            self.cycle.is_idle() && self.items.is_empty()
        };
        (begun && at_rest && nothing_to_do) || !self.shared.is_settled()
    }

    /// The last setpoint once more, as a sign of life.
    pub(super) fn again(&mut self) -> &Setpoint {
        self.message.sequence += 1;
        &self.message
    }

    /// The last setpoint.
    pub(super) fn last(&self) -> &Setpoint {
        &self.message
    }

    /// Where the state that came since the last period is written, for [`Self::tick`].
    pub fn incoming(&mut self) -> &mut State {
        &mut self.incoming
    }

    /// Latches a fault, unless one is latched already.
    pub(super) fn latch(&mut self, fault: Fault) {
        if self.fault.is_none() {
            self.fault = Some(fault);
            // The arm will not arrive.
            self.forget_ends();
            self.forget_guards();
            self.shared.orders.latch();
            self.epoch = self.shared.new_epoch();
            self.report(Event::Faulted {
                fault,
                tick: self.tick,
            });
        }
    }

    /// One period; `came` says whether a state came since the last one: the newest of them was written
    /// to [`Self::incoming`], unchecked. Returns the setpoint to send.
    pub fn tick(&mut self, came: bool, tick: Tick) -> &Setpoint {
        self.tick = tick.number;
        self.watch_stall(tick.skipped);
        let was_ready = self.ready;
        self.take_state(came, tick);
        self.record();
        self.obey();
        if was_ready || self.fault.is_some() {
            self.feed();
        }
        self.watch_guards();
        self.move_on();
        self.watch_arrival();
        self.watch_tool();
        self.tell_stopped();
        self.watch_leaving();
        self.shared.published.fetch_add(1, Ordering::Relaxed);
        self.shared
            .skipped
            .fetch_add(tick.skipped, Ordering::Relaxed);
        self.share_position();
        self.write_message(tick);
        &self.message
    }

    /// Takes what the operator asked for.
    fn obey(&mut self) {
        let asked = self.shared.orders.asked();
        if asked.aborts() != self.asked.aborts() {
            self.aborting = Some(asked.abort_category());
        }
        self.asked = asked;
        if !self.cycle.is_resting() {
            return;
        }
        if self.fault.is_some() {
            self.cycle.flush();
            self.tool = None;
        }
        if self.aborting.take().is_some() {
            self.cycle.flush();
            self.tool = None;
            self.arrive_at_once();
            self.forget_guards();
            self.epoch = self.shared.new_epoch();
            self.report(Event::Aborted {
                aborts: asked.aborts(),
                tick: self.tick,
            });
        }
    }

    /// What the cycle shall do now.
    fn demand(&self) -> Demand {
        if self.fault.is_some() {
            return Demand::Stop(StopCategory::Fast);
        }
        if self.watch.is_some_and(|watch| watch.stops()) {
            return Demand::Stop(StopCategory::Fast);
        }
        match (self.asked.demand(), self.aborting) {
            (Demand::Stop(StopCategory::Fast), _) => Demand::Stop(StopCategory::Fast),
            (_, Some(category)) => Demand::Stop(category),
            (Demand::Run(_), None) if self.leaving.is_some() || !self.ready => {
                Demand::Stop(StopCategory::Gentle)
            }
            // Along the path, so within the limits of the joints.
            (Demand::Run(share), None) => Demand::Run(share * self.state.speed_scaling),
            (demand, None) => demand,
        }
    }

    /// Latches a fault if the thread did not run for longer than the watchdog.
    fn watch_stall(&mut self, skipped: u64) {
        let late = skipped as f64 * self.period;
        if late > self.config.watchdog.as_secs_f64() {
            self.latch(Fault::Stalled {
                late_ms: (late * 1e3) as u64,
            });
        }
    }

    /// Moves along the path by one step. Periods that were left out delay the plan, so a setpoint
    /// is never further from the one before than the joints can move in a period.
    fn move_on(&mut self) {
        let may_start = self.may_start();
        self.cycle.let_start(may_start);
        let made = self.cycle.step(self.demand());
        self.tell(&made, self.tick);
        self.published = made.setpoint;
        let fading = 1.0 - self.period / MEMORY;
        let speeds = self.speed.as_mut_slice().iter_mut();
        for (speed, now) in speeds.zip(made.setpoint.velocity.as_slice()) {
            *speed = now.abs().max(*speed * fading);
        }
        self.pending = self.samples.is_some().then_some(Recorded {
            tick: self.tick,
            command: made.command,
            path_time: made.path_time,
            time_scaling: made.time_scaling,
            setpoint: made.setpoint,
            measured: [0.0; N],
        });
    }

    /// Reports what a step brought.
    fn tell(&mut self, made: &Step<N>, tick: u64) {
        if let Some(command) = made.finished {
            self.note_finished(command);
            let wanted = self.take_end(command);
            self.await_arrival(command, wanted);
        }
        if let Some(command) = made.started {
            self.report_in_order(Event::Started { command, tick });
        }
        if let Some(trip) = made.trip {
            self.latch(Fault::Limit(trip));
        }
    }

    /// Reports once that a pause or stop has brought the arm to rest.
    fn tell_stopped(&mut self) {
        let held = self.asked.holds();
        let resting = self.cycle.is_resting();
        if held && resting && !self.stopped {
            self.report(Event::Stopped { tick: self.tick });
        }
        self.stopped = held && resting;
    }

    /// Sends the last period's sample to its reader.
    fn record(&mut self) {
        let (Some(samples), Some(mut pending)) = (&mut self.samples, self.pending.take()) else {
            return;
        };
        for (to, from) in pending.measured.iter_mut().zip(self.state.position) {
            *to = from;
        }
        if samples.push(pending).is_err() {
            self.shared.lost_reports.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(super) fn report(&mut self, event: Event) {
        if self.events.push(event).is_ok() {
            self.shared.count_report();
        } else {
            self.shared.lost_reports.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sends the last sample and the goodbye.
    pub(super) fn end(&mut self) {
        self.record();
        self.arrive_at_once();
        self.report(Event::Ended { tick: self.tick });
    }

    fn measured(&self) -> SVector<f64, N> {
        first(&self.state.position)
    }
}
