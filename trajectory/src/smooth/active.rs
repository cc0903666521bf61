//! Which limit decides the speed when.

use crate::timing::{ActiveSpan, Limit};

/// A limit used to this share is active.
const ACTIVE: f64 = 0.98;

/// Limits in the order of the ratios.
const LIMITS: [Limit; 6] = [
    Limit::ToolSpeed,
    Limit::ToolAcceleration,
    Limit::ToolJerk,
    Limit::AngularSpeed,
    Limit::AngularAcceleration,
    Limit::AngularJerk,
];

/// Collects the stretches over which limits are active.
#[derive(Clone, Debug, Default)]
pub(crate) struct Active {
    spans: Vec<ActiveSpan>,
    /// Start of the stretch in which each limit has been active up to now.
    since: [Option<f64>; 6],
}

impl Active {
    /// Adds a span that starts at `start` (s), with ratios of speed,
    /// acceleration, jerk, linear before angular.
    pub(crate) fn add(&mut self, start: f64, ratios: &[f64; 6]) {
        for (k, ratio) in ratios.iter().enumerate() {
            match (self.since[k], *ratio >= ACTIVE) {
                (None, true) => self.since[k] = Some(start),
                (Some(since), false) => self.close(k, since, start),
                _ => {}
            }
        }
    }

    fn close(&mut self, k: usize, start: f64, end: f64) {
        let limit = LIMITS[k];
        self.spans.push(ActiveSpan { limit, start, end });
        self.since[k] = None;
    }

    /// All stretches in the order of time; the motion ends at `end` (s).
    pub(crate) fn finish(mut self, end: f64) -> Vec<ActiveSpan> {
        for k in 0..LIMITS.len() {
            if let Some(since) = self.since[k] {
                self.close(k, since, end);
            }
        }
        self.spans.sort_by(|a, b| a.start.total_cmp(&b.start));
        self.spans
    }
}
