//! Memory of the planner.

use std::hint::black_box;
use std::sync::Once;

/// What planning a move needs at once is far less than this, bytes.
const KEPT: usize = 8 << 20;

/// Lets the process keep memory that planning has freed, for the next move.
///
/// An allocator that gives the end of its heap back to the system after each move, and asks for it
/// again in the next one, spends a tenth of the planning time on it. That of glibc keeps up to twice
/// the size of the largest block that it has seen freed; where there is another allocator, nothing is
/// changed.
pub(super) fn keep() {
    static DONE: Once = Once::new();
    DONE.call_once(|| drop(black_box(Vec::<u8>::with_capacity(KEPT))));
}
