//! Errors of a driver.

use thiserror::Error;

/// Why a driver cannot run.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DriverError {
    /// The number of joints does not fit into a message.
    #[error("{joints} joints do not fit, a message holds 1 to {most}")]
    Joints {
        /// The number asked for.
        joints: usize,
        /// The most that fit.
        most: usize,
    },
    /// The length of a list is not the number of joints.
    #[error("{option} has {found} values for {joints} joints")]
    Count {
        /// The option.
        option: &'static str,
        /// Number of values.
        found: usize,
        /// Number of joints.
        joints: usize,
    },
    /// An option has an invalid value.
    #[error("{option} must be {wanted}, got {value}")]
    Value {
        /// The option.
        option: &'static str,
        /// What it should be.
        wanted: &'static str,
        /// What it is.
        value: f64,
    },
    /// The log of setpoints cannot be written.
    #[error("cannot write {}: {cause}", path.display())]
    Log {
        /// The file.
        path: std::path::PathBuf,
        /// What the operating system said.
        cause: String,
    },
    /// A port of the network cannot be used.
    #[error("cannot listen on {address}: {cause}")]
    Port {
        /// The address and port.
        address: String,
        /// What the operating system said.
        cause: String,
    },
    /// A thread of the driver cannot be started.
    #[error("cannot start a thread: {cause}")]
    Thread {
        /// What the operating system said.
        cause: String,
    },
    /// Signals cannot be received.
    #[error("cannot receive signals: {cause}")]
    Signals {
        /// What the operating system said.
        cause: String,
    },
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] ipc::IpcError),
}

impl DriverError {
    /// Whether the number of an option is in a range, its ends included; `wanted` says which one.
    ///
    /// # Errors
    /// [`DriverError::Value`] with the option's name.
    pub fn check_range(
        option: &'static str,
        value: f64,
        [least, most]: [f64; 2],
        wanted: &'static str,
    ) -> Result<(), Self> {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        Err(Self::Value {
            option,
            wanted,
            value,
        })
    }

    /// Whether the number of an option is finite and, where it must be, positive.
    ///
    /// # Errors
    /// [`DriverError::Value`] with the option's name.
    pub fn check_value(option: &'static str, value: f64, positive: bool) -> Result<(), Self> {
        let wanted = if positive {
            "positive and finite"
        } else {
            "finite"
        };
        if value.is_finite() && (!positive || value > 0.0) {
            Ok(())
        } else {
            Err(Self::Value {
                option,
                wanted,
                value,
            })
        }
    }
}
