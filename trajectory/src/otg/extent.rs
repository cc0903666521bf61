//! The smallest and largest position of one joint during a move.

use super::motion::Track;

/// Most switching instants of one track: brake, two profiles, start and end.
const SWITCHES: usize = 3 + 2 * 7 + 2;

impl Track {
    /// The position on arrival, as the profile gives it (SI).
    pub(crate) fn last_position(&self) -> f64 {
        self.inside(self.duration)[0]
    }

    /// Lowest and highest position from start to arrival (SI), without a heap allocation.
    pub(crate) fn extent(&self) -> (f64, f64) {
        let mut times = [self.duration; SWITCHES];
        times[0] = 0.0;
        let mut count = 1;
        self.frame.switches(&self.blended_profile, |time| {
            if let Some(place) = times.get_mut(count) {
                *place = time.min(self.duration);
                count += 1;
            }
        });
        let times = &mut times[..(count + 1).min(SWITCHES)];
        times.sort_unstable_by(f64::total_cmp);
        let (mut low, mut high) = (
            self.start[0].min(self.end[0]),
            self.start[0].max(self.end[0]),
        );
        for pair in times.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            if to > from {
                self.widen(from, to, &mut low, &mut high);
            }
        }
        (low, high)
    }

    /// Positions at the turning points of a phase of constant jerk.
    fn widen(&self, from: f64, to: f64, low: &mut f64, high: &mut f64) {
        let middle = 0.5 * (from + to);
        let reach = 0.5 * (to - from);
        let [p, v, a, j] = self.inside(middle);
        let mut visit = |t: f64| {
            if t.abs() <= reach {
                let position = p + t * (v + 0.5 * t * (a + t * j / 3.0));
                *low = low.min(position);
                *high = high.max(position);
            }
        };
        // v + a t + j t²/2 = 0
        let root = a * a - 2.0 * j * v;
        if root < 0.0 {
            return;
        }
        let sum = -(a + root.sqrt().copysign(a));
        if sum != 0.0 {
            visit(2.0 * v / sum);
        }
        if j != 0.0 {
            visit(sum / j);
        }
    }
}
