//! The name of an arm in a cell.

use core::fmt;

use crate::IpcError;

/// The name of an arm: `cell/arm`, both of lower or upper case letters, digits, `-` and `_`.
/// Engine and driver find each other by it.
///
/// ```
/// let arm: ipc::Arm = "kitting/left".parse()?;
/// assert_eq!(arm.to_string(), "kitting/left");
/// assert!("no spaces/please".parse::<ipc::Arm>().is_err());
/// # Ok::<(), ipc::IpcError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Arm(String);

impl Arm {
    /// The name of one of the arm's services, such as `kitting/left/setpoint`.
    pub(crate) fn service(&self, kind: &str) -> String {
        format!("{}/{kind}", self.0)
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl core::str::FromStr for Arm {
    type Err = IpcError;

    fn from_str(text: &str) -> Result<Self, IpcError> {
        let word = |part: &str| {
            !part.is_empty()
                && part.len() <= 60
                && part
                    .chars()
                    .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
        };
        match text.split_once('/') {
            Some((cell, arm)) if word(cell) && word(arm) => Ok(Self(text.to_owned())),
            _ => Err(IpcError::BadArmName {
                name: text.chars().take(80).collect(),
            }),
        }
    }
}

/// A checksum of a robot model, for instance of the text of its URDF; the handshake compares it.
///
/// # Source
/// Fowler, Noll, Vo, hash FNV-1a, 64 bit.
pub fn model_hash(text: &[u8]) -> u64 {
    text.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
