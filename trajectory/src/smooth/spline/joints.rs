//! What the joints of an arm that follow a spline add to the Newton system.

use simd::{Build, F4, Four, LANES, Op};

use super::basis::{FIRST, SECOND, THIRD};
use super::iterate::Iterate;
use super::joint::{Joint, dot};
use super::newton::System;
use super::problem::{Point, Problem};

/// Control points of the longest difference.
const WIDE: usize = 4;

/// Gradient, border and curvature of the terms of one joint, by control point.
struct Terms {
    slopes: Vec<f64>,
    borders: Vec<f64>,
    /// With the control point itself and those before it.
    curves: Vec<[f64; WIDE]>,
    /// What the terms add to the slope along `z` and to its curvature.
    along_z: [f64; 2],
}

impl<const D: usize> Joint<D> {
    /// How it moves with control point `k`.
    fn wide(&self, k: usize) -> Wide {
        let mut wide = [[0.0; LANES]; 2];
        wide.as_flattened_mut()[..D].copy_from_slice(&self.changes[k]);
        wide
    }

    /// The terms of an iterate.
    fn terms(&self, problem: &Problem<D>, point: &Point<D>) -> Terms {
        let (positions, count) = (self.positions(&point.control), point.control.len());
        let mut terms = Terms {
            slopes: vec![0.0; count],
            borders: vec![0.0; count],
            curves: vec![[0.0; WIDE]; count],
            along_z: [0.0; 2],
        };
        for (k, (q, [middle, half])) in positions.iter().zip(&self.range).enumerate() {
            let (away, inverse) = (q - middle, 1.0 / (half * half - (q - middle).powi(2)));
            let slope = 2.0 * away * inverse;
            terms.slopes[k] = slope;
            terms.curves[k][0] = slope * slope + 2.0 * inverse;
        }
        let h = problem.spacing(point.z);
        let bound = |k: usize| (self.caps[k - 1] * h.powi(k as i32), k as f64 / 3.0);
        terms.add(&FIRST, &positions[..count], (bound(1), point.z));
        terms.add(&SECOND, &positions[..count], (bound(2), point.z));
        terms.add(&THIRD, &positions[..count], (bound(3), point.z));
        terms
    }
}

impl Terms {
    /// Adds the terms of differences, whose bound is proportional to a power of `z`.
    #[inline(always)]
    fn add<const M: usize>(
        &mut self,
        w: &[f64; M],
        positions: &[f64],
        ((bound, power), z): ((f64, f64), f64),
    ) {
        let rise = bound * power / z;
        let bent = rise * rise + bound * rise * (power - 1.0) / z;
        for (k, q) in positions.windows(M).enumerate() {
            let y = dot(w, q);
            let inverse = 1.0 / (bound * bound - y * y);
            let slope = 2.0 * y * inverse;
            let fall = -2.0 * bound * rise * inverse;
            let curve = 2.0 * inverse + slope * slope;
            self.along_z[0] += fall;
            self.along_z[1] += fall * fall - 2.0 * bent * inverse;
            for i in 0..M {
                self.slopes[k + i] += w[i] * slope;
                self.borders[k + i] += w[i] * slope * fall;
                for j in 0..=i {
                    self.curves[k + i][i - j] += w[i] * w[j] * curve;
                }
            }
        }
    }
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds the bounds of all joints.
    pub(super) fn joints(&mut self, at: &Iterate<'_, D>) {
        let steep = if at.shifts.is_none() { 1.0 } else { 0.0 };
        let joints = &at.problem.joints;
        let all = joints.iter().map(|joint| joint.terms(at.problem, at.point));
        let all: Vec<Terms> = all.collect();
        for (joint, terms) in joints.iter().zip(&all) {
            self.gradient_z += steep * terms.along_z[0];
            self.hessian_z += terms.along_z[1];
            for (k, side) in self.sides.chunks_exact_mut(D).enumerate() {
                let (slope, border) = (steep * terms.slopes[k + 4], terms.borders[k + 4]);
                for (side, change) in side.iter_mut().zip(&joint.changes[k + 4]) {
                    side[0] += slope * change;
                    side[1] += border * change;
                }
            }
        }
        if !joints.is_empty() {
            Build::detect().run(Curves {
                columns: &mut self.band.columns,
                joints,
                terms: &all,
            });
        }
        if let Some(spare) = Problem::<D>::SPARE {
            for (joint, terms) in joints.iter().zip(&all) {
                self.end(joint, (terms, steep), spare);
            }
        }
    }

