//! How old a message of a page is.

use std::cell::Cell;
use std::time::Instant;

/// How fast two clocks may drift apart, as a share.
const DRIFT: f64 = 2e-4;

/// How old messages of one page are: by how much later they come than the quickest one did, by the
/// page's own clock. A link that stood still delivers all at once what it held back, and a jog of
/// seconds ago must not move the arm now.
#[derive(Debug)]
pub(crate) struct Freshness {
    begun: Instant,
    /// The least lag that was seen (ms), and when (ms).
    least: Cell<Option<(f64, f64)>>,
}

impl Freshness {
    pub(crate) fn new() -> Self {
        Self {
            begun: Instant::now(),
            least: Cell::new(None),
        }
    }

    /// Age (ms) of a message that was sent at `sent_ms` of the page's clock.
    pub(crate) fn age_ms(&self, sent_ms: f64) -> f64 {
        self.age_at(self.begun.elapsed().as_secs_f64() * 1e3, sent_ms)
    }

    fn age_at(&self, now_ms: f64, sent_ms: f64) -> f64 {
        let lag = now_ms - sent_ms;
        let least = match self.least.get() {
            Some((least, at)) => least + (now_ms - at) * DRIFT,
            None => lag,
        };
        self.least.set(Some((least.min(lag), now_ms)));
        (lag - least).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_held_back_is_old() {
        let freshness = Freshness::new();
        assert_eq!(freshness.age_at(1000.0, 50.0), 0.0);
        assert!(freshness.age_at(1052.0, 100.0) < 3.0);
        // A quicker one shows that the others had waited.
        assert_eq!(freshness.age_at(1090.0, 150.0), 0.0);
        assert!((freshness.age_at(1150.0, 200.0) - 10.0).abs() < 0.1);
        // The link stands still for two seconds; then everything comes at once.
        assert!(freshness.age_at(3200.0, 250.0) > 1900.0);
        assert!(freshness.age_at(3201.0, 300.0) > 1900.0);
        assert!(freshness.age_at(3202.0, 2250.0) < 20.0);
    }

    /// Clocks of two machines drift apart: after hours, messages are as fresh as before.
    #[test]
    fn clocks_that_drift_do_not_age_messages() {
        let freshness = Freshness::new();
        for beat in 0..400_000_u32 {
            let now = f64::from(beat) * 50.0;
            let age = freshness.age_at(now, now * (1.0 - 1e-4));
            assert!(age < 1.0, "{age} ms after {now} ms");
        }
    }
}
