//! The interior point iteration. It may stop at any time: every iterate after the first feasible
//! one is a valid motion.

use super::barrier::{Barrier, KEEP, Seen};
use super::newton::{Step, System};
use super::nudge::nudge;
use super::problem::{FEW, Point, Problem, Room, spreading, ways};
use super::project::project;

/// How far and how long the iteration goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Most Newton steps.
    pub(crate) steps: usize,
    /// Steps after which an iterate that still needs widened bounds is given up.
    pub(crate) search: usize,
    /// A start in motion that breaks limits is made feasible by widening them
    /// with `z`, over this many times the spans that the look-ahead needs;
    /// `None`: by narrowing limits from where the start is.
    pub(crate) spread: Option<f64>,
    /// Relative gap of `z` at which to end; the time is off by a third of it.
    pub(crate) gap: f64,
    /// Longest useful time (s): an iterate is given up if its optimum is above it.
    pub(crate) most: f64,
    /// Whether a search between two ends in motion goes on where they hold it.
    pub(crate) onward: bool,
    /// By how much a pose may be seen beside its vertex at the end, in radii of its ball.
    pub(crate) aimed: f64,
}

/// Growth of the weight on `z` at each centre, and the square of the Newton decrement at one.
const GROWTH: f64 = 8.0;
const CENTRE: f64 = 3.0;

/// The same where the orientation is a part of the search: thousands of bounds that are curved shorten a long step to a
/// twentieth. With a small growth a step or two lead far enough, and what the decrement tells is a small share of the
/// parameter of the barrier.
const TURNING: f64 = 2.0;
const LOOSELY: f64 = 3000.0;

/// Steps shortened to this fraction, this many times in a row, mean that the iterate is stuck
/// between constraints far from its centre: the weight is then lowered, once.
const SHORT: f64 = 0.1;
const STUCK: usize = 4;

/// Rounds in which a trial looks for the passes, and where the orientations of few poses are searched. There a pass that is not
/// yet where it belongs may be inside of a ball which the pass itself is outside of: then no step leads on from the iterate.
const ROUNDS: usize = 3;
const MORE_ROUNDS: usize = 12;

/// Square of the Newton decrement from which short steps are normal, because the weight has just
/// been raised.
const LOW: f64 = 100.0;

/// Steps between two narrowings of widened bounds: they move the iterate well inside, so that each
/// narrowing is large.
const PATIENCE: usize = 4;

/// More steps for a start in motion that a first iterate does not keep up with.
const ANCHORED: usize = 40;

/// Square of the Newton decrement that is near enough to a centre on the way to a first valid motion.
const ROUGHLY: f64 = 30.0;

/// A gap from which on no more than a motion is wanted that is far inside of its bounds.
const ROUGH: f64 = 0.1;

/// How the iteration is led.
#[derive(Clone, Copy, Debug)]
struct Pace {
    /// Most Newton steps.
    steps: usize,
    /// Growth of the weight on `z` at each centre, and the square of the Newton decrement at one and at the last.
    growth: f64,
    centre: f64,
    last: f64,
    /// Square of the decrement from which short steps are normal.
    low: f64,
    /// Share of each slack that a step must leave.
    keep: f64,
    /// Rounds in which a trial looks for the passes.
    rounds: usize,
    /// Square of the decrement from which widened bounds are narrowed at once.
    near: f64,
}

impl Pace {
    fn new<const D: usize>(problem: &Problem<D>, effort: Effort) -> Self {
        if problem.finish.is_none() {
            return Self {
                steps: effort.steps,
                growth: if Problem::<D>::TURNS { TURNING } else { GROWTH },
                centre: if Problem::<D>::TURNS { LOOSELY } else { CENTRE },
                last: if Problem::<D>::TURNS { ROUGHLY } else { CENTRE },
                low: LOW,
                keep: KEEP,
                rounds: Self::rounds(problem),
                near: if effort.gap >= ROUGH { 3.0 } else { 0.1 },
            };
        }
        // Between two ends in motion the passes of a sharp corner wander, and an iterate that comes close
        // to a bound there does not leave it again: small changes of the weight, well centred, half of each
        // slack left. The weight is never lowered: from there the iterate does not come back.
        Self {
            steps: BETWEEN,
            growth: 1.2,
            centre: 1.0,
            last: 1.0,
            low: 0.0,
            keep: 0.5,
            rounds: MORE_ROUNDS,
            near: 0.1,
        }
    }

    /// Rounds in which a trial looks for the passes. Of a dense list they lead on from each other.
    fn rounds<const D: usize>(problem: &Problem<D>) -> usize {
        if Problem::<D>::TURNS && problem.inner().len() <= FEW {
            MORE_ROUNDS
        } else {
            ROUNDS
        }
    }

