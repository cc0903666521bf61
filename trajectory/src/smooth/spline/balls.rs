//! What balls add to the Newton system: each at its closest approach, whose time is eliminated, so there
//! is no curvature in the direction of motion.

use super::basis::weights;
use super::newton::{Iterate, System, outer};
use super::problem::{Problem, part, square};

/// How much stiffer the time of a pass is tied to the nearest place than both balls hold it.
const TIE: f64 = 1e3;

/// A ball at one iterate.
struct Ball<const D: usize> {
    /// First control point, and its weights.
    first: usize,
    weights: [f64; 5],
    gradient: [f64; D],
    /// The gradient for each unit of the weights' rate: the pass moves with the velocity.
    turned: [f64; D],
    rates: [f64; 5],
    /// The Hessian, before the passing time is eliminated; nothing couples two groups.
    blocks: [[[f64; 3]; 3]; 2],
    /// The Hessian times the velocity.
    bent: [f64; D],
    /// Curvature along the passing time.
    stiff: f64,
    /// How the place moves with `z`, if the end is in motion.
    slide: Option<[f64; D]>,
    /// What the slope along `z` gains with the velocity, if the end is in motion.
    slope: f64,
}

impl<const D: usize> Ball<D> {
    fn new(at: &Iterate<'_, D>, i: usize, goal: &[f64; D]) -> Self {
        let (point, room) = (at.point, at.room);
        let (first, share) = point.locate(point.crossings[i]);
        let [p, v, a] = point.at(point.crossings[i]);
        let [weights, rates, _] = weights(share);
        let mut ball = Self {
            first,
            weights,
            gradient: [0.0; D],
            turned: [0.0; D],
            rates,
            blocks: [[[0.0; 3]; 3]; 2],
            bent: [0.0; D],
            stiff: 0.0,
            slide: None,
            slope: 0.0,
        };
        let mut damping = 0.0;
        for g in 0..Problem::<D>::GROUPS {
            let y = [0, 1, 2].map(|d| p[3 * g + d] - goal[3 * g + d]);
            let slack = 1.0 / (room.balls[g][i].powi(2) - square(&y));
            damping += 2.0 * slack * (square(&y) * square(&part(&a, g))).sqrt();
            ball.blocks[g] = outer(&y, 2.0 * slack, 4.0 * slack * slack);
            for d in 0..3 {
                ball.gradient[3 * g + d] = 2.0 * slack * y[d];
            }
        }
        if at.problem.is_nearest(&v) {
            let offset = [0, 1, 2].map(|d| p[d] - goal[d]);
            ball.hold(&v, &a, &offset);
        }
        ball.bent = ball.times(&v);
        ball.stiff = (0..D).map(|d| ball.bent[d] * v[d]).sum::<f64>() + damping;
        if !at.slides.is_empty() {
            let mut slide = [0.0; D];
            let both = weights.iter().zip(&rates);
            for ((weight, rate), change) in both.zip(&at.slides[first..]) {
                for d in 0..D {
                    slide[d] += weight * change[d];
                    ball.slope += rate * change[d] * ball.turned[d];
                }
            }
            ball.slide = Some(slide);
        }
        ball
    }

    /// Ties the pass to where the place is nearest, at `offset` from the ball's centre: its time follows the place,
    /// and what the other group gains with the time is a slope of the place.
    fn hold(&mut self, v: &[f64; D], a: &[f64; D], offset: &[f64; 3]) {
        let speed = square(&part(v, 0));
        let bend: f64 = (0..3).map(|d| offset[d] * a[d]).sum();
        let moved = dot(&self.gradient, v) / (speed + bend).max(0.5 * speed);
        for d in 0..3 {
            self.gradient[d] -= moved * v[d];
            self.turned[d] = -moved * offset[d];
        }
        let bent = self.times(v);
        let stiff = (0..D).map(|d| bent[d] * v[d]).sum::<f64>();
        let tie = TIE * stiff / (speed * speed);
        for d in 0..3 {
            for e in 0..3 {
                self.blocks[0][d][e] += tie * v[d] * v[e];
            }
        }
    }

    /// The Hessian times a vector.
    fn times(&self, vector: &[f64; D]) -> [f64; D] {
        let entry = |d: usize| {
            let row = &self.blocks[d / 3][d % 3];
            let own = &vector[d / 3 * 3..];
            row[0] * own[0] + row[1] * own[1] + row[2] * own[2]
        };
        std::array::from_fn(entry)
    }

