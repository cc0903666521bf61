//! First iterate: control points on the polyline, at the positions that a simple look-ahead over
//! junction speeds gives.

use super::problem::{Point, Problem, square};

/// Fraction of the acceleration that the look-ahead uses along the legs.
const SHARE: f64 = 0.6;

/// Knot intervals in one time `A / J`.
pub(crate) const KNOTS_PER_RAMP: f64 = 6.0;

/// Control points over which the offset of a start in motion fades out.
const FADE: f64 = 16.0;

/// Rounds of averaging of the control points, and the fraction of the tolerance that they may use.
const ROUNDS: usize = 12;
const HELD: f64 = 0.3;

/// Least and most spans of one spline.
pub(super) const FEWEST: f64 = 12.0;
pub(super) const MOST: f64 = 700.0;

/// Spans for each vertex of one that turns, if they are fewer, and the share of them where knots are farther apart than
/// usual.
const TURNING: f64 = 58.0;
const ROUGH: f64 = 0.25;

/// Legs that take less than this at full speed (s) count as no motion.
const STILL: f64 = 1e-12;
/// Change of rate (1/s2) on a leg on which nothing moves.
const FASTEST: f64 = 1e12;

/// A leg measured in time at full speed: progress has rate 1 there.
struct Leg<const D: usize> {
    length: f64,
    /// Velocity at rate 1.
    direction: [f64; D],
    /// Greatest change of the rate, 1/s.
    acceleration: f64,
}

/// Progress over time: constant change of rate between the records.
struct Schedule {
    /// Time, progress, rate and change of rate at the start of each interval.
    records: Vec<[f64; 4]>,
    /// Junctions at which the rate dips.
    dips: usize,
    duration: f64,
}

impl Schedule {
    fn at(&self, time: f64) -> f64 {
        let next = self.records.partition_point(|r| r[0] <= time);
        let [t, s, rate, change] = self.records[next.saturating_sub(1)];
        let dt = time - t;
        if next == 0 {
            s + rate * dt
        } else {
            s + (rate + 0.5 * change * dt) * dt
        }
    }

    /// Progress averaged over `width` around `time`.
    fn smooth(&self, time: f64, width: f64) -> f64 {
        let parts = 8;
        let step = width / f64::from(parts);
        let first = time - 0.5 * width + 0.5 * step;
        (0..parts)
            .map(|i| self.at(first + step * f64::from(i)))
            .sum::<f64>()
            / f64::from(parts)
    }
}

/// Most spans of a spline through so many vertices. One that turns needs twice the work for each span, and its steps are
/// longer where knots are farther apart. `knots` is the number of them in one time `A / J`.
fn most<const D: usize>(vertices: usize, knots: f64) -> f64 {
    if !Problem::<D>::TURNS {
        return MOST;
    }
    let share = if knots < KNOTS_PER_RAMP { ROUGH } else { 1.0 };
    share * (TURNING * vertices as f64).clamp(0.5 * MOST, MOST)
}

/// First iterate of a problem, with at least so many `knots` in one time `A / J`; also sets the `scale` of the
/// problem. For a start in motion, `spread` is the factor on the time of the look-ahead.
pub(crate) fn first<const D: usize>(
    problem: &mut Problem<D>,
    spread: Option<f64>,
    knots: f64,
) -> Point<D> {
    let moving = spread.is_some();
    let legs = legs(problem);
    let ramp = (0..Problem::<D>::GROUPS)
        .map(|g| problem.groups[g].caps[1] / problem.groups[g].caps[2])
        .fold(0.0, f64::max);
    let coarse = ramp / knots;
    let start = begin(problem, &legs);
    let mut rates = junctions(problem, &legs, coarse);
    rates[0] = start[1];
    look_ahead(&legs, &mut rates);
    let schedule = schedule(&legs, &rates, start[0]);
    let smoothing = ramp.min(0.5 * schedule.duration / (schedule.dips + 1) as f64);
    let total = schedule.duration + smoothing;
    let finest = total / (8 * (schedule.dips + 1)) as f64;
    let most = most::<D>(problem.vertices.len(), knots);
    let h = coarse.min(finest).min(total / FEWEST).max(total / most);
    let spans = (total / h).ceil().clamp(FEWEST, MOST) as usize + 3;
    problem.scale = if moving {
        h
    } else {
        total / (spans - 3) as f64
    };
    if moving {
        calm(problem);
    }
    // A spacing that was lowered needs more spans for the same time.
    let spans = if moving {
        ((spread.unwrap_or(1.0) * total / problem.scale).ceil() as usize + 3).min(2 * MOST as usize)
    } else {
        spans
    };
    let lead = if moving {
        0.0
    } else {
        0.5 * smoothing + 1.5 * problem.scale
    };
    let slower = spread.unwrap_or(1.0);
    let pace = Pace {
        spans,
        lead,
        smoothing,
        slower,
    };
    place(problem, &legs, &schedule, &pace)
}

