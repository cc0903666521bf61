//! Free space in shared memory: checked before it is used, and reserved.
//!
//! A segment in `/dev/shm` has a size, but no memory until a process writes to it. If the file
//! system is full then, the writer is killed with SIGBUS. So the free space is checked before
//! segments are made, and each segment gets its memory before it is used.

use std::fs::{self, OpenOptions};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

use rustix::fs::{FallocateFlags, fallocate, statvfs};
use rustix::io::Errno;

use crate::{Domain, IpcError};

/// Where the segments are.
const PLACE: &str = "/dev/shm";

/// Space that must be free before a process makes segments (bytes): the answers of one engine take
/// 6.2 MiB, everything else of engine, driver and clients is small in comparison.
pub const ROOM_NEEDED: u64 = 16 << 20;

/// Free space in `/dev/shm` (bytes); `None` if it has no limit or the limit cannot be read.
pub fn room_left() -> Option<u64> {
    let found = statvfs(PLACE).ok()?;
    (found.f_blocks > 0).then(|| found.f_bavail.saturating_mul(found.f_frsize))
}

/// Checks that there is space for the segments of a process.
///
/// # Errors
/// [`IpcError::NoRoom`] with the space that is needed and the space that is free.
pub(crate) fn look() -> Result<(), IpcError> {
    match room_left() {
        Some(found) if found < ROOM_NEEDED => Err(IpcError::NoRoom {
            place: PLACE,
            needed: ROOM_NEEDED,
            found,
        }),
        _ => Ok(()),
    }
}

/// The segments of a domain.
pub(crate) fn segments(domain: &Domain) -> Vec<PathBuf> {
    let listed = fs::read_dir(PLACE).into_iter().flatten().flatten();
    let ours = listed.filter(|entry| {
        let name = entry.file_name();
        name.as_encoded_bytes()
            .starts_with(domain.prefix().as_bytes())
    });
    ours.map(|entry| entry.path()).collect()
}

/// Gives every segment of a domain the memory of its whole size, so that no write meets a full
/// file system. Call it when ports were opened.
///
/// # Errors
/// [`IpcError::NoRoom`] when there is too little.
pub(crate) fn reserve(domain: &Domain) -> Result<(), IpcError> {
    for path in segments(domain) {
        // A segment that is gone, or already closed to writing, needs no memory.
        let Ok(file) = OpenOptions::new().read(true).write(true).open(&path) else {
            continue;
        };
        let size = file.metadata().map_or(0, |found| found.size());
        if size > 0 && fallocate(&file, FallocateFlags::empty(), 0, size) == Err(Errno::NOSPC) {
            return Err(IpcError::NoRoom {
                place: PLACE,
                needed: size,
                found: room_left().unwrap_or(0),
            });
        }
    }
    Ok(())
}
