//! Checks segments from outside: each begins with the version of iceoryx2.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::Duration;

use crate::room::segments;
use crate::{Domain, IpcError};

/// The first eight bytes of a segment: version 0.9.3.
const VERSION: u64 = 0x0009_0003;

/// Age below which a segment without its first bytes counts as being made.
const MAKING: Duration = Duration::from_secs(1);

/// Checks the first bytes of every segment of `domain`. Damage after them is not detected.
///
/// # Errors
/// [`IpcError::Damaged`] names the first that iceoryx2 0.9.3 has not made.
pub(crate) fn look(domain: &Domain) -> Result<(), IpcError> {
    for path in segments(domain) {
        if let Some(cause) = fault(&path) {
            return Err(IpcError::Damaged {
                directory: domain.directory().to_owned(),
                segment: path.display().to_string(),
                cause,
            });
        }
    }
    Ok(())
}

/// What is wrong with a segment. One that cannot be opened is being made or removed.
fn fault(path: &Path) -> Option<String> {
    let mut file = File::open(path).ok()?;
    let found = file.metadata().ok()?;
    let mut head = [0; 8];
    let version = match file.read_exact(&mut head) {
        Ok(()) => u64::from_le_bytes(head),
        Err(_) => 0,
    };
    // A time in the future counts as young.
    let age = found.modified().ok()?.elapsed().unwrap_or_default();
    if version == VERSION || (version == 0 && age < MAKING) {
        return None;
    }
    Some(format!(
        "it has {} bytes and begins with {version:#018x}, iceoryx2 0.9.3 with {VERSION:#018x}",
        found.len()
    ))
}