    /// The barrier of a problem at this pace.
    fn barrier<'a, const D: usize>(
        &self,
        problem: &'a Problem<D>,
        room: &'a Room,
        weight: f64,
    ) -> Barrier<'a, D> {
        Barrier {
            problem,
            room,
            weight,
            keep: self.keep,
        }
    }
}

/// Most Newton steps between two ends in motion.
const BETWEEN: usize = 400;

/// Up to so many times the knot spacing of its start, cubed, an iterate is held by its ends.
const HELD: f64 = 1.02;

/// Back-tracking factor of the line search.
const BACK: f64 = 0.6;

/// Improves an iterate to the optimum within `effort`; the number of steps, or
/// `None` when no feasible iterate was found. Where the motion of an iterate sees the poses turned otherwise than its
/// rotation vectors say, `aims` tells it, and the vertices follow on the way.
///
/// # Source
/// S. Boyd, L. Vandenberghe, "Convex Optimization", 2004, 11.3 (barrier method); the bounds of an
/// infeasible iterate are widened to contain it, and narrowed as it moves inwards.
pub(crate) fn solve<const D: usize, const B: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
    effort: Effort,
    aims: Option<Aims<'_, D>>,
) -> Option<usize> {
    let mut system = System::<D, B>::new(point);
    let mut iteration = Iteration::begin(problem, point, effort);
    let more = usize::from(iteration.problem.anchor.is_some()) * ANCHORED;
    let most = iteration.pace.steps + more;
    for count in 0..most {
        iteration.narrow();
        // An iterate that is inside goes on until it is as fast as its start.
        if !iteration.bounds.tight && count >= effort.search {
            return None;
        }
        let done = iteration.is_done();
        let room = &iteration.bounds.room;
        let step = system.step(iteration.problem, iteration.point, room, iteration.weight);
        let Some(step) = step else {
            return done.then_some(count);
        };
        let moved = iteration.take(&step);
        let centred = step.decrement < iteration.centre(done);
        let looks = done && (!moved || centred || (count + 1).is_multiple_of(AIMING));
        let missed = iteration.aim(&mut system, aims.filter(|_| looks));
        if moved && !centred {
            continue;
        }
        if done && iteration.is_too_slow() {
            return None;
        }
        if iteration.is_at_its_end() {
            let turned = moved && missed > iteration.effort.aimed;
            if turned || !done && iteration.goes_on_past_ends() {
                continue;
            }
            return done.then_some(count);
        }
        if !iteration.begin_next_centre(moved, step.decrement) {
            return None;
        }
    }
    iteration.is_done().then_some(most)
}

/// An iterate on its way to the optimum.
struct Iteration<'a, const D: usize> {
    problem: &'a mut Problem<D>,
    point: &'a mut Point<D>,
    effort: Effort,
    pace: Pace,
    bounds: Bounds,
    known: Known,
    slow: Slow,
    /// Parameter of the barrier.
    parameter: f64,
    /// Weight on `z`.
    weight: f64,
}

impl<'a, const D: usize> Iteration<'a, D> {
    fn begin(problem: &'a mut Problem<D>, point: &'a mut Point<D>, effort: Effort) -> Self {
        let pace = Pace::new(problem, effort);
        begin(problem, point, effort);
        let bounds = Bounds::around(problem, point);
        let parameter = problem.parameter(point);
        Self {
            weight: parameter / (2.0 * point.z),
            known: Known::nothing(&bounds.room),
            slow: Slow::default(),
            problem,
            point,
            effort,
            pace,
            bounds,
            parameter,
        }
    }

    /// The weight with which an iterate begins.
    fn first_weight(&self) -> f64 {
        self.parameter / (2.0 * self.point.z)
    }

    /// Whether the iterate is a valid motion.
    fn is_done(&self) -> bool {
        self.bounds.tight && self.problem.anchor.is_none()
    }

    /// Narrows the bounds where it is time for that, and lets go an iterate that is as fast as its start.
    fn narrow(&mut self) {
        self.bounds.narrow(self.problem, self.point);
        if self.bounds.tight && is_let_go(self.problem, self.point) {
            self.known.seen = None;
            if self.problem.finish.is_some() {
                self.weight = self.first_weight();
            }
        }
    }

    /// Square of the Newton decrement that is near enough to a centre, for an iterate that is `done` or not.
    fn centre(&self, done: bool) -> f64 {
        if !done {
            ROUGHLY
        } else if self.is_at_its_end() {
            self.pace.last
        } else {
            self.pace.centre
        }
    }