/// Lowers the knot spacing until the pinned control points of a start in motion
/// keep the limits: their differences bound more than the start itself.
fn calm<const D: usize>(problem: &mut Problem<D>) {
    for _ in 0..6 {
        let control = problem.pinned(1.0).map(|pinned| pinned[0]).to_vec();
        let point = Point {
            control,
            z: 1.0,
            crossings: Vec::new(),
        };
        let ratios = super::project::ratios(problem, &point);
        // The jerk of the start does not depend on the spacing.
        if ratios.iter().all(|r| r[0].max(r[1]) <= 0.9995) {
            break;
        }
        problem.scale *= 0.95;
    }
}

fn legs<const D: usize>(problem: &Problem<D>) -> Vec<Leg<D>> {
    let mut legs = Vec::with_capacity(problem.vertices.len());
    for pair in problem.vertices.windows(2) {
        let mut way = [0.0; D];
        for d in 0..D {
            way[d] = pair[1][d] - pair[0][d];
        }
        let norms = norms(&way);
        let groups = &problem.groups;
        let length = (0..D / 3)
            .map(|g| norms[g] / groups[g].caps[0])
            .fold(1e-12, f64::max);
        // A part without motion, such as the position in a turn on the spot, limits nothing.
        let acceleration = (0..D / 3)
            .filter(|g| norms[*g] > STILL * groups[*g].caps[0])
            .map(|g| {
                let unit = norms[g] / length;
                let jerk = (groups[g].caps[2].powi(2) * norms[g]).cbrt();
                groups[g].caps[1].min(jerk) / unit.max(1e-12)
            })
            .fold(f64::INFINITY, f64::min);
        legs.push(Leg {
            length,
            direction: way.map(|x| x / length),
            // Nothing can be faster where nothing moves.
            acceleration: acceleration.min(FASTEST),
        });
    }
    legs
}

/// Norm of each group.
fn norms<const D: usize>(x: &[f64; D]) -> [f64; 2] {
    let mut result = [0.0; 2];
    for (g, part) in x.chunks_exact(3).enumerate().take(2) {
        result[g] = square(&[part[0], part[1], part[2]]).sqrt();
    }
    result
}

/// Progress and rate of the start on the first leg.
fn begin<const D: usize>(problem: &Problem<D>, legs: &[Leg<D>]) -> [f64; 2] {
    let (mut along, mut rate, mut unit) = (0.0, 0.0, 0.0);
    for d in 0..D {
        let cap = problem.groups[d / 3].caps[0].powi(2);
        along += legs[0].direction[d] * (problem.start[0][d] - problem.vertices[0][d]) / cap;
        rate += problem.start[1][d] * problem.start[1][d] / cap;
        unit += legs[0].direction[d] * legs[0].direction[d] / cap;
    }
    [
        (along / unit.max(1e-300)).clamp(0.0, legs[0].length),
        rate.sqrt().min(1.0),
    ]
}

