//! A change of the path parameter to one that is nearly proportional to time.

use super::Boundary;

/// The path parameter `u` as a smooth function of `w` (s): its speed `du/dw` is a cubic spline,
/// proportional to `w²` near an end at rest, as in a motion with bounded jerk. In `w` the law of a
/// good motion is nearly constant, also at the ends.
#[derive(Clone, Debug)]
pub(super) struct Reparametrization {
    /// Width of a span.
    span: f64,
    /// Speed in each span: coefficients over the place in the span, 0 to 1.
    speeds: Vec<[f64; 4]>,
    /// `u` at the start of each span, then at the end.
    starts: Vec<f64>,
}

/// The coefficients outside of and at one end of the spline, from the first inside.
fn closing(boundary: Boundary, end: f64, first: f64, span: f64) -> (f64, f64) {
    match boundary {
        Boundary::Rest => (first, -0.5 * first),
        Boundary::Free => ((2.0 * end - first).max(0.1 * end), end),
        Boundary::Moving { rate, acceleration } => {
            let outside = first - 2.0 * span * acceleration;
            (outside, 0.25 * (6.0 * rate - outside - first))
        }
    }
}

impl Reparametrization {
    /// A reparametrization whose speed follows `samples`, `span` apart, and whose range is `0..=end`; the span
    /// is adapted so that it fits. Three samples at least.
    pub(super) fn new(samples: &[f64], span: f64, end: f64, boundaries: [Boundary; 2]) -> Self {
        let mut reparametrization = Self::of(samples, span, boundaries);
        for _ in 0..8 {
            let total = reparametrization.end();
            if (total / end - 1.0).abs() < 1e-14 {
                break;
            }
            reparametrization = Self::of(samples, reparametrization.span * end / total, boundaries);
        }
        reparametrization
    }

    /// The reparametrization with exactly this span.
    fn of(samples: &[f64], span: f64, boundaries: [Boundary; 2]) -> Self {
        let count = samples.len();
        let mut d = Vec::with_capacity(count + 2);
        let (outside, edge) = closing(boundaries[0], samples[0], samples[1], span);
        d.extend([outside, edge]);
        d.extend_from_slice(&samples[1..count - 1]);
        let (outside, edge) = closing(boundaries[1], samples[count - 1], samples[count - 2], span);
        d.extend([edge, outside]);
        let mut start = 0.0;
        let (mut speeds, mut starts) = (Vec::with_capacity(count), vec![0.0]);
        for d in d.windows(4) {
            let c = [
                (d[0] + 4.0 * d[1] + d[2]) / 6.0,
                (d[2] - d[0]) / 2.0,
                (d[0] - 2.0 * d[1] + d[2]) / 2.0,
                (d[3] - 3.0 * d[2] + 3.0 * d[1] - d[0]) / 6.0,
            ];
            start += span * (c[0] + c[1] / 2.0 + c[2] / 3.0 + c[3] / 4.0);
            speeds.push(c);
            starts.push(start);
        }
        Self {
            span,
            speeds,
            starts,
        }
    }

    /// The last `u`.
    fn end(&self) -> f64 {
        self.starts[self.starts.len() - 1]
    }

    /// The last `w` (s).
    pub(super) fn duration(&self) -> f64 {
        self.span * self.speeds.len() as f64
    }

    /// Whether the speed is positive between the ends, so that the reparametrization can be inverted.
    pub(super) fn ascends(&self) -> bool {
        let inside = |i: usize| {
            let [c0, c1, c2, c3] = self.speeds[i];
            let speed = |x: f64| c0 + x * (c1 + x * (c2 + x * c3));
            let first = i == 0;
            let last = i + 1 == self.speeds.len();
            (first || c0 > 0.0)
                && (last || speed(1.0) > 0.0)
                && [0.25, 0.5, 0.75].iter().all(|x| speed(*x) > 0.0)
        };
        self.span > 0.0 && (0..self.speeds.len()).all(inside)
    }

    /// `u` and its three derivatives at `w`.
    pub(super) fn at(&self, w: f64) -> [f64; 4] {
        let place = (w / self.span).clamp(0.0, self.speeds.len() as f64);
        let i = (place as usize).min(self.speeds.len() - 1);
        let x = place - i as f64;
        let [c0, c1, c2, c3] = self.speeds[i];
        let u = x * (c0 + x * (c1 / 2.0 + x * (c2 / 3.0 + x * c3 / 4.0)));
        [
            self.starts[i] + self.span * u,
            c0 + x * (c1 + x * (c2 + x * c3)),
            (c1 + x * (2.0 * c2 + x * 3.0 * c3)) / self.span,
            (2.0 * c2 + x * 6.0 * c3) / (self.span * self.span),
        ]
    }

    /// The `w` at which the path parameter is `u`, by safe Newton steps.
    pub(super) fn inverse(&self, u: f64) -> f64 {
        let after = self.starts.partition_point(|start| *start <= u).max(1);
        let i = (after - 1).min(self.speeds.len() - 1);
        let (mut low, mut high) = (i as f64 * self.span, (i + 1) as f64 * self.span);
        let share = (u - self.starts[i]) / (self.starts[i + 1] - self.starts[i]);
        let mut w = low + share.clamp(0.0, 1.0) * self.span;
        for _ in 0..60 {
            let [value, slope, ..] = self.at(w);
            if value < u {
                low = w
            } else {
                high = w
            }
            let newton = w - (value - u) / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            if (next - w).abs() <= 1e-15 * self.duration() {
                break;
            }
            w = next;
        }
        w
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meets_its_ends_and_inverts() {
        let samples: Vec<f64> = (0..=20).map(|i| 1.0 + (f64::from(i) * 0.3).sin()).collect();
        let reparametrization =
            Reparametrization::new(&samples, 0.1, 3.0, [Boundary::Rest, Boundary::Rest]);
        assert!(reparametrization.ascends());
        let [u, du, ddu, _] = reparametrization.at(0.0);
        assert_eq!([u, du], [0.0, 0.0]);
        assert!(ddu.abs() < 1e-12);
        assert!((reparametrization.at(reparametrization.duration())[0] - 3.0).abs() < 1e-12);
        for i in 1..30 {
            let u = 0.1 * f64::from(i);
            assert!((reparametrization.at(reparametrization.inverse(u))[0] - u).abs() < 1e-12);
        }
    }

    #[test]
    fn starts_in_motion() {
        let moving = Boundary::Moving {
            rate: 0.7,
            acceleration: -0.4,
        };
        let reparametrization =
            Reparametrization::new(&[1.0; 12], 0.1, 2.0, [moving, Boundary::Rest]);
        let [u, du, ddu, _] = reparametrization.at(0.0);
        assert!(u == 0.0 && (du - 0.7).abs() < 1e-12 && (ddu + 0.4).abs() < 1e-12);
        assert!((reparametrization.at(reparametrization.duration())[0] - 2.0).abs() < 1e-12);
    }
}