    /// Goes along a step as far as it helps; false where it does not.
    fn take(&mut self, step: &Step) -> bool {
        let barrier = &self
            .pace
            .barrier(self.problem, &self.bounds.room, self.weight);
        let share = self
            .known
            .search(barrier, self.point, step, self.pace.rounds);
        // At the end there is nothing to come back to.
        let ends = self.is_at_its_end() && step.decrement < self.pace.last;
        let short = self.bounds.tight && share < SHORT && step.decrement < self.pace.low && !ends;
        if self.slow.is_new(short) {
            self.weight = self.weight.min(self.first_weight());
        }
        share > 0.0
    }

    /// [`aim`].
    fn aim<const B: usize>(&mut self, system: &mut System<D, B>, aims: Option<Aims<'_, D>>) -> f64 {
        let seen = (system, &self.bounds.room, &mut self.known);
        aim(self.problem, self.point, seen, aims)
    }

    /// Whether the optimum is above the longest useful time.
    fn is_too_slow(&self) -> bool {
        let least = (self.point.z - self.parameter / self.weight).max(0.0);
        self.point.spans() as f64 * self.problem.spacing(least) > self.effort.most
    }

    /// Whether the iterate is so near to its optimum as is wanted.
    fn is_at_its_end(&self) -> bool {
        self.bounds.tight && self.parameter / self.weight <= self.effort.gap * self.point.z
    }

    /// Lets go an iterate that only its ends hold, where that is wanted.
    fn goes_on_past_ends(&mut self) -> bool {
        if !self.effort.onward || !is_held_by_ends(self.problem, self.point) {
            return false;
        }
        self.weight = self.first_weight();
        self.known = Known::nothing(&self.bounds.room);
        // Where it keeps the bounds as it is they need not be widened.
        let barrier = self
            .pace
            .barrier(self.problem, &self.bounds.room, self.weight);
        if barrier.look(self.point, &[]).is_none() {
            self.bounds = Bounds::around(self.problem, self.point);
        }
        true
    }

    /// Raises the weight, or has widened bounds narrowed next; false where the iterate is stuck.
    fn begin_next_centre(&mut self, moved: bool, decrement: f64) -> bool {
        if self.bounds.tight {
            let last = 1.01 * self.parameter / (self.effort.gap * self.point.z);
            self.weight = (self.weight * self.pace.growth).min(last);
        } else if self.bounds.since == 0 && !moved {
            return false;
        } else if decrement < self.pace.near || !moved {
            self.bounds.since = PATIENCE;
        }
        true
    }
}

/// The bounds of an iterate: widened to contain it, and narrowed as it moves inwards.
struct Bounds {
    room: Room,
    /// Whether they are the true bounds.
    tight: bool,
    /// Steps since they were narrowed last.
    since: usize,
}

impl Bounds {
    /// The narrowest bounds that contain an iterate.
    fn around<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> Self {
        let mut room = Room::new(problem, point);
        let tight = room.tighten(problem, point);
        Self {
            room,
            tight,
            since: 0,
        }
    }

    /// Narrows them where it is time for that.
    fn narrow<const D: usize>(&mut self, problem: &Problem<D>, point: &Point<D>) {
        self.since += 1;
        if self.tight || self.since > PATIENCE {
            self.tight = self.room.narrow(problem, point);
            self.since = 0;
        }
    }
}

/// Where the motion of an iterate sees the inner poses.
pub(crate) type Aims<'a, const D: usize> = &'a dyn Fn(&Problem<D>, &Point<D>) -> Vec<[f64; D]>;

/// Steps from one look at where the poses are seen to the next.
const AIMING: usize = 4;

/// Share of each slack that moved vertices must leave.
const LEAVE: f64 = 0.3;

