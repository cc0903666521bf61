//! A map that keeps the most recently used entries.

use std::collections::HashMap;
use std::hash::Hash;

/// Keeps at least the last `room` entries that were used, and at most twice as many.
#[derive(Debug)]
pub(crate) struct Recent<K, V> {
    room: usize,
    new: HashMap<K, V>,
    old: HashMap<K, V>,
}

impl<K: Hash + Eq, V> Recent<K, V> {
    /// An empty map.
    pub(crate) fn new(room: usize) -> Self {
        let (new, old) = (HashMap::new(), HashMap::new());
        Self { room, new, old }
    }

    /// The value of a key, which now counts as used.
    pub(crate) fn get(&mut self, key: &K) -> Option<&V> {
        if let Some((key, value)) = self.old.remove_entry(key) {
            self.insert(key, value);
        }
        self.new.get(key)
    }

    /// Remembers a value.
    pub(crate) fn insert(&mut self, key: K, value: V) {
        if self.new.len() >= self.room {
            self.old = std::mem::take(&mut self.new);
        }
        self.old.remove(&key);
        self.new.insert(key, value);
    }
}

#[cfg(test)]
mod tests {
    use super::Recent;

    #[test]
    fn what_was_used_lately_is_remembered() {
        let mut recent = Recent::new(10);
        for number in 0..1000 {
            recent.insert(number, number);
            assert_eq!(recent.get(&0), Some(&0));
            assert!(recent.new.len() + recent.old.len() <= 20);
            for before in (0..=number).rev().take(9) {
                assert_eq!(recent.get(&before), Some(&before));
            }
        }
        assert_eq!(recent.get(&500), None);
    }
}
