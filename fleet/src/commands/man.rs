use std::io;
use std::path::PathBuf;

use clap_mangen::Man as Page;

use crate::failure::Failure;

/// Print the manual page, or write the pages of all commands to a folder
///
/// To read it at once: `canter-fleet man | man -l -`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Man {
    /// Folder for one page per command (canter-fleet.1, canter-fleet-cell.1, ...), made if it is missing
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

impl Man {
    /// Prints the main page of a command line or writes them all.
    pub(crate) fn run(&self, command: clap::Command) -> Result<(), Failure> {
        let Some(folder) = &self.folder else {
            return Failure::of_output(Page::new(command).render(&mut io::stdout().lock()));
        };
        std::fs::create_dir_all(folder)
            .and_then(|()| clap_mangen::generate_to(command, folder))
            .map_err(|cause| Failure::Unreadable(format!("{}: {cause}", folder.display())))
    }
}
