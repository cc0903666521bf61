//! The clock that times in messages use, and sleeping until a time of it.

/// The time of `CLOCK_MONOTONIC` (ns). All times in messages use this clock. It never jumps.
#[inline]
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

/// The processor time that the calling thread has used (ns): what other threads do does not change
/// it.
pub fn thread_time_ns() -> u64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the pointer is to a live timespec; the clock exists on every Linux.
    #[expect(
        unsafe_code,
        reason = "the standard library does not show processor time"
    )]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time);
    }
    time.tv_sec.cast_unsigned() * 1_000_000_000 + time.tv_nsec.cast_unsigned()
}

/// Sleeps until `deadline_ns` of `CLOCK_MONOTONIC`; returns at once if it has passed. A signal
/// does not end the sleep.
#[inline]
pub fn sleep_until_ns(deadline_ns: u64) {
    let deadline = libc::timespec {
        tv_sec: (deadline_ns / 1_000_000_000).cast_signed(),
        tv_nsec: (deadline_ns % 1_000_000_000).cast_signed(),
    };
    loop {
        // SAFETY: the pointer is to a live timespec, and the remaining time is not asked for.
        #[expect(
            unsafe_code,
            reason = "the standard library cannot sleep until an instant"
        )]
        let result = unsafe {
            libc::clock_nanosleep(
                libc::CLOCK_MONOTONIC,
                libc::TIMER_ABSTIME,
                &raw const deadline,
                core::ptr::null_mut(),
            )
        };
        if result != libc::EINTR {
            return;
        }
    }
}
