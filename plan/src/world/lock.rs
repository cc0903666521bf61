//! The lock that makes one process the writer of a world database.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::PlanError;

/// Longest text that is read from a lock file.
const LONGEST: u64 = 256;

/// How often a lock file that vanishes between opening and locking is opened again.
const ATTEMPTS: usize = 100;

/// An exclusive lock on a world database, held until this value is dropped.
///
/// It is an advisory lock of the operating system on a file beside the database (`world.db-lock`),
/// so it ends with the process, however that ends. The file contains the holder of the lock. The
/// lock is not on the database file itself: closing a second handle of that file would release the
/// locks that SQLite holds on it.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    file: File,
}

impl Lock {
    /// Locks the database in `path`, which need not exist yet.
    ///
    /// # Errors
    /// [`PlanError::InUse`] when another process or another writer of this one holds it;
    /// [`PlanError::File`] when the lock file cannot be made or locked.
    pub(super) fn take(path: &Path) -> Result<Self, PlanError> {
        let database = canonical(path)?;
        check_file(&database)?;
        let mut name = database.clone().into_os_string();
        name.push("-lock");
        let path = PathBuf::from(name);
        let failed = |source| PlanError::File {
            path: path.display().to_string(),
            source,
        };
        for _ in 0..ATTEMPTS {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .map_err(failed)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let holder = holder(&mut file);
                    let database = database.display().to_string();
                    return Err(PlanError::InUse { database, holder });
                }
                Err(TryLockError::Error(error)) => return Err(failed(error)),
            }
            // The previous holder may have removed the file after it was opened here.
            if is_at(&file, &path) {
                introduce(&mut file).map_err(failed)?;
                return Ok(Self { path, file });
            }
        }
        let busy = io::Error::other("the lock file is made and removed again and again");
        Err(failed(busy))
    }

    /// Whether the lock file is still in its place: without it a second writer could start.
    pub(super) fn is_in_place(&self) -> bool {
        is_at(&self.file, &self.path)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A left-over file is reused by the next writer.
        if self.is_in_place() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The path of the database without symbolic links; the file itself may be missing.
fn canonical(path: &Path) -> Result<PathBuf, PlanError> {
    let failed = |source| PlanError::File {
        path: path.display().to_string(),
        source,
    };
    match path.canonicalize() {
        Ok(path) => Ok(path),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let name = path.file_name().ok_or_else(|| failed(error))?;
            let folder = path.parent().filter(|folder| *folder != Path::new(""));
            let folder = folder.unwrap_or(Path::new("."));
            Ok(folder.canonicalize().map_err(failed)?.join(name))
        }
        Err(error) => Err(failed(error)),
    }
}

/// A database is a regular file with one name: with two (hard links) it would have two locks and
/// two write-ahead logs.
fn check_file(database: &Path) -> Result<(), PlanError> {
    match fs::metadata(database) {
        Ok(found) if !found.is_file() => Err(PlanError::Stored {
            place: database.display().to_string(),
            what: "expected a regular file, found something else".into(),
        }),
        Ok(found) if found.nlink() > 1 => Err(PlanError::Stored {
            place: database.display().to_string(),
            what: format!(
                "the file has {} names (hard links), so that two runs could write it; copy it",
                found.nlink()
            ),
        }),
        _ => Ok(()),
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let id = |found: fs::Metadata| (found.dev(), found.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(ours), Ok(there)) => id(ours) == id(there),
        _ => false,
    }
}

/// Writes the holder into the lock file: program, subcommand and process id.
fn introduce(file: &mut File) -> io::Result<()> {
    let mut arguments = std::env::args_os();
    let program = arguments.next().map(PathBuf::from).unwrap_or_default();
    let mut text = program
        .file_name()
        .map_or_else(|| "a program".into(), |name| name.to_string_lossy());
    let subcommand = arguments.next().unwrap_or_default();
    let subcommand = subcommand.to_string_lossy();
    let is_word = |c: char| c.is_ascii_lowercase() || c == '-';
    if !subcommand.is_empty() && !subcommand.starts_with('-') && subcommand.chars().all(is_word) {
        text = format!("{text} {subcommand}").into();
    }
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{text}, process {}", std::process::id())
}

/// Who holds the lock, as its file says.
fn holder(file: &mut File) -> String {
    let mut bytes = Vec::new();
    // What cannot be read is as good as empty: the lock is held all the same.
    let _ = file.take(LONGEST).read_to_end(&mut bytes);
    let text = String::from_utf8_lossy(&bytes);
    let line: String = text.lines().next().unwrap_or_default().into();
    let line: String = line.chars().filter(|c| !c.is_control()).collect();
    if line.is_empty() {
        "a process that has not yet said its name".into()
    } else {
        line
    }
}
