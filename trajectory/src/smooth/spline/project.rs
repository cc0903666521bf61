//! Passing times: the closest approach to each ball, in order. Also how much an iterate exceeds its
//! bounds.

use super::forward::Forward;
use super::problem::{Point, Problem, Room, part, square};

/// Iterates are held this far inside the widened bounds.
const WIDEN: f64 = 1.03;

/// A bound that is narrowed by less than this share stays as it is; the iterate is then held closer to it, by so much of
/// the distance before, and at last so close.
const STAYS: f64 = 0.999;
const CLOSER: f64 = 0.3;
const CLOSEST: f64 = 1.0005;

/// Fraction of a bound up to which it need not be widened.
const CLEAR: f64 = 0.99;

/// The same in the first spans after a start in motion, so many: there an iterate can be no farther
/// inside than the start is.
const BESIDE: f64 = 1.0 - 1e-6;
const FIRST_SPANS: f64 = 8.0;

/// The fraction at a time in knots: that beside an end of the motion which moves, or the usual one.
fn clear<const D: usize>(problem: &Problem<D>, point: &Point<D>, time: f64) -> f64 {
    let last = problem.finish.is_some() && time > point.spans() as f64 - FIRST_SPANS;
    if last || (problem.moving() && time < FIRST_SPANS) {
        BESIDE
    } else {
        CLEAR
    }
}

/// The same for speed, acceleration and jerk, and what a start in motion may reach of them.
const NEAR_CAP: f64 = 0.9999;
const FIXED: f64 = 1.0 - 1e-6;

/// First corridor samples of a start in motion, and their width: they cannot be moved, and are in
/// the corridor, but not always as far inside as the others.
const EASED: usize = 8;
const EASE: f64 = 1.02;

/// Bound for a present value: the true one if the value is well inside it, otherwise one widened to
/// contain the value, but never wider than before.
fn narrowed(before: f64, value: f64, [bound, widen]: [f64; 2], clear: f64) -> f64 {
    if value <= clear * bound {
        bound
    } else {
        before.min((widen * value).max(bound))
    }
}

/// Moves every passing time to the closest approach near by, in order.
///
/// With one group that is the least distance; with rotation it is the least barrier of both balls,
/// so that the barrier does not depend on the time to first order.
pub(crate) fn project<const D: usize>(
    problem: &Problem<D>,
    point: &mut Point<D>,
    room: Option<&Room>,
    rounds: usize,
) {
    let end = point.spans() as f64;
    let scales = [0, 1].map(|g: usize| 1.0 / (problem.groups[g].radius * problem.groups[g].radius));
    let (mut least, mut most) = (0.0_f64, end);
    let count = point.crossings.len();
    for k in 0..count {
        // In the order in which they are passed.
        let i = if problem.backwards { count - 1 - k } else { k };
        let radii = |g: usize| room.map_or(0.0, |room| room.balls[g][i].powi(2));
        let pass = Pass {
            goal: &problem.inner()[i],
            squares: [radii(0), radii(1)],
            scales,
            led: problem.is_led(i),
        };
        let mut time = point.crossings[i].clamp(least, most);
        // Where the orientation is searched, too, a step is taken only to where the strain is seen to be less.
        let mut seen = Problem::<D>::TURNS.then(|| point.at(time));
        let mut here = seen.map(|seen| pass.strain(&seen));
        for _ in 0..rounds {
            let Some(step) = pass.step(&seen.unwrap_or_else(|| point.at(time))) else {
                break;
            };
            let (mut share, mut moved) = (1.0, false);
            for _ in 0..if Problem::<D>::TURNS { 4 } else { 1 } {
                let to = (time - share * step).clamp(least, most);
                let there = Problem::<D>::TURNS.then(|| point.at(to));
                let strain = there.map(|there| pass.strain(&there));
                if strain <= here {
                    (time, seen, here, moved) = (to, there, strain, true);
                    break;
                }
                share *= 0.4;
            }
            if !moved || step.abs() < 1e-7 {
                break;
            }
        }
        point.crossings[i] = time.max(least);
        if problem.backwards {
            most = point.crossings[i];
        } else {
            least = point.crossings[i];
        }
    }
}

