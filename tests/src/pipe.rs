//! A pipe that nobody reads.

use std::io::Write;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::process::Stdio;

/// A pipe that takes nothing: it is full and nobody reads. Its reader, and the end to write to.
///
/// # Panics
/// The operating system gives no pipe.
pub fn full_pipe() -> (OwnedFd, Stdio) {
    let mut ends = [0; 2];
    #[expect(unsafe_code, reason = "the standard library's pipe has no size")]
    // SAFETY: the array has room for two numbers; what comes back is ours alone.
    let (reader, writer) = unsafe {
        assert_eq!(libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC), 0);
        let size = libc::fcntl(ends[1], libc::F_SETPIPE_SZ, 4096);
        assert!(size > 0);
        (OwnedFd::from_raw_fd(ends[0]), OwnedFd::from_raw_fd(ends[1]))
    };
    let mut file = std::fs::File::from(writer);
    #[expect(unsafe_code, reason = "the standard library does not show the flag")]
    // SAFETY: the file is open; the calls take numbers only.
    unsafe {
        let flags = libc::fcntl(file.as_raw_fd(), libc::F_GETFL);
        libc::fcntl(file.as_raw_fd(), libc::F_SETFL, flags | libc::O_NONBLOCK);
        while file.write(&[b'x'; 512]).is_ok() {}
        libc::fcntl(file.as_raw_fd(), libc::F_SETFL, flags);
    }
    (reader, Stdio::from(file))
}