/// Moves the inner vertices to where the motion of the iterate sees them: at once, if it stays well inside, else with the
/// iterate, as far as it stays so. By how much they may still be off, in radii of their balls.
fn aim<const D: usize, const B: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
    (system, room, known): (&mut System<D, B>, &Room, &mut Known),
    aims: Option<Aims<'_, D>>,
) -> f64 {
    let Some(aims) = aims.map(|aims| aims(problem, point)) else {
        return 0.0;
    };
    let shift = |(aim, from): (&[f64; D], &[f64; D])| -> [f64; D] {
        let turn = Problem::<D>::LAST..3 * Problem::<D>::GROUPS;
        std::array::from_fn(|d| {
            if turn.contains(&d) {
                aim[d] - from[d]
            } else {
                0.0
            }
        })
    };
    let shifts: Vec<[f64; D]> = aims.iter().zip(problem.inner()).map(shift).collect();
    let radius = problem.groups[Problem::<D>::GROUPS - 1].radius;
    let far = |shift: &[f64; D]| shift.iter().map(|x| x * x).sum::<f64>().sqrt() / radius;
    let off = shifts.iter().map(far).fold(0.0, f64::max);
    let Some(seen) = left(problem, room, point, &[]) else {
        return 0.0;
    };
    let before = problem.vertices.clone();
    shifted(problem, &before, (&shifts, 1.0));
    if let Some(seen) = left(problem, room, point, &seen.slacks) {
        known.keep(room, seen);
        return 0.0;
    }
    shifted(problem, &before, (&shifts, 0.0));
    let Some(step) = system.shift(problem, point, (room, &shifts)) else {
        return off;
    };
    let mut share = 1.0;
    for _ in 0..5 {
        shifted(problem, &before, (&shifts, share));
        let mut trial = point.clone();
        go(problem, (point, &mut trial), (&step, share));
        project(problem, &mut trial, Some(room), Pace::rounds(problem));
        if let Some(seen) = left(problem, room, &trial, &seen.slacks) {
            known.keep(room, seen);
            *point = trial;
            return off;
        }
        share *= 0.4;
    }
    shifted(problem, &before, (&shifts, 0.0));
    off
}

/// Moves the inner vertices from where they were `before` by a share of their shifts.
fn shifted<const D: usize>(
    problem: &mut Problem<D>,
    before: &[[f64; D]],
    (shifts, share): (&[[f64; D]], f64),
) {
    let inner = problem.vertices.iter_mut().zip(before).skip(1);
    for ((to, from), shift) in inner.zip(shifts) {
        for d in 0..D {
            to[d] = from[d] + share * shift[d];
        }
    }
    problem.ways = ways(&problem.vertices);
}

/// The barrier at an iterate, if enough is left of the slacks `before`.
fn left<const D: usize>(
    problem: &Problem<D>,
    room: &Room,
    point: &Point<D>,
    before: &[f64],
) -> Option<Seen> {
    let barrier = Barrier {
        problem,
        room,
        weight: 0.0,
        keep: LEAVE,
    };
    barrier.look(point, before)
}

/// What is known of the barrier at the iterate, under these bounds.
struct Known {
    room: Room,
    seen: Option<Seen>,
}

impl Known {
    fn nothing(room: &Room) -> Self {
        let room = room.clone();
        Self { room, seen: None }
    }

    /// Keeps what is seen under these bounds.
    fn keep(&mut self, room: &Room, seen: Seen) {
        self.room = room.clone();
        self.seen = Some(seen);
    }

    /// [`search`] from the iterate that is known, unless a bound has changed.
    fn search<const D: usize>(
        &mut self,
        barrier: &Barrier<'_, D>,
        point: &mut Point<D>,
        step: &Step,
        rounds: usize,
    ) -> f64 {
        if self.room != *barrier.room {
            (self.room, self.seen) = (barrier.room.clone(), None);
        }
        let (share, seen) = search(barrier, point, (step, self.seen.take()), rounds);
        self.seen = seen;
        share
    }
}

/// Whether the iterate has become faster than its start, which then holds it no longer.
fn is_let_go<const D: usize>(problem: &mut Problem<D>, point: &mut Point<D>) -> bool {
    let Some(z) = problem.anchor.filter(|z| point.z < *z) else {
        return false;
    };
    problem.anchor = None;
    point.z = z;
    true
}

/// Whether an iterate between two ends in motion cannot become faster than its start only because of them: while their
/// control points stay those of the start, an end at a limit allows no less time. The iterate is then let go as it is.
fn is_held_by_ends<const D: usize>(problem: &mut Problem<D>, point: &mut Point<D>) -> bool {
    let Some(z) = problem.anchor.filter(|z| point.z < HELD * *z) else {
        return false;
    };
    if problem.finish.is_none() {
        return false;
    }
    problem.anchor = None;
    follow(problem, point, z);
    problem.pin(point);
    project(problem, point, None, 20);
    true
}

/// Counts short steps one after another.
#[derive(Default)]
struct Slow {
    steps: usize,
    told: bool,
}

impl Slow {
    /// Whether the descent has become slow, told once.
    fn is_new(&mut self, short: bool) -> bool {
        self.steps = if short { self.steps + 1 } else { 0 };
        let new = self.steps == STUCK && !self.told;
        self.told |= new;
        new
    }
}