/// What the time of one pass depends on.
struct Pass<'a, const D: usize> {
    goal: &'a [f64; D],
    /// Squares of the radii of the widened balls; zero where none are known.
    squares: [f64; 2],
    /// Weight of each group where none are known, or outside.
    scales: [f64; 2],
    /// Whether the place alone decides.
    led: bool,
}

impl<const D: usize> Pass<'_, D> {
    /// Strain of a passing time at which the path has such a position and derivatives: outside of a ball how far, and inside the
    /// barrier, which is less.
    fn strain(&self, [p, ..]: &[[f64; D]; 3]) -> (f64, f64) {
        if self.led {
            return (0.0, (0..3).map(|d| (p[d] - self.goal[d]).powi(2)).sum());
        }
        let (mut out, mut inside) = (0.0_f64, 0.0);
        let mut sum = 0.0;
        for g in 0..Problem::<D>::GROUPS {
            let away: f64 = (3 * g..3 * g + 3)
                .map(|d| (p[d] - self.goal[d]).powi(2))
                .sum();
            sum += self.scales[g] * away;
            if self.squares[g] > 0.0 {
                let share = away / self.squares[g];
                out = out.max(share);
                inside -= (1.0 - share).max(1e-300).ln();
            }
        }
        if out >= 1.0 {
            (out, sum)
        } else if self.squares[0] > 0.0 {
            (0.0, inside)
        } else {
            (0.0, sum)
        }
    }

    /// The step of Newton's method towards the closest approach from where the path has such a position and derivatives, in knots.
    fn step(&self, [p, v, a]: &[[f64; D]; 3]) -> Option<f64> {
        let (mut slope, mut bend, mut fall) = (0.0, 0.0, 0.0);
        for g in 0..if self.led { 1 } else { Problem::<D>::GROUPS } {
            let (mut away, mut along, mut bent, mut speed) = (0.0, 0.0, 0.0, 0.0);
            for d in 3 * g..3 * g + 3 {
                let y = p[d] - self.goal[d];
                away += y * y;
                along += y * v[d];
                bent += y * a[d];
                speed += v[d] * v[d];
            }
            let slack = self.squares[g] - away;
            let inside = Problem::<D>::TURNS && slack > 0.0 && !self.led;
            let scale = if inside { 1.0 / slack } else { self.scales[g] };
            slope += scale * along;
            bend += scale * bent;
            fall += scale * speed;
            if inside {
                fall += 2.0 * (scale * along).powi(2);
            }
        }
        let curvature = if bend > -0.5 * fall {
            fall + bend
        } else {
            0.5 * fall
        };
        (curvature > 0.0).then(|| (slope / curvature).clamp(-0.7, 0.7))
    }
}

/// Distance of the iterate from the centre of ball `i`, in group `g`.
pub(crate) fn miss<const D: usize>(
    problem: &Problem<D>,
    point: &Point<D>,
    i: usize,
    g: usize,
) -> f64 {
    let (p, goal) = (
        point.place(point.crossings[i], g),
        part(&problem.inner()[i], g),
    );
    square(&[p[0] - goal[0], p[1] - goal[1], p[2] - goal[2]]).sqrt()
}

/// Greatest ratio of the differences of order 1 to 3 to their bounds, by group.
pub(crate) fn ratios<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> [[f64; 3]; 2] {
    let all = ratios_of(problem, point);
    [0, 1].map(|g| [0, 1, 2].map(|k| all[g][k][0].max(all[g][k][1])))
}

