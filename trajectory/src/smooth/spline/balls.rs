//! What balls add to the Newton system: each at its closest approach, whose time is an unknown of its own or
//! is eliminated.

use super::ball::Ball;
use super::iterate::Iterate;
use super::newton::System;
use super::problem::Problem;

pub(super) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds all balls.
    pub(super) fn balls(&mut self, at: &Iterate<'_, D>) {
        self.passes.clear();
        self.around.clear();
        for (i, goal) in at.problem.inner().iter().enumerate() {
            let ball = Ball::new(at, i, goal);
            if Self::APART {
                self.add_apart(&ball, &at.slides);
            } else if let Some(lead) = &ball.lead {
                self.add_led(&ball, lead, &at.slides);
            } else {
                self.add_eliminated(&ball);
            }
            self.around.push(ball);
        }
    }

    /// Adds a ball whose passing time stays an unknown, so that the groups are not coupled.
    fn add_apart(&mut self, ball: &Ball<D>, slides: &[[f64; D]]) {
        let mut border = [0.0; D];
        let mut drawn = 0.0;
        if let Some(slide) = &ball.slide {
            border = ball.times(slide);
            drawn = dot(&ball.bent, slide);
            self.gradient_z += dot(&ball.gradient, slide);
            self.hessian_z += dot(&border, slide);
        }
        // How the tie moves with `z`.
        let mut drift = 0.0;
        if let Some(lead) = &ball.lead
            && !slides.is_empty()
        {
            drift = lead.fall(&slides[ball.first..]);
            drawn += lead.tie * drift;
            self.hessian_z += lead.tie * drift * drift;
        }
        let free = self.sides.len() / D;
        let mut first = [0; 2];
        for g in 0..Problem::<D>::GROUPS {
            for i in 0..5 {
                let Some(row) = Self::free_row(free, ball.first + i, g) else {
                    continue;
                };
                for d in 0..3 {
                    self.sides[row + d][0] += ball.weights[i] * ball.gradient[3 * g + d];
                    self.sides[row + d][1] += ball.weights[i] * border[3 * g + d];
                }
                for j in (0..=i).filter(|j| ball.first + j >= 4) {
                    let both = ball.weights[i] * ball.weights[j];
                    self.add_block(row, (i - j) * Self::STRIDE, both, &ball.blocks[g]);
                }
                if let Some(lead) = ball.lead.as_ref().filter(|_| g == 0) {
                    for d in 0..3 {
                        self.sides[row + d][1] += lead.tie * drift * lead.falls[i][d];
                    }
                    for j in (0..=i).filter(|j| ball.first + j >= 4) {
                        let (own, other) = (&lead.falls[i], &lead.falls[j]);
                        let block = own.map(|x| other.map(|y| x * y));
                        self.add_block(row, (i - j) * Self::STRIDE, lead.tie, &block);
                    }
                }
            }
            first[g] = Self::row(free, ball.first.saturating_sub(4), g);
        }
        self.add_time(ball, first, drawn);
    }

    /// Adds the passing time of a ball as an unknown: the rows where its groups begin, and what couples it with `z`.
    fn add_time(&mut self, ball: &Ball<D>, first: [usize; 2], drawn: f64) {
        let free = self.sides.len() / D;
        if ball.stiff <= 0.0 {
            return;
        }
        let tie = ball.lead.as_ref().map_or(0.0, |lead| lead.tie);
        let column = self
            .passes
            .push(first, ball.stiff + tie, [drawn, ball.slope]);
        for g in 0..Problem::<D>::GROUPS {
            for i in 0..5 {
                let Some(row) = Self::free_row(free, ball.first + i, g) else {
                    continue;
                };
                for d in 0..3 {
                    let tied = ball.lead.as_ref().filter(|_| g == 0);
                    let tied = tied.map_or(0.0, |lead| lead.tie * lead.falls[i][d]);
                    column[row + d] = ball.weights[i] * ball.bent[3 * g + d] + tied;
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
        let gradient = ball.eliminated_gradient();
        let mut border = [0.0; D];
        if let Some(slide) = &ball.slide {
            for d in 0..D {
                border[d] = dot(&hessian[d], slide);
                self.gradient_z += gradient[d] * slide[d];
                self.hessian_z += slide[d] * border[d];
            }
        }
        let free = self.sides.len() / D;
        let (first, w) = (ball.first, &ball.weights);
        // Its control points that are free.
        let (from, to) = (4_usize.saturating_sub(first), (free + 4 - first).min(5));
        let rows = (first + from - 4) * D..(first + to - 4) * D;
        let points = self.sides[rows.clone()].chunks_exact_mut(D);
        for (sides, w) in points.zip(&w[from..to]) {
            for (d, side) in sides.iter_mut().enumerate() {
                side[0] += w * gradient[d];
                side[1] += w * border[d];
            }
        }
        let columns = &mut self.band.columns[rows];
        for (b, row) in hessian.iter().enumerate() {
            // What the control points have of this coordinate.
            let mut all = [[0.0; D]; 5];
            for (all, w) in all.iter_mut().zip(w) {
                *all = row.map(|x| w * x);
            }
            let all = &all.as_flattened()[..to * D];
            for (j, columns) in (from..to).zip(columns.chunks_exact_mut(D)) {
                let below = columns[b].iter_mut().zip(&all[j * D + b..]);
                for (entry, x) in below {
                    *entry += w[j] * x;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::smooth::spline::corners::{along, corners};
    use crate::smooth::spline::line_search::go;
    use crate::smooth::spline::newton::{Step, System};
    use crate::smooth::spline::problem::{Point, Problem, Room, ways};
    use crate::smooth::spline::project::project;
    use crate::smooth::spline::start;

    /// Corners in position and orientation, with and without motion at the start.
    fn problem(speed: f64) -> Problem<6> {
        let moving = [speed, 0.0, 0.0, 3.0 * speed, 0.0, speed];
        Problem {
            start: [[0.0; 6], moving, [0.0; 6], [0.0; 6]],
            ..corners()
        }
    }

    /// With the passing times as unknowns the Newton step is the same; where the place leads, up to what the tie gives.
    #[test]
    fn bands_of_their_own_give_the_same_step() {
        for (speed, led) in [(0.0, false), (0.1, false), (0.0, true), (0.1, true)] {
            let mut problem = problem(speed);
            problem.led = vec![led; 3];
            let mut point = start::first(
                &mut problem,
                (speed > 0.0).then_some(1.0),
                start::KNOTS_PER_RAMP,
            );
            problem.pin(&mut point);
            project(&problem, &mut point, None, 20);
            let room = Room::new(&problem, &point);
            let weight = problem.parameter(&point) / point.z;
            let whole = System::<6, 36>::new(&point).step(&problem, &point, &room, weight);
            let apart = System::<6, 20>::new(&point).step(&problem, &point, &room, weight);
            let (whole, apart) = (whole.unwrap(), apart.unwrap());
            let off = if led { 1e-4 } else { 1e-7 };
            near(&whole, &apart, off);
            assert!(whole.z != 0.0 && (whole.z - apart.z).abs() < off * whole.z.abs());
            assert!((whole.decrement / apart.decrement - 1.0).abs() < off);
        }
    }

    /// Moves an iterate along a step.
    fn moved(
        problem: &Problem<6>,
        room: &Room,
        (point, step): (&Point<6>, &Step),
        share: f64,
    ) -> Point<6> {
        let mut moved = point.clone();
        go(problem, (point, &mut moved), (step, share));
        project(problem, &mut moved, Some(room), 20);
        moved
    }

    /// From a centre, an iterate that follows its inner vertices is nearer to the new centre than one that stays, by the square
    /// of the decrement: it knows how balls and legs move. With either band it is the same step.
    #[test]
    fn an_iterate_at_a_centre_follows_its_vertices() {
        for led in [false, true] {
            let mut problem = problem(0.0);
            problem.led = vec![led; 3];
            let mut point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
            problem.pin(&mut point);
            project(&problem, &mut point, None, 20);
            let room = Room::new(&problem, &point);
            let weight = 0.1 * problem.parameter(&point) / point.z;
            let mut system = System::<6, 20>::new(&point);
            for _ in 0..400 {
                let step = system.step(&problem, &point, &room, weight);
                let Some(step) = step.filter(|step| step.decrement > 1e-18) else {
                    break;
                };
                let share = 1.0 / (1.0 + step.decrement.sqrt());
                point = moved(&problem, &room, (&point, &step), share);
            }
            let shifts: Vec<[f64; 6]> = [1e-4, -2e-4, 3e-4]
                .map(|x| [0.0, 0.0, 0.0, x, 0.5 * x, -x])
                .to_vec();
            let shift = system.shift(&problem, &point, (&room, &shifts)).unwrap();
            let mut whole = System::<6, 36>::new(&point);
            let whole = whole.shift(&problem, &point, (&room, &shifts)).unwrap();
            near(&whole, &shift, if led { 1e-4 } else { 1e-6 });
            for (vertex, shift) in problem.vertices[1..].iter_mut().zip(&shifts) {
                for d in 0..6 {
                    vertex[d] += shift[d];
                }
            }
            problem.ways = ways(&problem.vertices);
            project(&problem, &mut point, Some(&room), 20);
            let left = |system: &mut System<6, 20>, point: &Point<6>| {
                let step = system.step(&problem, point, &room, weight);
                step.map_or(0.0, |step| step.decrement)
            };
            let stays = left(&mut system, &point);
            let followed = moved(&problem, &room, (&point, &shift), 1.0);
            let follows = left(&mut system, &followed);
            assert!(follows < 0.01 * stays, "led {led}: {follows} of {stays}");
        }
    }

    /// Whether two steps are the same up to a share of their size.
    fn near(a: &Step, b: &Step, share: f64) {
        let size = a.control.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(size > 0.0);
        for (a, b) in a.control.iter().zip(&b.control) {
            assert!((a - b).abs() < share * size, "{a} {b} of {size}");
        }
    }

    /// Where the place alone says when a ball is passed, the barrier falls along the Newton step as the decrement says:
    /// its slope knows how the passing time moves.
    #[test]
    fn passes_led_by_the_place_have_the_slope_of_the_barrier() {
        for (led, whole) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut problem = problem(0.0);
            problem.led = vec![led; 3];
            let mut point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
            problem.pin(&mut point);
            project(&problem, &mut point, None, 20);
            let room = Room::new(&problem, &point);
            let weight = problem.parameter(&point) / point.z;
            let step = if whole {
                System::<6, 36>::new(&point).step(&problem, &point, &room, weight)
            } else {
                System::<6, 20>::new(&point).step(&problem, &point, &room, weight)
            };
            let step = step.unwrap();
            let value = along((&problem, &room), (&point, &step), weight);
            let share = 1e-5;
            let slope = (value(share) - value(-share)) / (2.0 * share);
            let ratio = -slope / step.decrement;
            assert!((ratio - 1.0).abs() < 1e-3, "{led} {whole}: {ratio}");
        }
    }
}
