//! Whole periods on their way to viewers of other programs.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use recorder::{Head, Sample};

/// How many batches are kept for slow viewers: a second of them.
const KEPT: usize = 64;

/// A batch of periods with what they are about.
pub(crate) type Batch = Arc<(Arc<Head>, Vec<Sample>)>;

/// The last periods, as long as a viewer wants them.
#[derive(Debug, Default)]
pub(crate) struct LivePeriods {
    viewers: AtomicUsize,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    head: Option<Arc<Head>>,
    count: u64,
    batches: VecDeque<Batch>,
}

impl LivePeriods {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Another arm, or the same one after a new start.
    pub(crate) fn set_head(&self, head: Head) {
        self.kept().head = Some(Arc::new(head));
    }

    /// What the periods are about; none before the first engine.
    pub(crate) fn head(&self) -> Option<Arc<Head>> {
        self.kept().head.clone()
    }

    /// Whether anybody wants them: without a viewer they cost nothing.
    pub(crate) fn is_wanted(&self) -> bool {
        self.viewers.load(Ordering::Relaxed) > 0
    }

    /// A viewer comes or goes.
    pub(crate) fn enter(&self) {
        self.viewers.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn leave(&self) {
        self.viewers.fetch_sub(1, Ordering::Relaxed);
    }

    /// Adds periods, oldest first.
    pub(crate) fn push(&self, samples: Vec<Sample>) {
        let Some(first) = samples.first() else { return };
        let mut kept = self.kept();
        let Some(head) = kept.head.clone() else {
            return;
        };
        let head = if head.begin_ns == 0 {
            // The first period is now.
            let since = SystemTime::now().duration_since(UNIX_EPOCH);
            let now = since.map_or(0, |since| since.as_nanos() as u64);
            let head = Arc::new(Head {
                begin_ns: now.saturating_sub(first.tick.saturating_mul(head.period_ns)),
                ..Head::clone(&head)
            });
            kept.head = Some(Arc::clone(&head));
            head
        } else {
            head
        };
        kept.count += 1;
        kept.batches.push_back(Arc::new((head, samples)));
        if kept.batches.len() > KEPT {
            kept.batches.pop_front();
        }
    }

    /// The batches after number `seen`, as far as they are kept, and the number of the last.
    pub(crate) fn after(&self, seen: u64) -> (u64, Vec<Batch>) {
        let kept = self.kept();
        let fresh = kept
            .count
            .saturating_sub(seen)
            .min(kept.batches.len() as u64) as usize;
        let skipped = kept.batches.len() - fresh;
        (
            kept.count,
            kept.batches.iter().skip(skipped).cloned().collect(),
        )
    }
}
