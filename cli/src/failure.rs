use std::io;

use ipc::IpcError;

use crate::exit::Exit;
use crate::printer::Printer;

/// Why a command failed: the exit code and the chain of causes.
#[derive(Debug)]
pub(crate) struct Failure {
    exit: Exit,
    cause: anyhow::Error,
}

impl Failure {
    /// A failure that ends the process with `exit`.
    pub(crate) fn new(exit: Exit, cause: impl Into<anyhow::Error>) -> Self {
        Self {
            exit,
            cause: cause.into(),
        }
    }

    /// Writes `canter: error: cause: cause of the cause` to standard error and gives the exit code.
    ///
    /// A closed standard output (`canter robots list | head -1`) is not a failure.
    pub(crate) fn report(&self, printer: &Printer) -> Exit {
        if let Some(error) = self.cause.downcast_ref::<io::Error>()
            && error.kind() == io::ErrorKind::BrokenPipe
        {
            return Exit::Done;
        }
        printer.note(&format!("canter: error: {}", chain(&self.cause)));
        self.exit
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&chain(&self.cause))
    }
}

/// The causes from the outermost to the innermost; one that already says what its own cause says
/// is not followed by it.
fn chain(cause: &anyhow::Error) -> String {
    let mut text = String::new();
    for link in cause.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = link;
        } else if !text.contains(&link) {
            text = format!("{text}: {link}");
        }
    }
    text
}

/// Writing the result or a file failed; every other failure has its own exit code.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        let named = error
            .get_ref()
            .is_some_and(|cause| cause.is::<Unwritable>());
        let exit = if named || error.kind() == io::ErrorKind::StorageFull {
            Exit::Unreadable
        } else {
            Exit::Internal
        };
        Self::new(exit, error)
    }
}

/// The border to other processes.
impl From<IpcError> for Failure {
    fn from(error: IpcError) -> Self {
        let exit = match error {
            IpcError::BadArmName { .. } => Exit::Usage,
            _ => Exit::NoPeer,
        };
        Self::new(exit, error)
    }
}

/// A named file that cannot be written: not an internal error.
#[derive(Debug)]
pub(crate) struct Unwritable(pub(crate) String);

impl std::fmt::Display for Unwritable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unwritable {}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    #[test]
    fn no_cause_is_said_twice() {
        let cause = anyhow!("no such file")
            .context("cannot read a: no such file")
            .context("robot");
        assert_eq!(super::chain(&cause), "robot: cannot read a: no such file");
    }
}
