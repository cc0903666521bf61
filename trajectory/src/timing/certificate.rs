//! What is known for certain about a time law.

use crate::limit::{ActiveSpan, Limit, LimitPeak};

/// What is known for certain about a timed path.
///
/// Joint ratios are bounds on the quintic pieces themselves for all times. Tool ratios come from
/// dense samples of the exact composition plus `tool_margin`.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeCertificate {
    /// Every finite limit with its peak, in the order of [`Limit`].
    pub peaks: Vec<LimitPeak>,
    /// The intervals in which limits are active, in the order of time; those of different limits
    /// may overlap.
    pub active: Vec<ActiveSpan>,
    /// How long the motion lasts (s).
    pub duration: f64,
    /// No motion along this path within these limits is shorter (s): the fastest without jerk limits
    /// (less an error bar for its grid; with the joints' jerk limits at both ends if the path is
    /// straight in joint space), or that of one joint or of the tool straight from end to end with
    /// them, whichever is longer.
    pub lower_bound: f64,
    /// Largest distance of a joint from the path (rad), at the middle and the quarters of pieces.
    pub fit_error: f64,
    /// Margin added to sampled tool ratios for the times between the samples.
    pub tool_margin: f64,
    /// Factor by which the whole law was slowed down at the end to meet every bound; 1 = not at
    /// all.
    pub stretch: f64,
    /// Time (s) until which the given start state determines the motion; 0 from rest.
    pub given: f64,
    /// Cells of the law.
    pub cells: usize,
    /// Newton steps that were taken.
    pub iterations: usize,
}

impl TimeCertificate {
    /// The largest ratio among the limits that `which` picks; 0 when there is none.
    pub fn ratio(&self, which: impl Fn(Limit) -> bool) -> f64 {
        let picked = self.peaks.iter().filter(|peak| which(peak.limit));
        picked.map(|peak| peak.ratio).fold(0.0, f64::max)
    }

    /// Whether every limit holds for all times; a start state that was given may exceed them by
    /// a millionth, as it may come from rounded numbers.
    pub fn holds(&self) -> bool {
        let allowed = |peak: &LimitPeak| {
            if peak.time < self.given {
                1.0 + 1e-6
            } else {
                1.0
            }
        };
        self.peaks.iter().all(|peak| peak.ratio <= allowed(peak))
    }

    /// Duration over its lower bound, 1 at best.
    pub fn optimality(&self) -> f64 {
        if self.lower_bound > 0.0 {
            self.duration / self.lower_bound
        } else {
            1.0
        }
    }
}
