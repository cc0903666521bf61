use std::process::ExitCode;

/// How a command of `canter` ends, as its process exit code.
///
/// Scripts rely on the numbers: their meaning never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Exit {
    /// Everything asked for was done.
    Done = 0,
    /// The program has findings, or a command of it was refused before any motion.
    Refused = 1,
    /// The arguments are wrong.
    Usage = 2,
    /// A file cannot be read, parsed or written, or a robot cannot be loaded.
    Unreadable = 3,
    /// No engine or no driver answers.
    NoPeer = 4,
    /// The operator stopped the motion.
    Stopped = 5,
    /// A limit or guard of the engine aborted the motion.
    Aborted = 6,
    /// The driver reported a fault or was lost.
    DriverFault = 7,
    /// Everything asked for was done, but lines of standard output could not be written.
    OutputLost = 8,
    /// A mistake of Canter itself.
    Internal = 70,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}