    /// Adds what the last control points have in a joint through the spare coordinate, which they share with the one before
    /// them.
    fn end(&mut self, joint: &Joint<D>, (terms, steep): (&Terms, f64), spare: usize) {
        let free = self.sides.len() / D;
        // The first of them, and the row of their coordinate.
        let (first, row) = (free + 4, (free - 1) * D + spare);
        for k in first..first + 4 {
            let own = joint.changes[k][spare];
            self.sides[row][0] += steep * terms.slopes[k] * own;
            self.sides[row][1] += terms.borders[k] * own;
            for (back, curve) in terms.curves[k].iter().enumerate() {
                let other = k - back;
                let twice = if back == 0 { 1.0 } else { 2.0 };
                if other >= first {
                    let both = own * joint.changes[other][spare];
                    self.band.columns[row][0] += twice * curve * both;
                    continue;
                }
                for (d, change) in joint.changes[other].iter().enumerate() {
                    let column = (other - 4) * D + d;
                    let twice = if column == row { 2.0 } else { 1.0 };
                    self.band.columns[column][row - column] += twice * curve * own * change;
                }
            }
        }
    }
}

/// Adds the curvature of the bounds of all joints to the band.
struct Curves<'a, const D: usize, const B: usize> {
    columns: &'a mut [[f64; B]],
    joints: &'a [Joint<D>],
    terms: &'a [Terms],
}

/// How a joint moves with the coordinates of a control point, and zeros after them.
type Wide = [[f64; LANES]; 2];

impl<const D: usize, const B: usize> Op for Curves<'_, D, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        const { assert!(D <= 2 * LANES) };
        let Self {
            columns,
            joints,
            terms,
        } = self;
        let (count, free) = (joints.len(), columns.len() / D);
        let wide: Vec<Wide> = (0..free)
            .flat_map(|k| joints.iter().map(move |joint| joint.wide(k + 4)))
            .collect();
        let at = |k: usize| &wide[k * count..][..count];
        let mut curves = vec![0.0; count];
        for (k, columns) in columns.chunks_exact_mut(D).enumerate() {
            for back in 0..WIDE.min(free - k) {
                for (curve, terms) in curves.iter_mut().zip(terms) {
                    *curve = terms.curves[k + back + 4][back];
                }
                for (b, column) in columns.iter_mut().enumerate() {
                    let sums = products::<S, D>(simd, (at(k), b), at(k + back), &curves);
                    add::<S, D, B>(sums, (b, back), column);
                }
            }
        }
    }
}

/// The sum over the joints of a curvature times coordinate `b` of one control point and all of another.
#[inline(always)]
fn products<S: Four, const D: usize>(
    simd: S,
    (own, b): (&[Wide], usize),
    other: &[Wide],
    curves: &[f64],
) -> [F4<S>; 2] {
    let mut sums = [F4::splat(simd, 0.0); 2];
    for ((own, other), curve) in own.iter().zip(other).zip(curves) {
        let factor = curve * own.as_flattened()[b];
        sums[0] += F4::new(simd, other[0]) * factor;
        if D > LANES {
            sums[1] += F4::new(simd, other[1]) * factor;
        }
    }
    sums
}