/// Largest rate at each vertex that its ball allows; 0 at the end.
///
/// A corner of velocity jump `m v` inside a ball of radius `tol` takes the time of an acceleration
/// ramp with the same jump; if the path bends so little that the sagitta is below the tolerance,
/// the curvature counts instead.
fn junctions<const D: usize>(problem: &Problem<D>, legs: &[Leg<D>], h: f64) -> Vec<f64> {
    let mut rates = vec![0.0; legs.len() + 1];
    for i in 1..legs.len() {
        let (before, after) = (&legs[i - 1], &legs[i]);
        let mut jump = [0.0; D];
        for d in 0..D {
            jump[d] = after.direction[d] - before.direction[d];
        }
        let mean = 0.5 * (before.length + after.length);
        let mut rate: f64 = 1.0;
        for (g, m) in norms(&jump).iter().enumerate().take(D / 3) {
            if *m < 1e-9 * problem.groups[g].caps[0] {
                continue;
            }
            let [_, a, j] = problem.groups[g].caps;
            let tol = problem.radius(g, i - 1);
            let corner = ((16.0 * tol * a).sqrt() / m)
                .min(j * (96.0 * tol / j).powf(2.0 / 3.0) / (4.0 * m))
                .min(2.3 * tol / (h * m));
            let bend = 0.8 * (a * mean / m).sqrt().min((j * mean * mean / m).cbrt());
            rate = rate.min(if m * mean < 8.0 * tol {
                corner.max(bend)
            } else {
                corner
            });
        }
        rates[i] = rate;
    }
    rates
}

/// Forward and backward passes: neighbouring rates differ by no more than the
/// leg between allows.
fn look_ahead<const D: usize>(legs: &[Leg<D>], rates: &mut [f64]) {
    let reach = |rate: f64, leg: &Leg<D>| {
        (rate * rate + 2.0 * SHARE * leg.acceleration * leg.length).sqrt()
    };
    for (i, leg) in legs.iter().enumerate() {
        rates[i + 1] = rates[i + 1].min(reach(rates[i], leg));
    }
    for (i, leg) in legs.iter().enumerate().rev() {
        rates[i] = rates[i].min(reach(rates[i + 1], leg));
    }
}

fn schedule<const D: usize>(legs: &[Leg<D>], rates: &[f64], skip: f64) -> Schedule {
    let mut result = Schedule {
        records: Vec::with_capacity(3 * legs.len()),
        dips: 0,
        duration: 0.0,
    };
    let (mut time, mut s) = (0.0, skip);
    for (i, leg) in legs.iter().enumerate() {
        let length = leg.length - if i == 0 { skip } else { 0.0 };
        let a = SHARE * leg.acceleration;
        let (v0, v1) = (rates[i], rates[i + 1]);
        let top = (0.5 * (v0 * v0 + v1 * v1) + a * length)
            .sqrt()
            .min(1.0)
            .max(v0)
            .max(v1);
        let ways = [
            (top * top - v0 * v0) / (2.0 * a),
            0.0,
            (top * top - v1 * v1) / (2.0 * a),
        ];
        let flat = (length - ways[0] - ways[2]).max(0.0);
        let times = [(top - v0) / a, flat / top.max(1e-12), (top - v1) / a];
        for ((dt, rate), change) in times.iter().zip([v0, top, top]).zip([a, 0.0, -a]) {
            if *dt > 0.0 {
                result.records.push([time, s, rate, change]);
                time += dt;
                s += (rate + 0.5 * change * dt) * dt;
            }
        }
        if i > 0 && v0 < 0.7 * top {
            result.dips += 1;
        }
    }
    let end: f64 = legs.iter().map(|leg| leg.length).sum();
    result.records.push([time, end, 0.0, 0.0]);
    result.duration = time;
    result
}

/// How control points follow a schedule.
struct Pace {
    spans: usize,
    /// Time before it begins, s.
    lead: f64,
    /// Time over which progress is averaged, s.
    smoothing: f64,
    /// Factor on its time.
    slower: f64,
}

