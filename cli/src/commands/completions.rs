use std::io::{self, Write};

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::exit::Exit;
use crate::failure::Failure;

/// Print the completion script of a shell
///
/// For bash: `canter completions bash > ~/.local/share/bash-completion/completions/canter`.
#[derive(Args, Debug)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the script.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let mut script = Vec::new();
        clap_complete::generate(
            self.shell,
            &mut crate::Arguments::command(),
            "canter",
            &mut script,
        );
        io::stdout().write_all(&script)?;
        Ok(Exit::Done)
    }
}
