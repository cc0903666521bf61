//! Signals to processes that a test has started.

use std::process::Child;

/// Sends `signal` to a child that was not waited for.
///
/// # Panics
/// The operating system refuses: a mistake of the test.
pub fn send(child: &Child, signal: i32) {
    #[expect(unsafe_code, reason = "the standard library can only kill")]
    // SAFETY: the process is our child and was not waited for, so its number is its own.
    let result = unsafe { libc::kill(child.id().cast_signed(), signal) };
    assert_eq!(result, 0, "signal {signal} cannot be sent");
}
