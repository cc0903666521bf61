//! Zenoh in one thread (decision 0146).

use std::os::unix::process::CommandExt;
use std::process::Command;

use crate::failure::Failure;

/// The variable by which zenoh is told its threads; it has no other way.
const VARIABLE: &str = "ZENOH_RUNTIME";

/// Everything of zenoh in the thread that sends.
const ONE: &str =
    "(rx: (handover: tx), net: (handover: tx), acc: (handover: tx), app: (handover: tx))";

/// Sees to it that zenoh reads and writes a link in one thread: starts this program again with the
/// setting, under the same process number, unless there is one.
///
/// # Errors
/// The program cannot be started again.
pub(crate) fn ensure() -> Result<(), Failure> {
    if std::env::var_os(VARIABLE).is_some() {
        return Ok(());
    }
    let mut arguments = std::env::args_os();
    let own_name = arguments.next().unwrap_or_default();
    // By its own name where it still has one: the system shows it.
    let own = std::env::current_exe().ok().filter(|path| path.is_file());
    let own = own.unwrap_or_else(|| "/proc/self/exe".into());
    let cause = Command::new(&own)
        .arg0(own_name)
        .args(arguments)
        .env(VARIABLE, ONE)
        .exec();
    Err(Failure::Unreadable(format!(
        "{} cannot be started with {VARIABLE}: {cause}",
        own.display()
    )))
}
