//! Memory of the process.

use std::hint::black_box;

/// Size of the block that tells the allocator how much to keep, bytes. Planning one move needs far less.
const KEPT: usize = 8 << 20;

/// Lets the process keep memory that it has freed, for the next move that it plans; to be called once
/// at its start.
///
/// An allocator that gives the end of its heap back to the system after each move, and asks for it
/// again in the next one, spends a tenth of the planning time on it. That of glibc keeps up to twice
/// the size of the largest block that it has seen freed, so one block is allocated, never touched and
/// freed. Where there is another allocator, nothing is changed.
///
/// ```
/// scheduling::keep_freed_memory();
/// ```
pub fn keep_freed_memory() {
    drop(black_box(Vec::<u8>::with_capacity(KEPT)));
}
