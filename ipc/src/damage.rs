//! Looks at segments from outside: every one begins with the version of iceoryx2.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crate::room::segments;
use crate::{Domain, IpcError};

/// The first eight bytes of a segment: version 0.9.3.
const VERSION: u64 = 0x0009_0003;

/// How often a segment is looked at that may be in the making, and how long in between.
const LOOKS: u32 = 50;
const BETWEEN: Duration = Duration::from_millis(2);

/// Looks at the size and the first bytes of every segment of `domain`.
///
/// A truncated segment would end whoever reads it with SIGBUS, one of another kind with anything.
/// What is damaged behind its first bytes is not seen.
///
/// # Errors
/// [`IpcError::Damaged`] names the first that iceoryx2 0.9.3 has not made.
pub(crate) fn look(domain: &Domain) -> Result<(), IpcError> {
    for path in segments(domain) {
        let mut found = fault(&path);
        // It has neither size nor version for a moment when it is made.
        for _ in 0..LOOKS {
            if found.is_none() {
                break;
            }
            sleep(BETWEEN);
            found = fault(&path);
        }
        if let Some(cause) = found {
            return Err(IpcError::Damaged {
                directory: domain.directory().to_owned(),
                segment: path.display().to_string(),
                cause,
            });
        }
    }
    Ok(())
}

/// What is wrong with a segment. One that cannot be opened is on its way in or out.
fn fault(path: &Path) -> Option<String> {
    let mut file = File::open(path).ok()?;
    let mut head = [0; 8];
    if file.read_exact(&mut head).is_err() {
        let size = file.metadata().map_or(0, |found| found.len());
        return Some(format!("it has {size} bytes"));
    }
    let version = u64::from_le_bytes(head);
    (version != VERSION)
        .then(|| format!("it begins with {version:#018x}, iceoryx2 0.9.3 with {VERSION:#018x}"))
}
