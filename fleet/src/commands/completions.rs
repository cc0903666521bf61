use std::io::{self, Write};

use clap_complete::Shell;

use crate::failure::Failure;

/// Print the completion script of a shell
///
/// For bash: `canter-fleet completions bash > ~/.local/share/bash-completion/completions/canter-fleet`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the script of a command line.
    pub(crate) fn run(&self, mut command: clap::Command) -> Result<(), Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "canter-fleet", &mut script);
        Failure::of_output(io::stdout().lock().write_all(&script))
    }
}