    /// The Hessian without the passing time: it couples all coordinates.
    fn eliminated(&self) -> [[f64; D]; D] {
        let mut hessian = [[0.0; D]; D];
        for d in 0..D {
            hessian[d][d / 3 * 3..d / 3 * 3 + 3].copy_from_slice(&self.blocks[d / 3][d % 3]);
            if self.stiff > 0.0 {
                for e in 0..D {
                    hessian[d][e] -= self.bent[d] * self.bent[e] / self.stiff;
                }
            }
        }
        hessian
    }
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds all balls.
    pub(super) fn balls(&mut self, at: &Iterate<'_, D>) {
        self.passes.clear();
        for (i, goal) in at.problem.inner().iter().enumerate() {
            let ball = Ball::new(at, i, goal);
            if Self::APART {
                self.add_apart(&ball);
            } else {
                self.add_eliminated(&ball);
            }
        }
    }

    /// Adds a ball whose passing time stays an unknown, so that the groups are not coupled.
    fn add_apart(&mut self, ball: &Ball<D>) {
        let mut border = [0.0; D];
        let mut drawn = 0.0;
        if let Some(slide) = &ball.slide {
            border = ball.times(slide);
            drawn = dot(&ball.bent, slide);
            self.gradient_z += dot(&ball.gradient, slide) + ball.slope;
            self.hessian_z += dot(&border, slide);
        }
        let free = self.sides.len() / D;
        let mut first = [0; 2];
        for g in 0..Problem::<D>::GROUPS {
            for i in 0..5 {
                let Some(k) = (ball.first + i).checked_sub(4).filter(|k| *k < free) else {
                    continue;
                };
                let row = Self::row(free, k, g);
                for d in 0..3 {
                    self.sides[row + d][0] += ball.weights[i] * ball.gradient[3 * g + d]
                        + ball.rates[i] * ball.turned[3 * g + d];
                    self.sides[row + d][1] += ball.weights[i] * border[3 * g + d];
                }
                for j in (0..=i).filter(|j| ball.first + j >= 4) {
                    let both = ball.weights[i] * ball.weights[j];
                    self.add_block(row, (i - j) * Self::STRIDE, both, &ball.blocks[g]);
                }
            }
            first[g] = Self::row(free, ball.first.saturating_sub(4), g);
        }
        if ball.stiff <= 0.0 {
            return;
        }
        let column = self.passes.push(first, ball.stiff, drawn);
        for g in 0..Problem::<D>::GROUPS {
            for i in 0..5 {
                let Some(k) = (ball.first + i).checked_sub(4).filter(|k| *k < free) else {
                    continue;
                };
                for d in 0..3 {
                    column[Self::row(free, k, g) + d] = ball.weights[i] * ball.bent[3 * g + d];
                }
            }
        }
    }

    /// Adds a multiple of a block of three rows, `back` before its column's diagonal.
    fn add_block(&mut self, row: usize, back: usize, factor: f64, block: &[[f64; 3]; 3]) {
        let columns = &mut self.band.columns[row - back..row - back + 3];
        for (b, column) in columns.iter_mut().enumerate() {
            for a in (if back == 0 { b } else { 0 })..3 {
                column[back + a - b] += factor * block[a][b];
            }
        }
    }

