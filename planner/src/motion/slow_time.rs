//! A time for the motion of the tool in which the joints nearly keep their limits.
//!
//! A search with the joints looks at them where they are at even times of a motion. In the time of the tool a place of the curve
//! is elsewhere than after the search, which slows the tool down in some places only; in this time it is nearly where it will be.

/// Samples of the factors of time for each leg, and how many of them at either side their greatest and their mean are of.
const EACH: usize = 32;
const NEAR: usize = 4;
/// Rounds of means.
const ROUNDS: usize = 2;

/// A time that passes slower than that of the tool.
#[derive(Clone, Debug)]
pub(super) struct SlowTime {
    /// Distance of the samples in the time of the tool, s.
    step: f64,
    /// The slow time at each sample, s.
    times: Vec<f64>,
    /// By what factor it is slower there.
    factors: Vec<f64>,
}

impl SlowTime {
    /// The time that is slower by about the factors at these ascending times of the tool (s), of which there are at least two, along so many
    /// legs.
    pub(super) fn new(known: &[(f64, f64)], legs: usize) -> Self {
        let end = known[known.len() - 1].0;
        let count = EACH * legs.max(1);
        let step = end / count as f64;
        let mut factors: Vec<f64> = (0..=count)
            .map(|k| factor(known, k as f64 * step))
            .collect();
        factors = of_neighbours(&factors, |near| near.iter().copied().fold(0.0, f64::max));
        for _ in 0..ROUNDS {
            factors = of_neighbours(&factors, |near| {
                near.iter().sum::<f64>() / near.len() as f64
            });
        }
        let mut times = vec![0.0];
        for pair in factors.windows(2) {
            times.push(times[times.len() - 1] + 0.5 * step * (pair[0] + pair[1]));
        }
        Self {
            step,
            times,
            factors,
        }
    }

    /// The whole of it, s.
    pub(super) fn duration(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// The slow time at a time of the tool, both s.
    pub(super) fn at(&self, tool: f64) -> f64 {
        let k = ((tool / self.step).max(0.0) as usize).min(self.times.len() - 2);
        let since = (tool - k as f64 * self.step).clamp(0.0, self.step);
        self.times[k] + since * (self.factors[k] + 0.5 * since * self.rise(k))
    }

    /// The time of the tool at a slow time, both s.
    pub(super) fn tool(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|known| *known <= time);
        let k = next.clamp(1, self.times.len() - 1) - 1;
        let since = (time - self.times[k]).max(0.0);
        // The root of a quadratic, in the form that does not cancel.
        let (factor, rise) = (self.factors[k], self.rise(k));
        let root = (factor * factor + 2.0 * rise * since).max(0.0).sqrt();
        k as f64 * self.step + (2.0 * since / (factor + root)).min(self.step)
    }

    /// The slope of the factor after a sample, 1/s.
    fn rise(&self, k: usize) -> f64 {
        (self.factors[k + 1] - self.factors[k]) / self.step
    }
}

/// The factor at a time (s), between those that are known.
fn factor(known: &[(f64, f64)], time: f64) -> f64 {
    let next = known.partition_point(|(at, _)| *at <= time);
    let k = next.clamp(1, known.len() - 1);
    let [(from, before), (to, after)] = [known[k - 1], known[k]];
    let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
    before + share * (after - before)
}

/// A number of each factor and its neighbours.
fn of_neighbours(factors: &[f64], number: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let last = factors.len() - 1;
    let near = |k: usize| &factors[k.saturating_sub(NEAR)..=(k + NEAR).min(last)];
    (0..=last).map(|k| number(near(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It is nowhere faster than the tool, as slow as asked for a while, and the two times are those of each other.
    #[test]
    fn it_is_slow_where_it_is_asked_for() {
        let known = [
            (0.0, 1.0),
            (1.0, 1.0),
            (1.1, 3.0),
            (2.0, 3.0),
            (2.1, 1.0),
            (3.0, 1.0),
        ];
        let slow = SlowTime::new(&known, 5);
        assert!(slow.duration() > 3.0 + 2.0 && slow.duration() < 9.0);
        assert!((slow.at(3.0) - slow.duration()).abs() < 1e-12);
        assert!((slow.at(1.8) - slow.at(1.4) - 3.0 * 0.4).abs() < 1e-9);
        for k in 0..=300 {
            let tool = 0.01 * f64::from(k);
            let time = slow.at(tool);
            assert!((slow.tool(time) - tool).abs() < 1e-9, "{tool} s");
            assert!(slow.at(tool + 0.01) - time >= 0.01 - 1e-12 || k == 300);
        }
    }

    /// Times outside of it are those of the nearer end.
    #[test]
    fn it_ends_where_the_tool_does() {
        let slow = SlowTime::new(&[(0.0, 2.0), (1.0, 2.0)], 1);
        assert_eq!([slow.at(-1.0), slow.tool(-1.0)], [0.0, 0.0]);
        assert!((slow.at(2.0) - 2.0).abs() < 1e-12);
        assert!((slow.tool(9.0) - 1.0).abs() < 1e-12);
    }
}
