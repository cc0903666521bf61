//! The clock of the messages.

/// The time of `CLOCK_MONOTONIC` (ns): the clock of every time in a message. It never jumps.
pub fn now_ns() -> u64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the pointer is to a live timespec; the clock exists on every Linux.
    #[expect(
        unsafe_code,
        reason = "the standard library does not show this clock as a number"
    )]
    unsafe {
        libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time);
    }
    time.tv_sec.cast_unsigned() * 1_000_000_000 + time.tv_nsec.cast_unsigned()
}