    /// Adds a ball whose passing time is eliminated.
    fn add_eliminated(&mut self, ball: &Ball<D>) {
        let hessian = ball.eliminated();
        let mut border = [0.0; D];
        if let Some(slide) = &ball.slide {
            for d in 0..D {
                border[d] = dot(&hessian[d], slide);
                self.gradient_z += ball.gradient[d] * slide[d];
                self.hessian_z += slide[d] * border[d];
            }
            self.gradient_z += ball.slope;
        }
        let free = self.sides.len() / D;
        let (first, w) = (ball.first, &ball.weights);
        for i in 0..5 {
            if first + i < 4 || first + i - 4 >= free {
                continue;
            }
            let row = (first + i - 4) * D;
            for d in 0..D {
                self.sides[row + d][0] += w[i] * ball.gradient[d] + ball.rates[i] * ball.turned[d];
                self.sides[row + d][1] += w[i] * border[d];
            }
            for j in (0..=i).filter(|j| first + j >= 4) {
                let (back, both) = ((i - j) * D, w[i] * w[j]);
                let columns = &mut self.band.columns[row - back..row - back + D];
                for (b, column) in columns.iter_mut().enumerate() {
                    for a in (if i == j { b } else { 0 })..D {
                        column[back + a - b] += both * hessian[a][b];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::smooth::spline::newton::{Barrier, System};
    use crate::smooth::spline::problem::{Group, Problem, Room, ways};
    use crate::smooth::spline::project::project;
    use crate::smooth::spline::start;

    /// Corners in position and orientation, with and without motion at the start.
    fn problem(speed: f64) -> Problem<6> {
        let vertices = [
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.1, 0.0, 0.0, 0.3, 0.0, 0.1],
            [0.1, 0.1, 0.0, 0.3, 0.4, 0.0],
            [0.0, 0.1, 0.1, 0.0, 0.4, 0.3],
            [0.0, 0.2, 0.1, 0.1, 0.1, 0.3],
        ];
        let group = |scale: f64, radius: f64| Group {
            caps: [0.5, 5.0, 100.0].map(|cap| cap * scale),
            radius,
            width: 2.0 * radius,
        };
        let moving = [speed, 0.0, 0.0, 3.0 * speed, 0.0, speed];
        Problem {
            groups: [group(1.0, 0.01), group(4.0, 0.08)],
            ways: ways(&vertices),
            vertices: vertices.to_vec(),
            start: [vertices[0], moving, [0.0; 6], [0.0; 6]],
            finish: None,
            scale: 1.0,
            anchor: None,
            nearest: false,
        }
    }

    /// With the passing times as unknowns the Newton step is the same.
    #[test]
    fn bands_of_their_own_give_the_same_step() {
        for (speed, nearest) in [(0.0, false), (0.1, false), (0.0, true), (0.1, true)] {
            let mut problem = problem(speed);
            problem.nearest = nearest;
            let mut point = start::first(&mut problem, (speed > 0.0).then_some(1.0));
            problem.pin(&mut point);
            project(&problem, &mut point, None, 20);
            let room = Room::new(&problem, &point);
            let weight = problem.parameter(&point) / point.z;
            let whole = System::<6, 36>::new(&point).step(&problem, &point, &room, weight);
            let apart = System::<6, 20>::new(&point).step(&problem, &point, &room, weight);
            let (whole, apart) = (whole.unwrap(), apart.unwrap());
            let size = whole
                .control
                .iter()
                .fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(size > 0.0 && whole.z != 0.0);
            for (a, b) in whole.control.iter().zip(&apart.control) {
                assert!((a - b).abs() < 1e-7 * size, "{a} {b} of {size}");
            }
            assert!((whole.z - apart.z).abs() < 1e-7 * whole.z.abs());
            assert!((whole.decrement / apart.decrement - 1.0).abs() < 1e-7);
        }
    }

    /// The barrier falls along a step as fast as the step says, wherever poses are passed: each trial looks for its
    /// passes again.
    #[test]
    fn the_slope_of_a_step_is_that_of_the_barrier() {
        for nearest in [false, true] {
            let mut problem = problem(0.1);
            problem.nearest = nearest;
            let mut point = start::first(&mut problem, Some(1.0));
            problem.pin(&mut point);
            project(&problem, &mut point, None, 40);
            let room = Room::new(&problem, &point);
            project(&problem, &mut point, Some(&room), 40);
            let weight = problem.parameter(&point) / point.z;
            let step = System::<6, 36>::new(&point).step(&problem, &point, &room, weight);
            let step = step.unwrap();
            let barrier = Barrier {
                problem: &problem,
                room: &room,
                weight,
                keep: 0.0,
            };
            let value = |share: f64| {
                let mut trial = point.clone();
                trial.z += share * step.z;
                let free = trial.control.iter_mut().skip(4);
                for (to, change) in free.zip(step.control.chunks_exact(6)) {
                    for d in 0..6 {
                        to[d] += share * change[d];
                    }
                }
                problem.pin(&mut trial);
                project(&problem, &mut trial, Some(&room), 40);
                let seen = barrier.look(&trial, &[]).unwrap();
                barrier.value(&trial, &seen)
            };
            let slope = (value(1e-5) - value(-1e-5)) / 2e-5;
            let off = (slope + step.decrement).abs() / step.decrement;
            assert!(off < 0.01, "{nearest}: {slope} {}", step.decrement);
        }
    }
}