/// Adds the entries of coordinate `b` of a control point with all of the one that is `back` after it.
#[inline(always)]
fn add<S: Four, const D: usize, const B: usize>(
    sums: [F4<S>; 2],
    (b, back): (usize, usize),
    column: &mut [f64; B],
) {
    if back == 0 {
        // Those above the diagonal stand in the columns before.
        let sums = sums.map(F4::array);
        for (entry, sum) in column[..D - b].iter_mut().zip(&sums.as_flattened()[b..]) {
            *entry += sum;
        }
        return;
    }
    // The entries after them get zeros.
    let entries = column[back * D - b..].chunks_exact_mut(LANES);
    for (entries, sum) in entries.zip(&sums[..D.div_ceil(LANES)]) {
        (F4::load(sum.build(), entries) + *sum).put(entries, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::spline::corners::along;
    use crate::smooth::spline::joint::DIFFERENCES;
    use crate::smooth::spline::problem::{Group, Room};
    use crate::smooth::spline::project::project;
    use crate::smooth::spline::start;

    fn number(i: usize, d: usize) -> f64 {
        (1.7 * i as f64 + 2.3 * d as f64 + 0.4).sin()
    }

    /// Corners without joints.
    fn corners<const D: usize>() -> Problem<D> {
        let spare = |d: usize| Problem::<D>::SPARE == Some(d);
        let vertex =
            |i: usize| std::array::from_fn(|d| if spare(d) { 0.0 } else { 0.1 * number(i, d) });
        let vertices: Vec<[f64; D]> = (0..4).map(vertex).collect();
        let group = Group {
            caps: [0.5, 5.0, 100.0],
            radius: 0.01,
            width: 0.02,
        };
        Problem::at_rest(vertices, [group; 2])
    }

    /// Corners with joints that follow, and a first iterate inside of all bounds; `E` are the coordinates without a spare one.
    fn problem<const D: usize, const E: usize>() -> (Problem<D>, Point<D>) {
        let mut without = corners::<E>();
        let first = start::first(&mut without, None, start::KNOTS_PER_RAMP);
        let mut problem = corners::<D>();
        problem.scale = without.scale;
        let lift = |c: &[f64; E]| std::array::from_fn(|d| c.get(d).copied().unwrap_or(0.0));
        let mut point = Point {
            control: first.control.iter().map(lift).collect(),
            z: first.z,
            crossings: first.crossings,
        };
        problem.pin(&mut point);
        project(&problem, &mut point, None, 20);
        let count = point.control.len();
        let joint = |j: usize| Joint {
            caps: [0.5, 5.0, 100.0],
            range: vec![[0.0, 1.0]; count],
            base: (0..count).map(|k| 1e-4 * number(k, j)).collect(),
            changes: (0..count)
                .map(|k| std::array::from_fn(|d| number(j, d) + 1e-3 * number(k, d)))
                .collect(),
        };
        problem.joints = (0..3).map(joint).collect();
        let h = problem.spacing(point.z);
        let worst = problem
            .joints
            .iter()
            .flat_map(|joint| joint.ratios(&point.control, h));
        point.z *= (1.5 * worst.fold(1.0, f64::max)).powi(3);
        (problem, point)
    }

    /// The barrier falls along the Newton step as the decrement says, with a spare coordinate and without.
    fn check<const D: usize, const E: usize, const B: usize>() {
        let (problem, point) = problem::<D, E>();
        let room = Room::new(&problem, &point);
        let weight = problem.parameter(&point) / point.z;
        let step = System::<D, B>::new(&point).step(&problem, &point, &room, weight);
        let step = step.unwrap();
        let value = along((&problem, &room), (&point, &step), weight);
        let share = 1e-5;
        let (before, here, after) = (value(-share), value(0.0), value(share));
        let slope = (before - after) / (2.0 * share) / step.decrement;
        assert!((slope - 1.0).abs() < 1e-3, "{D}: {slope}");
        // Along Newton's step the curvature is the decrement.
        let wide = 1e-3;
        let bend = (value(-wide) + value(wide) - 2.0 * here) / (wide * wide) / step.decrement;
        assert!((bend - 1.0).abs() < 2e-2, "{D}: {bend}");
    }

    #[test]
    fn the_barrier_falls_along_the_step_as_its_decrement_says() {
        check::<3, 3, 20>();
        check::<4, 3, 24>();
        check::<6, 6, 36>();
        check::<7, 6, 40>();
    }

    /// Four at a time, the squares and bounds of a joint are what they are one by one.
    #[test]
    fn four_at_a_time_are_as_one_by_one() {
        let (problem, point) = problem::<4, 3>();
        let h = problem.spacing(point.z);
        for joint in &problem.joints {
            let q = joint.positions(&point.control);
            let mut sum = 0.0;
            for w in DIFFERENCES {
                let bound = joint.caps[w.len() - 2] * h.powi(w.len() as i32 - 1);
                for q in q[..point.control.len()].windows(w.len()) {
                    sum += (bound * bound - dot(w, q).powi(2)).ln();
                }
            }
            for q in &q[..point.control.len()] {
                sum += (1.0 - q * q).ln();
            }
            let mut product = 0.0;
            let bounds = joint.look(simd::Plain, (&point.control, h), |squares, bounds| {
                let both = squares.array().into_iter().zip(bounds.array());
                product += both
                    .map(|(square, bound)| (1.0 - square / bound).ln())
                    .sum::<f64>();
                true
            });
            let got = bounds.unwrap() + product;
            // Thousands of logarithms.
            assert!((got - sum).abs() < 1e-6, "{got} {sum}");
        }
    }
}
