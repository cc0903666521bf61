//! A ball at one iterate: at its closest approach, whose time is eliminated, so there is no curvature in
//! the direction of motion.

use super::basis::weights;
use super::iterate::{Iterate, outer};
use super::problem::{Problem, part, square};

/// A ball at one iterate.
pub(super) struct Ball<const D: usize> {
    /// First control point, and its weights.
    pub(super) first: usize,
    pub(super) weights: [f64; 5],
    pub(super) gradient: [f64; D],
    /// The Hessian, before the passing time is eliminated; nothing couples two groups.
    pub(super) blocks: [[[f64; 3]; 3]; 2],
    /// The Hessian times the velocity.
    pub(super) bent: [f64; D],
    /// Curvature along the passing time.
    pub(super) stiff: f64,
    /// How the place moves with `z`, if the end is in motion.
    pub(super) slide: Option<[f64; D]>,
    /// Where the place alone says when it is passed.
    pub(super) lead: Option<Lead>,
    /// Slope of the barrier along the passing time.
    pub(super) slope: f64,
}

/// The passing time as a function of the place alone.
pub(super) struct Lead {
    /// By how much it falls with each coordinate of each control point.
    pub(super) falls: [[f64; 3]; 5],
    /// Weight of a passing time that is another one.
    pub(super) tie: f64,
}

impl Lead {
    /// By how much the passing time falls when each of the control points moves by so much.
    pub(super) fn fall<const D: usize>(&self, moves: &[[f64; D]]) -> f64 {
        let each = self.falls.iter().zip(moves);
        each.map(|(falls, moves)| falls.iter().zip(moves).map(|(a, b)| a * b).sum::<f64>())
            .sum()
    }
}

/// Weight of the tie between a passing time and the place, beside the curvature along that time.
const TIE: f64 = 1e6;

impl<const D: usize> Ball<D> {
    pub(super) fn new(at: &Iterate<'_, D>, i: usize, goal: &[f64; D]) -> Self {
        let (point, room) = (at.point, at.room);
        let (first, share) = point.locate(point.crossings[i]);
        let all = weights(share);
        let [p, v, a] = point.with(first, &all);
        let [weights, slopes, _] = all;
        let mut ball = Self {
            first,
            weights,
            gradient: [0.0; D],
            blocks: [[[0.0; 3]; 3]; 2],
            bent: [0.0; D],
            stiff: 0.0,
            slide: None,
            lead: None,
            slope: 0.0,
        };
        let mut damping = 0.0;
        let heavy = at.problem.heavy(point);
        for g in 0..Problem::<D>::GROUPS {
            let y = [0, 1, 2].map(|d| p[3 * g + d] - goal[3 * g + d]);
            let slack = 1.0 / (room.balls[g][i].powi(2) - square(&y));
            let slope = 2.0 * heavy * slack;
            damping += slope * (square(&y) * square(&part(&a, g))).sqrt();
            ball.blocks[g] = outer(&y, slope, 2.0 * slope * slack);
            for d in 0..3 {
                ball.gradient[3 * g + d] = slope * y[d];
            }
        }
        ball.bent = ball.times(&v);
        ball.stiff = (0..D).map(|d| ball.bent[d] * v[d]).sum::<f64>() + damping;
        if at.problem.is_led(i) && ball.stiff > 0.0 {
            ball.lead(&[p, v, a], goal, &slopes);
        }
        if let Some(shifts) = at.shifts {
            ball.gradient = ball.times(&shifts[i]).map(|x| -x);
        }
        // Elsewhere it is passed where the barrier does not depend on the time.
        if ball.lead.is_some() || at.shifts.is_some() {
            ball.slope = (0..D).map(|d| ball.gradient[d] * v[d]).sum();
        }
        if !at.slides.is_empty() {
            let mut slide = [0.0; D];
            for (weight, change) in weights.iter().zip(&at.slides[first..]) {
                for d in 0..D {
                    slide[d] += weight * change[d];
                }
            }
            ball.slide = Some(slide);
        }
        ball
    }

    /// Ties the passing time to the closest approach of the place.
    fn lead(&mut self, [p, v, a]: &[[f64; D]; 3], goal: &[f64; D], slopes: &[f64; 5]) {
        let y = [0, 1, 2].map(|d| p[d] - goal[d]);
        let speed = square(&part(v, 0));
        let bent: f64 = (0..3).map(|d| y[d] * a[d]).sum();
        let curvature = (speed + bent).max(0.5 * speed);
        if curvature <= 0.0 {
            return;
        }
        let fall =
            |i: usize| [0, 1, 2].map(|d| (self.weights[i] * v[d] + slopes[i] * y[d]) / curvature);
        self.lead = Some(Lead {
            falls: [0, 1, 2, 3, 4].map(fall),
            tie: TIE * self.stiff,
        });
    }

    /// By how much the passing time moves with a step of the free control points, in knots.
    pub(super) fn time(&self, step: &[f64]) -> f64 {
        if self.stiff <= 0.0 {
            return 0.0;
        }
        if let Some(lead) = &self.lead {
            let mut fall = 0.0;
            for (i, falls) in lead.falls.iter().enumerate() {
                if let Some(k) = (self.first + i).checked_sub(4) {
                    let moved = step.get(k * D..(k + 1) * D).unwrap_or_default();
                    fall += moved.iter().zip(falls).map(|(a, b)| a * b).sum::<f64>();
                }
            }
            return -fall;
        }
        let mut pull = 0.0;
        for (i, weight) in self.weights.iter().enumerate() {
            let Some(k) = (self.first + i).checked_sub(4) else {
                continue;
            };
            let moved = step.get(k * D..(k + 1) * D).unwrap_or_default();
            pull += weight
                * moved
                    .iter()
                    .zip(&self.bent)
                    .map(|(a, b)| a * b)
                    .sum::<f64>();
        }
        -(pull + self.slope) / self.stiff
    }

    /// The Hessian times a vector.
    pub(super) fn times(&self, vector: &[f64; D]) -> [f64; D] {
        let entry = |d: usize| {
            if d / 3 >= Problem::<D>::GROUPS {
                return 0.0;
            }
            let row = &self.blocks[d / 3][d % 3];
            let own = &vector[d / 3 * 3..];
            row[0] * own[0] + row[1] * own[1] + row[2] * own[2]
        };
        std::array::from_fn(entry)
    }

    /// The gradient without the passing time.
    pub(super) fn eliminated_gradient(&self) -> [f64; D] {
        if self.stiff <= 0.0 {
            return self.gradient;
        }
        let share = self.slope / self.stiff;
        std::array::from_fn(|d| self.gradient[d] - share * self.bent[d])
    }

    /// The Hessian without the passing time: it couples all coordinates.
    pub(super) fn eliminated(&self) -> [[f64; D]; D] {
        let mut hessian = [[0.0; D]; D];
        for d in 0..3 * Problem::<D>::GROUPS {
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
