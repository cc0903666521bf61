//! Repairs a domain with damaged segments from outside: it deletes files, and does not read their
//! content.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::room::segments;
use crate::{Domain, IpcError};

/// A running process that uses a domain's segments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inhabitant {
    /// Its number.
    pub process: u32,
    /// Its command line, cut.
    pub command: String,
}

/// The other processes that have a segment of `domain` in their memory. It asks the kernel and does
/// not read the segments; it does not see processes of other users and other containers.
pub fn inhabitants_of(domain: &Domain) -> Vec<Inhabitant> {
    let ours = std::process::id();
    let listed = fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = listed.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let living = numbers.filter(|number| *number != ours && uses(*number, domain));
    let mut found: Vec<_> = living.map(inhabitant).collect();
    found.sort_by_key(|inhabitant| inhabitant.process);
    found
}

fn uses(process: u32, domain: &Domain) -> bool {
    // A process that ended meanwhile, or that this user may not inspect, uses no segment of this
    // user.
    let maps = fs::read(format!("/proc/{process}/maps")).unwrap_or_default();
    let wanted = format!("/dev/shm/{}", domain.prefix());
    maps.windows(wanted.len())
        .any(|found| found == wanted.as_bytes())
}

fn inhabitant(process: u32) -> Inhabitant {
    let words = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    let text = String::from_utf8_lossy(&words).replace('\0', " ");
    Inhabitant {
        process,
        command: text.trim_end().chars().take(80).collect(),
    }
}

/// Removes everything in `domain`; returns the number of segments and files.
///
/// # Errors
/// [`IpcError::InUse`] while a running process uses a segment; then nothing is removed;
/// [`IpcError::Domain`] when something cannot be removed.
pub fn repair(domain: &Domain) -> Result<usize, IpcError> {
    let living = inhabitants_of(domain);
    if !living.is_empty() {
        let names = living
            .iter()
            .map(|found| format!("process {} ({})", found.process, found.command));
        return Err(IpcError::InUse {
            directory: domain.directory().to_owned(),
            processes: names.collect::<Vec<_>>().join(", "),
        });
    }
    let fail = |cause: io::Error| IpcError::Domain {
        directory: domain.directory().to_owned(),
        cause: format!("cannot be emptied: {cause}"),
        remedy: "look at who owns its files".to_owned(),
    };
    let mut removed = 0;
    // The lists first: a process that starts now makes new segments instead of opening those that
    // are being removed.
    for name in ["nodes", "services", "requests"] {
        removed += empty(&domain.directory().join(name)).map_err(fail)?;
    }
    for path in segments(domain) {
        let own = fs::symlink_metadata(&path)
            .and_then(|found| Ok(found.uid() == fs::metadata(domain.directory())?.uid()));
        if own.unwrap_or(false) {
            fs::remove_file(&path).map_err(fail)?;
            removed += 1;
        }
    }
    Ok(removed)
}

/// Removes a folder of the domain; returns the number of its files. A missing folder counts as
/// empty.
fn empty(folder: &Path) -> io::Result<usize> {
    let mut count = 0;
    let listed = match fs::read_dir(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(0),
        listed => listed?,
    };
    for entry in listed {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            count += empty(&entry.path())?;
        } else {
            fs::remove_file(entry.path())?;
            count += 1;
        }
    }
    fs::remove_dir(folder)?;
    Ok(count)
}