/// The difference of two vectors.
fn less(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Control points that the start fixes.
const PINNED: usize = 4;

/// The same ratios, of differences of fixed control points only and of all others.
fn ratios_of<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> [[[f64; 2]; 3]; 2] {
    let mut worst = [[[0.0_f64; 2]; 3]; 2];
    let (count, h) = (point.control.len(), problem.spacing(point.z));
    let pinned = problem.finish.map_or(0, |_| PINNED);
    let end = if pinned > 0 { count - pinned } else { count };
    for (g, worst) in worst.iter_mut().enumerate().take(Problem::<D>::GROUPS) {
        let mut raise = |order: usize, first: usize, value: f64| {
            let fixed = first + order < PINNED || first >= end;
            let slot = &mut worst[order - 1][usize::from(!fixed)];
            *slot = slot.max(value);
        };
        // The differences before the next one.
        let (mut slope, mut bend) = ([0.0; 3], [0.0; 3]);
        for (k, pair) in point.control.windows(2).enumerate() {
            let step = less(&part(&pair[1], g), &part(&pair[0], g));
            let turn = less(&step, &slope);
            raise(1, k, square(&step));
            if k > 0 {
                raise(2, k - 1, square(&turn));
            }
            if k > 1 {
                raise(3, k - 2, square(&less(&turn, &bend)));
            }
            (slope, bend) = (step, turn);
        }
        for (k, both) in worst.iter_mut().enumerate() {
            let bound = problem.groups[g].caps[k] * h.powi(k as i32 + 1);
            *both = both.map(|square| square.sqrt() / bound);
        }
    }
    worst
}

impl Room {
    /// Widened bounds for an iterate about which nothing is known yet.
    pub(crate) fn new<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> Self {
        let mut room = Self {
            caps: [[f64::INFINITY; 3]; 2],
            balls: [0, 1].map(|_| vec![f64::INFINITY; point.crossings.len()]),
            widths: [0, 1].map(|_| vec![f64::INFINITY; point.samples()]),
            legs: vec![0; point.samples()],
            forward: vec![f64::INFINITY; problem.forward.len()],
            widen: WIDEN,
        };
        room.tighten(problem, point);
        room
    }

    /// Narrows every widened bound, and next time closer to the iterate where that changed little: else an iterate at its
    /// centre just inside of a widened bound would stay there.
    pub(crate) fn narrow<const D: usize>(
        &mut self,
        problem: &Problem<D>,
        point: &Point<D>,
    ) -> bool {
        let before = self.clone();
        let tight = self.tighten(problem, point);
        if !tight && self.widen > CLOSEST && self.is_near(&before) {
            self.widen = 1.0 + CLOSER * (self.widen - 1.0);
        }
        tight
    }

    /// Whether no bound is narrower than it was by more than a little.
    fn is_near(&self, before: &Self) -> bool {
        let all = |room: &Self| -> Vec<f64> {
            let caps = room.caps.iter().flatten().copied();
            let balls = room.balls.iter().flatten().copied();
            let widths = room.widths.iter().flatten().copied();
            caps.chain(balls).chain(widths).collect()
        };
        let (now, before) = (all(self), all(before));
        now.iter()
            .zip(&before)
            .all(|(now, before)| *now >= STAYS * before)
    }

    /// Narrows every widened bound to what the iterate needs, and assigns the corridor samples to
    /// their legs. True if nothing is widened any more.
    pub(crate) fn tighten<const D: usize>(
        &mut self,
        problem: &Problem<D>,
        point: &Point<D>,
    ) -> bool {
        let mut tight = true;
        for (g, ratios) in ratios_of(problem, point)
            .iter()
            .enumerate()
            .take(Problem::<D>::GROUPS)
        {
            tight &= self.tighten_caps(ratios, g);
            for i in 0..point.crossings.len() {
                let radius = problem.radius(g, i);
                let far = miss(problem, point, i, g);
                self.balls[g][i] = narrowed(
                    self.balls[g][i],
                    far,
                    [radius, self.widen],
                    clear(problem, point, point.crossings[i]),
                );
                tight &= self.balls[g][i] <= radius;
            }
        }
        for (behind, ahead) in self.forward.iter_mut().zip(problem.ahead(point)) {
            *behind = Forward::narrowed(*behind, ahead);
            tight &= Forward::is_tight(*behind);
        }
        if problem.groups[0].width.is_finite() || problem.groups[1].width.is_finite() {
            tight &= self.tighten_widths(problem, point);
        }
        tight
    }

    /// A start in motion may be as close to a limit as rounding allows, and stays there: only the
    /// other control points have to be well inside.
    fn tighten_caps(&mut self, ratios: &[[f64; 2]; 3], g: usize) -> bool {
        let mut tight = true;
        for (cap, [fixed, free]) in self.caps[g].iter_mut().zip(ratios) {
            let value = if *fixed < FIXED {
                *free
            } else {
                fixed.max(*free)
            };
            *cap = narrowed(*cap, value, [1.0, self.widen], NEAR_CAP);
            tight &= *cap <= 1.0;
        }
        tight
    }

    fn tighten_widths<const D: usize>(&mut self, problem: &Problem<D>, point: &Point<D>) -> bool {
        let (mut tight, mut next) = (true, 0);
        for k in 0..point.samples() {
            let time = 0.5 * k as f64;
            while next < point.crossings.len() && point.crossings[next] <= time {
                next += 1;
            }
            let wanted = next + 1;
            let fits = |leg: usize, factor: f64| {
                (0..Problem::<D>::GROUPS)
                    .all(|g| away(problem, point, k, g, leg) < factor * problem.width(g, leg))
            };
            // A sample that changes legs while its point is outside the new
            // one keeps the old leg until it fits.
            if self.legs[k] == 0
                || (self.legs[k] != wanted && (fits(wanted, 0.98) || !fits(self.legs[k], 1.0)))
            {
                self.legs[k] = wanted;
                for g in 0..Problem::<D>::GROUPS {
                    self.widths[g][k] = f64::INFINITY;
                }
            }
            for g in 0..Problem::<D>::GROUPS {
                let far = away(problem, point, k, g, self.legs[k]);
                let last = problem.finish.is_some() && k + EASED >= point.samples();
                let eased = if last || (k < EASED && problem.moving()) {
                    EASE
                } else {
                    1.0
                };
                let width = eased * problem.width(g, self.legs[k]);
                self.widths[g][k] = narrowed(
                    self.widths[g][k],
                    far,
                    [width, self.widen],
                    clear(problem, point, time),
                );
                tight &= self.widths[g][k] <= width;
            }
        }
        tight
    }
}

/// Distance of corridor sample `k` from the path near a leg, in group `g`.
fn away<const D: usize>(
    problem: &Problem<D>,
    point: &Point<D>,
    k: usize,
    g: usize,
    leg: usize,
) -> f64 {
    square(&problem.nearest(&point.sample(k, g), leg, g).offset).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::problem::Group;
    use super::*;

    /// Two poses that a line passes in the wrong order are passed at once where it is nearest to that which comes first as it is made.
    #[test]
    fn passes_are_in_the_order_in_which_they_are_made() {
        let control: Vec<[f64; 3]> = (0..16).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let mut point = Point {
            control,
            z: 1.0,
            crossings: vec![5.5; 2],
        };
        let vertices = [0.0, 6.0, 5.0, 12.0].map(|time| point.place(time, 0));
        let group = Group {
            caps: [0.5, 5.0, 100.0],
            radius: 2.0,
            width: 4.0,
        };
        let mut problem = Problem::<3>::at_rest(vertices.to_vec(), [group; 2]);
        for (backwards, time) in [(false, 6.0), (true, 5.0)] {
            problem.backwards = backwards;
            project(&problem, &mut point, None, 20);
            let near = |pass: &f64| (pass - time).abs() < 1e-6;
            assert!(point.crossings.iter().all(near), "{:?}", point.crossings);
        }
    }
}
