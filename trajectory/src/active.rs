//! Which limit is active at which time.

use crate::limit::{ActiveSpan, Limit};

/// Collects the intervals of time in which limits are used to a given fraction or more.
#[derive(Clone, Debug)]
pub(crate) struct Active {
    limits: Vec<Limit>,
    /// From which ratio on each limit is active.
    shares: Vec<f64>,
    spans: Vec<ActiveSpan>,
    /// Start of the interval in which each limit has been active until now.
    since: Vec<Option<f64>>,
}

impl Active {
    /// No intervals yet; each of `limits` is active from the ratio `share` on.
    pub(crate) fn new(limits: Vec<Limit>, share: f64) -> Self {
        let shares = vec![share; limits.len()];
        Self::with(limits, shares)
    }

    /// The same with a share for each limit.
    pub(crate) fn with(limits: Vec<Limit>, shares: Vec<f64>) -> Self {
        Self {
            since: vec![None; limits.len()],
            spans: Vec::new(),
            limits,
            shares,
        }
    }

    /// Adds an interval that starts at `start` (s), with the ratio of each limit.
    pub(crate) fn add(&mut self, start: f64, ratios: &[f64]) {
        for (k, ratio) in ratios.iter().enumerate() {
            match (self.since[k], *ratio >= self.shares[k]) {
                (None, true) => self.since[k] = Some(start),
                (Some(since), false) => self.close(k, since, start),
                _ => {}
            }
        }
    }

    fn close(&mut self, k: usize, start: f64, end: f64) {
        let limit = self.limits[k];
        self.spans.push(ActiveSpan { limit, start, end });
        self.since[k] = None;
    }

    /// All intervals in the order of time; the motion ends at `end` (s).
    pub(crate) fn finish(mut self, end: f64) -> Vec<ActiveSpan> {
        for k in 0..self.limits.len() {
            if let Some(since) = self.since[k] {
                self.close(k, since, end);
            }
        }
        let later = |a: &ActiveSpan, b: &ActiveSpan| a.start.total_cmp(&b.start);
        self.spans
            .sort_by(|a, b| later(a, b).then(a.limit.cmp(&b.limit)));
        self.spans
    }
}