/// Moves a first iterate to a point from which the descent can begin.
fn begin<const D: usize>(problem: &mut Problem<D>, point: &mut Point<D>, effort: Effort) {
    if (effort.spread.is_some() && problem.moving()) || problem.finish.is_some() {
        problem.anchor = Some(point.z);
    }
    problem.pin(point);
    project(problem, point, None, 20);
    if !problem.joints.is_empty() {
        nudge(problem, point);
    }
    if problem.anchor.is_some() || !problem.moving() {
        slow_down(problem, point);
    }
}

/// The cube of the factor on the time with which speed, acceleration and jerk hold with a margin.
fn time_cubed(ratios: [f64; 3]) -> f64 {
    let [speed, acceleration, jerk] = ratios.map(|ratio| ratio / 0.9);
    speed.powi(3).max(acceleration.powf(1.5)).max(jerk)
}

/// Raises `z` until speed, acceleration and jerk hold with a margin, those of joints, too.
fn slow_down<const D: usize>(problem: &Problem<D>, point: &mut Point<D>) {
    let mut need = 0.0_f64;
    for ratios in super::project::ratios(problem, point) {
        need = need.max(time_cubed(ratios));
    }
    let h = problem.spacing(point.z);
    for joint in &problem.joints {
        need = need.max(time_cubed(joint.ratios(&point.control, h)));
    }
    point.z *= need.max(1e-9);
}

/// Moves the iterate along the step as far as the barrier falls; returns the fraction of the step,
/// 0 if it does not fall at all, and the barrier there. With the step what is known of the barrier here.
fn search<const D: usize>(
    barrier: &Barrier<'_, D>,
    point: &mut Point<D>,
    (step, known): (&Step, Option<Seen>),
    rounds: usize,
) -> (f64, Option<Seen>) {
    let problem = barrier.problem;
    let Some(seen) = known.or_else(|| barrier.look(point, &[])) else {
        return (0.0, None);
    };
    let here = barrier.value(point, &seen);
    let mut share: f64 = if step.z < 0.0 {
        (-0.9 * point.z / step.z).min(1.0)
    } else {
        1.0
    };
    let mut trial = point.clone();
    for _ in 0..40 {
        go(problem, (point, &mut trial), (step, share));
        // Most trials that are too long break a limit, and to find their passes costs more than to see that.
        let there = if barrier.is_limited(&trial, &seen.slacks) {
            project(problem, &mut trial, Some(barrier.room), rounds);
            barrier.look(&trial, &seen.slacks)
        } else {
            None
        };
        if let Some(there) = there
            && barrier.value(&trial, &there) < here - 0.01 * share * step.decrement
        {
            *point = trial;
            return (share, Some(there));
        }
        share *= BACK;
    }
    (0.0, Some(seen))
}

/// Moves a trial to where a share of a step leads from an iterate.
pub(super) fn go<const D: usize>(
    problem: &Problem<D>,
    (point, trial): (&Point<D>, &mut Point<D>),
    (step, share): (&Step, f64),
) {
    trial.z = point.z + share * step.z;
    let free = trial.control.iter_mut().zip(&point.control).skip(4);
    for ((to, from), delta) in free.zip(step.control.chunks_exact(D)) {
        for d in 0..D {
            to[d] = from[d] + share * delta[d];
        }
    }
    follow(problem, trial, point.z);
    problem.pin(trial);
    trial.end_spare();
    trial.crossings.copy_from_slice(&point.crossings);
    let times = trial.crossings.iter_mut().zip(&step.times);
    for (time, change) in times.filter(|_| Problem::<D>::TURNS) {
        *time += share * change;
    }
}

/// Lets the free control points follow those that two ends in motion fix, which do not move evenly with `z`:
/// to second order they spread like the knots, and the others with them.
fn follow<const D: usize>(problem: &Problem<D>, trial: &mut Point<D>, from: f64) {
    let Some((before, after)) = problem
        .pinned_last(from)
        .zip(problem.pinned_last(trial.z))
        .filter(|_| problem.anchor.is_none())
    else {
        return;
    };
    let change = trial.z - from;
    let spread = |before: &[[[f64; D]; 2]; 4], after: &[[[f64; D]; 2]; 4]| -> [f64; D] {
        std::array::from_fn(|d| {
            let off = |k: usize| after[k][0][d] - before[k][0][d] - before[k][1][d] * change;
            off(2) - off(1)
        })
    };
    let first = spread(&problem.pinned(from), &problem.pinned(trial.z));
    let ends = [first, spread(&before, &after)];
    let changes = spreading(ends, trial.control.len());
    for (control, change) in trial.control.iter_mut().zip(changes) {
        for d in 0..D {
            control[d] += change[d];
        }
    }
}