/// Control points at the smoothed progress.
fn place<const D: usize>(
    problem: &Problem<D>,
    legs: &[Leg<D>],
    schedule: &Schedule,
    pace: &Pace,
) -> Point<D> {
    let knots = pace.spans + 4;
    let h = problem.scale;
    let progress = |k: usize| {
        let time = ((k as f64 - 1.5) * h - pace.lead) / pace.slower;
        schedule.smooth(time, pace.smoothing)
    };
    let mut ends = vec![0.0];
    for leg in legs {
        ends.push(ends[ends.len() - 1] + leg.length);
    }
    let mut control = Vec::with_capacity(knots);
    for k in 0..knots {
        let s = progress(k);
        let at = ends.partition_point(|end| *end <= s).clamp(1, legs.len());
        let share = s - ends[at - 1];
        let mut c = problem.vertices[at - 1];
        for d in 0..D {
            c[d] += share * legs[at - 1].direction[d];
        }
        control.push(c);
    }
    let mut point = Point {
        control,
        z: 1.0,
        crossings: Vec::with_capacity(ends.len()),
    };
    let mut k = 0;
    for end in &ends[1..ends.len() - 1] {
        while k + 1 < knots && progress(k + 1) < *end {
            k += 1;
        }
        let (low, high) = (progress(k), progress(k + 1));
        let share = if high > low {
            ((end - low) / (high - low)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        point
            .crossings
            .push((k as f64 + share - 1.5).clamp(0.0, pace.spans as f64));
    }
    blend_in(problem, &mut point);
    for c in point.control.iter_mut().rev().take(4) {
        *c = problem.vertices[problem.vertices.len() - 1];
    }
    round_off(problem, &mut point);
    point
}

/// Rounds the corners of the control polygon within the balls: repeated averaging, kept near the
/// path.
fn round_off<const D: usize>(problem: &Problem<D>, point: &mut Point<D>) {
    let knots = point.control.len();
    let mut legs = vec![1; knots];
    for k in 1..knots {
        let time = k as f64 - 1.5;
        let mut leg = legs[k - 1];
        while leg < problem.vertices.len() - 1 && point.crossings[leg - 1] <= time {
            leg += 1;
        }
        legs[k] = leg;
    }
    let offset = |place: &[f64; D], k: usize, g: usize| {
        let place = [place[3 * g], place[3 * g + 1], place[3 * g + 2]];
        let away = problem.nearest(&place, legs[k], g).offset;
        (away, square(&away).sqrt())
    };
    // A start in motion may be farther away than that.
    let mut held = vec![[0.0; 2]; knots];
    for (k, place) in point.control.iter().enumerate() {
        for g in 0..Problem::<D>::GROUPS {
            held[k][g] = offset(place, k, g).1.max(HELD * problem.groups[g].radius);
        }
    }
    let mut rounded = point.control.clone();
    for _ in 0..ROUNDS {
        for k in 4..knots - 4 {
            for d in 0..D {
                let sides = point.control[k - 1][d] + point.control[k + 1][d];
                rounded[k][d] = 0.5 * point.control[k][d] + 0.25 * sides;
            }
            for g in 0..Problem::<D>::GROUPS {
                let ((away, far), most) = (offset(&rounded[k], k, g), held[k][g]);
                if far > most {
                    for d in 0..3 {
                        rounded[k][3 * g + d] -= away[d] * (1.0 - most / far);
                    }
                }
            }
        }
        std::mem::swap(&mut point.control, &mut rounded);
    }
}

/// Lets the offset between the control points of the start and the polyline fade out over some
/// control points, as a quintic that continues smoothly.
fn blend_in<const D: usize>(problem: &Problem<D>, point: &mut Point<D>) {
    let planned = [1, 2, 3].map(|k| point.control[k]);
    problem.pin(point);
    let fade = FADE.min(point.control.len() as f64 / 2.0);
    let own = [1, 2, 3].map(|k| point.control[k]);
    for d in 0..D {
        let [o1, o2, o3] = [0, 1, 2].map(|i| own[i][d] - planned[i][d]);
        // Slope and curvature at the last of them, over the whole fade.
        let slope = (1.5 * o3 - 2.0 * o2 + 0.5 * o1) * fade;
        let bend = (o3 - 2.0 * o2 + o1) * fade * fade;
        for k in 4..point.control.len() {
            let x = (k as f64 - 3.0) / fade;
            if x >= 1.0 {
                break;
            }
            let (y, xx) = ((1.0 - x).powi(3), x * x);
            let even = 1.0 + 3.0 * x + 6.0 * xx;
            point.control[k][d] += y * (o3 * even + slope * x * (1.0 + 3.0 * x) + 0.5 * bend * xx);
        }
    }
}
