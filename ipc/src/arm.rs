//! The name of an arm in a cell.

use core::fmt;

use crate::{Domain, IpcError};

/// An arm of a [`Domain`]; its name is `cell/arm`, both of lower or upper case letters, digits,
/// `-` and `_`. Engine and driver find each other by it. [`Domain::arm`] makes one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Arm {
    name: String,
    domain: Domain,
}

impl Domain {
    /// The arm called `name`, `cell/arm`, in this domain.
    ///
    /// # Errors
    /// [`IpcError::BadArmName`] when the name is not of that form.
    pub fn arm(&self, name: &str) -> Result<Arm, IpcError> {
        Arm::new(name, self.clone())
    }
}

impl Arm {
    /// The name of one of the arm's services, such as `kitting/left/setpoint`.
    pub(crate) fn service(&self, kind: &str) -> String {
        format!("{}/{kind}", self.name)
    }

    /// Where the arm is found.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    fn new(name: &str, domain: Domain) -> Result<Self, IpcError> {
        let word = |part: &str| {
            !part.is_empty()
                && part.len() <= 60
                && part
                    .chars()
                    .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
        };
        match name.split_once('/') {
            Some((cell, arm)) if word(cell) && word(arm) => Ok(Self {
                name: name.to_owned(),
                domain,
            }),
            _ => Err(IpcError::BadArmName {
                name: name.chars().take(80).collect(),
            }),
        }
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// A checksum of a robot model, for example of the text of its URDF; the handshake compares it.
///
/// # Source
/// Fowler, Noll, Vo, hash FNV-1a, 64 bit.
pub fn model_hash(text: &[u8]) -> u64 {
    text.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
