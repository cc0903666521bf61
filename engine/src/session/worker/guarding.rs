//! Guarded commands: which sensors end them, and what became of them.

use crcl::{Guard, GuardEnding, GuardLimit};
use kinematics::Chain;
use nalgebra::{Point3, SVector};
use planner::command_error::CommandError;
use planner::controller::Step;
use realtime::{Cycle, Demand, JointLimits, Piece, Pushed, Segment, StopCategory};
use servo::{
    GuardKind, GuardOrder, GuardOutcome, GuardSource, Guarded, MAX_GUARDS, SETTLED, SensorGuard,
};

use super::super::note::Note;
use super::{InFlight, Work, Worker};

/// Planned pieces that the simulation of a stop has at hand.
const AT_HAND: usize = 512;

/// The guards of a command, and its planned motion.
#[derive(Debug)]
pub(super) struct Guarding<const N: usize> {
    guards: Vec<Guard>,
    pieces: Vec<Piece<N>>,
}

impl<const N: usize> Worker<'_, N> {
    /// Sends the guards of a command, if it has any, in front of its motion.
    pub(super) fn enlist_guards(&mut self, flight: &mut InFlight<N>, step: &Step<N>) {
        if step.guards.is_empty() {
            return;
        }
        let mut guards = [None; MAX_GUARDS];
        for (place, guard) in guards.iter_mut().zip(&step.guards) {
            *place = Some(sensor_guard(guard));
        }
        let command = flight.id;
        self.work
            .push_back(Work::Guards(GuardOrder { command, guards }));
        let planned = step.planned.as_ref();
        flight.guarding = Some(Guarding {
            guards: step.guards.clone(),
            pieces: planned.map_or_else(Vec::new, |it| it.trajectory.pieces().to_vec()),
        });
    }

    /// A command has ended: says what became of its guards, if it has any.
    pub(super) fn end_guards(&mut self, command: u32) {
        let Some(at) = self.flight.iter().position(|flight| flight.id == command) else {
            return;
        };
        let Some(guarding) = self.flight.get_mut(at).and_then(|f| f.guarding.take()) else {
            return;
        };
        let mut report = self.events.guarded();
        while report.is_some_and(|report| report.command != command) {
            report = self.events.guarded();
        }
        let Some(mut flight) = self.flight.remove(at) else {
            return;
        };
        if let Some(report) = report {
            if report.outcome != GuardOutcome::Quiet {
                self.controller.set_joints(self.remote.measured().setpoint);
            }
            if let Some(error) = self.judge(&flight, &guarding, &report) {
                self.refuse(&mut flight, error, true);
            }
        }
        self.flight.insert(at, flight);
    }

    /// Tells of a guard that tripped; gives the error of a command that did not end as it should.
    fn judge(
        &self,
        flight: &InFlight<N>,
        guarding: &Guarding<N>,
        report: &Guarded<N>,
    ) -> Option<CommandError> {
        let of = |index: usize| guarding.guards.get(index);
        match report.outcome {
            GuardOutcome::Quiet => {
                let required = |guard: &&Guard| guard.ending == GuardEnding::RequireTrigger;
                let guard = guarding.guards.iter().find(required)?;
                Some(CommandError::motion(format!(
                    "the motion came to its end and the guard on `{}` has not tripped",
                    guard.sensor
                )))
            }
            GuardOutcome::Unknown(index) => {
                let sensor = of(index).map_or("", |guard| guard.sensor.as_str());
                Some(CommandError::motion(format!(
                    "the driver gives no value of the sensor `{sensor}`"
                )))
            }
            GuardOutcome::Tripped(index) => {
                let guard = of(index)?;
                let stop = self.stop(flight, guarding, report);
                let message = sentence(&guard.sensor, report, index, stop);
                let fails = guard.ending == GuardEnding::ErrorOnTrigger;
                self.say(note(flight, guard, (report, index), stop, message.clone()));
                fails.then(|| CommandError::motion(message))
            }
        }
    }

    /// How far the controlled point may go on after a guard has tripped, and how far it went (m).
    fn stop(&self, flight: &InFlight<N>, guarding: &Guarding<N>, report: &Guarded<N>) -> [f64; 2] {
        let chain = &flight.chain;
        let point =
            |joints: &SVector<f64, N>| Point3::from(chain.forward(joints).translation.vector);
        let from = point(&report.measured);
        let late = nalgebra::distance(&from, &point(&report.setpoint));
        let period = 1.0 / self.config.rate_hz;
        let way = stop_way(
            &guarding.pieces,
            report,
            self.controller.limits(),
            period,
            chain,
        );
        let rest = point(&report.rested);
        let settled = (0..N).map(|joint| {
            let mut off = report.rested;
            off[joint] += SETTLED;
            nalgebra::distance(&rest, &point(&off))
        });
        let allowed = late + way + settled.sum::<f64>();
        [allowed, nalgebra::distance(&from, &rest)]
    }
}

