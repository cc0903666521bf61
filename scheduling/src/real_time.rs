//! Real-time scheduling of a thread with deadlines.

use std::fs::{File, OpenOptions};
use std::io::Write;

/// What a thread with deadlines asks for. All of it is optional: what is refused is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealTimeRequest {
    /// `SCHED_FIFO` priority, 1 to 98; 0 does not ask.
    pub priority: i32,
    /// The processor to stay on.
    pub processor: Option<usize>,
    /// Keep all memory of the process in RAM.
    pub lock_memory: bool,
    /// Keep the processors out of sleep states while the guard exists.
    pub low_latency: bool,
}

impl Default for RealTimeRequest {
    fn default() -> Self {
        Self {
            priority: 60,
            processor: None,
            lock_memory: true,
            low_latency: true,
        }
    }
}

/// What was granted. The processors stay out of sleep states as long as this exists.
#[derive(Debug, Default)]
pub struct Granted {
    /// What was refused, each with the remedy.
    pub refused: Vec<String>,
    _latency: Option<File>,
}

impl Granted {
    /// One warning for the user, or nothing if all was granted.
    pub fn warning(&self) -> Option<String> {
        (!self.refused.is_empty())
            .then(|| format!("deadlines are not guaranteed: {}", self.refused.join("; ")))
    }
}

/// Asks for the calling thread.
pub fn request_real_time(wish: RealTimeRequest) -> Granted {
    let mut granted = Granted::default();
    if wish.lock_memory && !lock_memory() {
        granted
            .refused
            .push("memory is not locked (raise `ulimit -l`)".to_owned());
    }
    if wish.priority > 0 && !set_priority(wish.priority) {
        granted.refused.push(
            "no SCHED_FIFO (set rtprio in /etc/security/limits.d or grant CAP_SYS_NICE)".to_owned(),
        );
    }
    if let Some(processor) = wish.processor
        && !set_processor(processor)
    {
        granted
            .refused
            .push(format!("cannot stay on processor {processor}"));
    }
    if wish.low_latency {
        granted._latency = hold_latency();
        if granted._latency.is_none() {
            granted
                .refused
                .push("processors may sleep (allow writing /dev/cpu_dma_latency)".to_owned());
        }
    }
    granted
}

/// Locks all memory, now and later; not if a limit would make later allocations fail.
#[expect(unsafe_code, reason = "no safe interface in the standard library")]
fn lock_memory() -> bool {
    const ENOUGH: libc::rlim_t = 1 << 30;
    let mut limit = libc::rlimit {
        rlim_cur: 0,
        rlim_max: 0,
    };
    // SAFETY: the pointer is to a live limit; the other calls take numbers only.
    unsafe {
        let known = libc::getrlimit(libc::RLIMIT_MEMLOCK, &raw mut limit) == 0;
        let roomy = known && limit.rlim_cur >= ENOUGH;
        (roomy || libc::geteuid() == 0) && libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) == 0
    }
}

#[expect(unsafe_code, reason = "no safe interface in the standard library")]
fn set_priority(priority: i32) -> bool {
    let wish = libc::sched_param {
        sched_priority: priority,
    };
    // SAFETY: the pointer is to a live parameter; 0 is the calling thread.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const wish) == 0 }
}

#[expect(unsafe_code, reason = "no safe interface in the standard library")]
fn set_processor(processor: usize) -> bool {
    if processor >= libc::CPU_SETSIZE as usize {
        return false;
    }
    // SAFETY: all zeros is an empty set; the index is within it; 0 is the calling thread.
    unsafe {
        let mut set: libc::cpu_set_t = core::mem::zeroed();
        libc::CPU_SET(processor, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) == 0
    }
}

/// The request for low latency holds as long as the file is open.
fn hold_latency() -> Option<File> {
    let mut file = OpenOptions::new()
        .write(true)
        .open("/dev/cpu_dma_latency")
        .ok()?;
    file.write_all(&0_i32.to_ne_bytes()).ok()?;
    Some(file)
}
