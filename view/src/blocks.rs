//! Blocks of periods on their way to the pages.
//!
//! Every period goes to every page, a few hundred bytes each: what is decimated is the number of
//! messages, not of samples. A page that is too slow loses whole blocks, which it sees by the ticks.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How many blocks are kept for slow pages: ten seconds of them, one or two megabytes.
const KEPT: usize = 640;

/// The first bytes of a block.
const MAGIC: &[u8; 4] = b"CNTR";

/// Length of the head of a block (bytes).
const HEAD: usize = 32;

/// One servo period for the pages.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Row {
    pub(crate) tick: u64,
    /// Counts the rows that there are: where it jumps, some did not get here.
    pub(crate) sequence: u64,
    pub(crate) command: u32,
    pub(crate) path_time: f64,
    pub(crate) time_scaling: f64,
    /// How late the setpoint was published after the beginning of its period (us).
    pub(crate) late_us: f64,
    /// Published positions, velocities, accelerations and measured positions.
    pub(crate) joints: [Vec<f64>; 4],
    /// The controlled point in the workstation (m).
    pub(crate) point: [f64; 3],
}

/// Numbers of a row beside those of the joints: command, path time, rate, lateness, point.
const FIXED: usize = 7;

/// Collects rows into blocks.
#[derive(Debug)]
pub(crate) struct Packer {
    joints: usize,
    period_ns: u64,
    first: u64,
    sequence: u64,
    count: u32,
    bytes: Vec<u8>,
}

impl Packer {
    pub(crate) fn new(joints: usize, period_ns: u64) -> Self {
        Self {
            joints,
            period_ns,
            first: 0,
            sequence: 0,
            count: 0,
            bytes: Vec::new(),
        }
    }

    /// Takes a row. Ticks of a block follow each other, and so do the sequence numbers: a gap ends
    /// it, and it is given back.
    pub(crate) fn push(&mut self, row: &Row) -> Option<Vec<u8>> {
        let next = u64::from(self.count);
        let follows =
            self.count > 0 && row.tick == self.first + next && row.sequence == self.sequence + next;
        let full = if follows { None } else { self.take() };
        if self.count == 0 {
            self.first = row.tick;
            self.sequence = row.sequence;
            self.bytes = vec![0; HEAD];
        }
        self.count += 1;
        let fixed = [
            f64::from(row.command),
            row.path_time,
            row.time_scaling,
            row.late_us,
        ];
        let numbers = fixed.iter().chain(&row.point);
        for number in numbers.chain(
            row.joints
                .iter()
                .flat_map(|list| list.iter().take(self.joints)),
        ) {
            self.bytes
                .extend_from_slice(&(*number as f32).to_le_bytes());
        }
        full
    }

    /// What was collected.
    pub(crate) fn take(&mut self) -> Option<Vec<u8>> {
        if self.count == 0 {
            return None;
        }
        let mut head = Vec::with_capacity(HEAD);
        head.extend_from_slice(MAGIC);
        head.extend_from_slice(&(self.joints as u16).to_le_bytes());
        head.extend_from_slice(&((FIXED + 4 * self.joints) as u16).to_le_bytes());
        head.extend_from_slice(&self.count.to_le_bytes());
        head.extend_from_slice(&(self.period_ns as u32).to_le_bytes());
        head.extend_from_slice(&self.first.to_le_bytes());
        head.extend_from_slice(&self.sequence.to_le_bytes());
        let mut bytes = std::mem::take(&mut self.bytes);
        if let Some(place) = bytes.get_mut(..HEAD) {
            place.copy_from_slice(&head);
        }
        self.count = 0;
        Some(bytes)
    }
}

/// The last blocks, for every page.
#[derive(Debug, Default)]
pub(crate) struct Blocks {
    kept: Mutex<(u64, VecDeque<Arc<Vec<u8>>>)>,
}

impl Blocks {
    fn kept(&self) -> MutexGuard<'_, (u64, VecDeque<Arc<Vec<u8>>>)> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a block.
    pub(crate) fn push(&self, block: Vec<u8>) {
        let mut kept = self.kept();
        kept.0 += 1;
        kept.1.push_back(Arc::new(block));
        if kept.1.len() > KEPT {
            kept.1.pop_front();
        }
    }

    /// How many there were.
    pub(crate) fn count(&self) -> u64 {
        self.kept().0
    }

    /// The blocks after number `seen`, as far as they are kept, and the number of the last.
    pub(crate) fn after(&self, seen: u64) -> (u64, Vec<Arc<Vec<u8>>>) {
        let kept = self.kept();
        let fresh = kept.0.saturating_sub(seen).min(kept.1.len() as u64) as usize;
        let blocks = kept.1.iter().skip(kept.1.len() - fresh).cloned().collect();
        (kept.0, blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tick: u64) -> Row {
        Row {
            tick,
            sequence: tick.min(9),
            command: 3,
            joints: std::array::from_fn(|list| vec![list as f64, 0.5]),
            ..Row::default()
        }
    }

    #[test]
    fn rows_become_blocks_and_gaps_end_them() {
        let mut packer = Packer::new(2, 1_000_000);
        assert_eq!(packer.push(&row(7)), None);
        assert_eq!(packer.push(&row(8)), None);
        let block = packer.push(&row(11)).unwrap();
        let width = (FIXED + 8) * 4;
        assert_eq!(block.len(), HEAD + 2 * width);
        assert_eq!(&block[..4], MAGIC);
        assert_eq!(block[4..8], [2, 0, 15, 0]);
        assert_eq!(block[8..12], [2, 0, 0, 0]);
        assert_eq!(block[16..24], 7_u64.to_le_bytes());
        assert_eq!(block[24..32], 7_u64.to_le_bytes());
        assert_eq!(block[HEAD..HEAD + 4], 3.0_f32.to_le_bytes());
        assert_eq!(
            block[HEAD + width + 4 * FIXED + 16..][..4],
            2.0_f32.to_le_bytes()
        );
        // A period that was skipped: no row is missing.
        let late = packer.take().unwrap();
        assert_eq!(late[16..24], 11_u64.to_le_bytes());
        assert_eq!(late[24..32], 9_u64.to_le_bytes());
        assert_eq!(packer.take(), None);
    }

    #[test]
    fn a_slow_page_loses_the_oldest() {
        let blocks = Blocks::default();
        for number in 0..700_u32 {
            blocks.push(number.to_le_bytes().to_vec());
        }
        let first = |blocks: &[Arc<Vec<u8>>]| blocks[0].as_slice().to_vec();
        let (seen, fresh) = blocks.after(698);
        assert_eq!((seen, fresh.len()), (700, 2));
        assert_eq!(first(&fresh), 698_u32.to_le_bytes());
        let (_, late) = blocks.after(3);
        assert_eq!(late.len(), KEPT);
        assert_eq!(first(&late), 60_u32.to_le_bytes());
        assert!(blocks.after(700).1.is_empty());
    }
}