fn sentence<const N: usize>(
    sensor: &str,
    report: &Guarded<N>,
    index: usize,
    [allowed, stopped]: [f64; 2],
) -> String {
    let peak = report.peaks.get(index).copied().unwrap_or(report.value);
    format!(
        "the guard on {sensor} tripped at {:.4}; the arm stopped within {:.3} mm, its limits allow \
         {:.3} mm; the peak was {peak:.4}",
        report.value,
        stopped * 1e3,
        allowed * 1e3
    )
}

fn note<const N: usize>(
    flight: &InFlight<N>,
    guard: &Guard,
    (report, index): (&Guarded<N>, usize),
    [allowed_m, stopped_m]: [f64; 2],
    message: String,
) -> Note {
    let pose = flight.chain.forward(&report.measured);
    let turn = pose.rotation;
    Note::Guarded {
        id: flight.id,
        line: flight.line,
        name: flight.name,
        sensor: guard.sensor.clone(),
        value: report.value,
        peak: report.peaks.get(index).copied().unwrap_or(report.value),
        allowed_m,
        stopped_m,
        stop_s: report.stop_s,
        position_m: pose.translation.vector.into(),
        orientation_wxyz: [turn.w, turn.i, turn.j, turn.k],
        message,
    }
}

fn sensor_guard(guard: &Guard) -> SensorGuard {
    SensorGuard {
        source: GuardSource::named(&guard.sensor),
        kind: match guard.limit {
            GuardLimit::OverMax => GuardKind::Over,
            GuardLimit::UnderMin => GuardKind::Under,
            GuardLimit::IncreaseOverLimit => GuardKind::Increase,
            GuardLimit::DecreaseBeyondLimit => GuardKind::Decrease,
        },
        limit: guard.value,
    }
}

/// How far the controlled point goes on its planned path until it rests, as fast as the limits of
/// the joints allow, from the moment of a report (m). What the arm did is not looked at: the stop is
/// computed from the plan. Where the speed along the path was not that of the plan, the longer of
/// two stops counts: from that speed, and from that of the plan.
fn stop_way<const N: usize>(
    pieces: &[Piece<N>],
    report: &Guarded<N>,
    limits: &JointLimits<N>,
    period: f64,
    chain: &Chain<N>,
) -> f64 {
    let from = |share: f64| {
        let mut plan = Plan::new(pieces, limits, period);
        while plan.cycle.path_time() < report.path_time - 1e-9 && plan.step(Demand::Run(share)) {}
        let mut at = chain
            .forward(&plan.cycle.setpoint().position)
            .translation
            .vector;
        let mut way = 0.0;
        loop {
            let moves = plan.step(Demand::Stop(StopCategory::Fast));
            let next = chain
                .forward(&plan.cycle.setpoint().position)
                .translation
                .vector;
            way += (next - at).norm();
            at = next;
            if !moves {
                return way;
            }
        }
    };
    match report.time_scaling {
        share if share <= 0.0 => 0.0,
        share if share >= 1.0 => from(1.0),
        share => from(share).max(from(1.0)),
    }
}

/// A planned motion that is executed in thought.
struct Plan<'a, const N: usize> {
    pieces: std::iter::Peekable<std::iter::Enumerate<std::slice::Iter<'a, Piece<N>>>>,
    count: usize,
    cycle: Box<Cycle<N, AT_HAND>>,
    /// Periods that are left at most.
    left: u32,
}

impl<'a, const N: usize> Plan<'a, N> {
    fn new(pieces: &'a [Piece<N>], limits: &JointLimits<N>, period: f64) -> Self {
        let start = pieces
            .first()
            .map_or_else(SVector::zeros, |piece| piece.sample(0.0).position);
        let mut plan = Self {
            pieces: pieces.iter().enumerate().peekable(),
            count: pieces.len(),
            cycle: Box::new(Cycle::new(start, *limits, period)),
            left: 1_000_000,
        };
        plan.feed();
        // The first step begins the command, at rest.
        plan.cycle.step(Demand::Run(1.0));
        plan
    }

    fn feed(&mut self) {
        while let Some((index, piece)) = self.pieces.peek() {
            let segment = Segment {
                piece: **piece,
                command: 0,
                last: index + 1 == self.count,
            };
            if self.cycle.push(&segment) != Pushed::Taken {
                return;
            }
            self.pieces.next();
        }
    }

    /// One period; says whether the arm still moves after it.
    fn step(&mut self, demand: Demand) -> bool {
        self.feed();
        self.left = self.left.saturating_sub(1);
        self.cycle.step(demand);
        !self.cycle.is_resting() && self.left > 0
    }
}
