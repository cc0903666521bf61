//! Looks at segments from outside: every one begins with the version of iceoryx2.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::room::segments;
use crate::{Domain, IpcError};

/// The first eight bytes of a segment: version 0.9.3.
const VERSION: u64 = 0x0009_0003;

/// Looks at the first bytes of every segment of `domain`.
///
/// What is damaged behind them is not seen. One without them is in the making, or its maker has
/// died: iceoryx2 deals with both.
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

/// What is wrong with a segment. One that cannot be opened is on its way in or out.
fn fault(path: &Path) -> Option<String> {
    let mut head = [0; 8];
    File::open(path).ok()?.read_exact(&mut head).ok()?;
    let version = u64::from_le_bytes(head);
    (version != VERSION && version != 0)
        .then(|| format!("it begins with {version:#018x}, iceoryx2 0.9.3 with {VERSION:#018x}"))
}
