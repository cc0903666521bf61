//! Who has the hand: one page at a time.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Who has the hand. Pages are numbered from 1.
#[derive(Debug, Default)]
pub(crate) struct HandPost {
    holder: Mutex<Option<u64>>,
}

impl HandPost {
    fn holder(&self) -> MutexGuard<'_, Option<u64>> {
        self.holder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives the hand to a page, unless another has it.
    pub(crate) fn take(&self, page: u64) -> bool {
        let mut holder = self.holder();
        let free = holder.is_none_or(|holder| holder == page);
        if free {
            *holder = Some(page);
        }
        free
    }

    /// Whether the page has the hand.
    pub(crate) fn has(&self, page: u64) -> bool {
        *self.holder() == Some(page)
    }

    /// Takes the hand from a page; says whether it had it.
    pub(crate) fn release(&self, page: u64) -> bool {
        let mut holder = self.holder();
        let had = *holder == Some(page);
        if had {
            *holder = None;
        }
        had
    }

    /// The page that has the hand; 0 for none.
    pub(crate) fn page(&self) -> u64 {
        self.holder().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_page_has_the_hand() {
        let post = HandPost::default();
        assert!(post.take(1) && post.take(1) && post.has(1));
        assert!(!post.take(2) && !post.has(2) && !post.release(2));
        assert_eq!(post.page(), 1);
        assert!(post.release(1) && !post.release(1));
        assert!(post.take(2) && !post.has(1));
    }
}
