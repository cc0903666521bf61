//! An output file whose errors contain its name.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::exit::Exit;
use crate::failure::{Failure, Unwritable};

/// A buffered file; every error of it names it.
#[derive(Debug)]
pub(crate) struct OutputFile {
    path: PathBuf,
    out: BufWriter<File>,
}

impl OutputFile {
    /// Creates the file, or empties one that is there.
    ///
    /// # Errors
    /// [`Exit::Unreadable`], with the name of the file.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let path = path.to_owned();
        match File::create(&path) {
            Ok(file) => Ok(Self {
                path,
                out: BufWriter::new(file),
            }),
            Err(error) => Err(Failure::new(Exit::Unreadable, named(&path, &error))),
        }
    }
}

/// The same kind of error with the name of the file.
fn named(path: &Path, error: &io::Error) -> io::Error {
    let message = format!("cannot write {}: {error}", path.display());
    io::Error::new(error.kind(), Unwritable(message))
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let path = &self.path;
        self.out.write(bytes).map_err(|error| named(path, &error))
    }

    fn flush(&mut self) -> io::Result<()> {
        let path = &self.path;
        self.out.flush().map_err(|error| named(path, &error))
    }
}
