use std::io;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, CommandFactory};
use clap_mangen::Man as Page;

use crate::exit::Exit;
use crate::failure::Failure;

/// Print the manual page, or write the pages of all commands to a folder
///
/// To read it at once: `canter man | man -l -`.
#[derive(Args, Debug)]
pub(crate) struct Man {
    /// Folder for one page per command (canter.1, canter-run.1, ...), made if it is missing
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

impl Man {
    /// Prints the main page or writes them all.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let command = crate::Arguments::command();
        match &self.folder {
            None => Page::new(command).render(&mut io::stdout())?,
            Some(folder) => std::fs::create_dir_all(folder)
                .and_then(|()| clap_mangen::generate_to(command, folder))
                .with_context(|| format!("cannot write manual pages to {}", folder.display()))
                .map_err(|cause| Failure::new(Exit::Unreadable, cause))?,
        }
        Ok(Exit::Done)
    }
}
