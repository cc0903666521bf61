//! The file that says which drive is which joint.

use core::f64::consts::TAU;
use serde::Deserialize;
use thiserror::Error;

use crate::MAX_DEVICES;

/// Why the file of the drives cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DrivesError {
    /// It is not TOML, or not of this form; with line and column.
    #[error("{0}")]
    Form(String),
    /// The number of drives.
    #[error("expected {joints} entries [[drive]], one per joint from the root, found {found}")]
    Count {
        /// How many there are.
        found: usize,
        /// Joints of the robot.
        joints: usize,
    },
    /// A number makes no sense.
    #[error("drive {number}: {key} must be {wanted}, got {found}")]
    Value {
        /// The entry, from 1.
        number: usize,
        /// The key.
        key: &'static str,
        /// What it should be.
        wanted: &'static str,
        /// What it is.
        found: f64,
    },
    /// Two entries have the same place.
    #[error("drives {first} and {second} have the same place {place} on the bus")]
    Twice {
        /// The first entry, from 1.
        first: usize,
        /// The second one.
        second: usize,
        /// The place.
        place: usize,
    },
    /// The range of a joint does not fit into the 32 bits of a target position.
    #[error(
        "drive {number}: joint angles from {lower} to {upper} rad are positions beyond 32 bits; check counts, gear and zero"
    )]
    Range {
        /// The entry, from 1.
        number: usize,
        /// Lower end of the joint's range (rad).
        lower: f64,
        /// Upper end (rad).
        upper: f64,
    },
}

/// The drive of one joint.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Its place on the bus; 0 is the device next to this machine.
    pub place: usize,
    /// Position units (of 0x607A and 0x6064) per revolution of the motor.
    pub counts: f64,
    /// Revolutions of the motor per revolution of the joint; negative where they turn against each
    /// other.
    pub gear: f64,
    /// Position of the drive where the joint's angle is 0.
    #[serde(default)]
    pub zero: f64,
    /// Largest following error (rad), written to 0x6065; without it the drive keeps its own.
    pub following_error: Option<f64>,
    /// Torque at the joint when the drive gives its rated torque (N m); without it no torque is
    /// reported.
    pub torque: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    drive: Vec<Drive>,
}

/// The drives of a file, one entry per joint. `ranges` are those of the joints (rad).
///
/// ```
/// let text = "[[drive]]\nplace = 0\ncounts = 131072\ngear = -101.0\n";
/// let drives = driver_cia402::read_drives(text, &[[-3.0, 3.0]])?;
/// assert_eq!(drives[0].gear, -101.0);
/// # Ok::<(), driver_cia402::DrivesError>(())
/// ```
///
/// # Errors
/// [`DrivesError`]: what is wrong, and where.
pub fn read_drives(text: &str, ranges: &[[f64; 2]]) -> Result<Vec<Drive>, DrivesError> {
    let file: File = toml::from_str(text).map_err(|error| {
        let text = error.to_string();
        DrivesError::Form(text.trim_end().to_owned())
    })?;
    let (found, joints) = (file.drive.len(), ranges.len());
    if found != joints {
        return Err(DrivesError::Count { found, joints });
    }
    for (index, (drive, range)) in file.drive.iter().zip(ranges).enumerate() {
        check(drive, index + 1, *range)?;
        let before = file.drive[..index].iter();
        if let Some(first) = before.clone().position(|other| other.place == drive.place) {
            return Err(DrivesError::Twice {
                first: first + 1,
                second: index + 1,
                place: drive.place,
            });
        }
    }
    Ok(file.drive)
}

fn check(drive: &Drive, number: usize, [lower, upper]: [f64; 2]) -> Result<(), DrivesError> {
    let value = |key, found: f64, good: bool, wanted| {
        if good {
            return Ok(());
        }
        Err(DrivesError::Value {
            number,
            key,
            wanted,
            found,
        })
    };
    let place = drive.place as f64;
    value("place", place, drive.place < MAX_DEVICES, "0 to 15")?;
    let positive = |found: f64| found.is_finite() && found > 0.0;
    let counts = drive.counts;
    value("counts", counts, positive(counts), "positive")?;
    let turns = drive.gear.is_finite() && drive.gear != 0.0;
    value("gear", drive.gear, turns, "a number other than 0")?;
    value("zero", drive.zero, drive.zero.is_finite(), "finite")?;
    for (key, found) in [
        ("following_error", drive.following_error),
        ("torque", drive.torque),
    ] {
        if let Some(found) = found {
            value(key, found, positive(found), "positive")?;
        }
    }
    let fits = |angle: f64| {
        let counts = drive.zero + angle * drive.scale();
        counts > f64::from(i32::MIN) && counts < f64::from(i32::MAX)
    };
    if fits(lower) && fits(upper) {
        return Ok(());
    }
    Err(DrivesError::Range {
        number,
        lower,
        upper,
    })
}

impl Drive {
    /// Position units per rad of the joint.
    pub(crate) fn scale(&self) -> f64 {
        self.counts * self.gear / TAU
    }

    /// The drive's position for an angle of the joint (rad).
    pub(crate) fn to_counts(&self, angle: f64) -> i32 {
        // The conversion saturates.
        (self.zero + angle * self.scale()).round() as i32
    }

    /// The joint's angle (rad) for a position of the drive.
    pub(crate) fn to_angle(&self, counts: i32) -> f64 {
        (f64::from(counts) - self.zero) / self.scale()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[[drive]]\nplace = 0\ncounts = 65536\ngear = 100.0\nzero = 1000\n";

    fn refused(text: &str, joints: usize) -> String {
        let ranges = vec![[-3.0, 3.0]; joints];
        read_drives(text, &ranges).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_said() {
        let unknown = refused(&format!("{GOOD}ratio = 3\n"), 1);
        assert!(
            unknown.contains("ratio") && unknown.contains("line 6"),
            "{unknown}"
        );
        assert!(refused(GOOD, 2).contains("expected 2 entries"));
        let twice = refused(&format!("{GOOD}{GOOD}"), 2);
        assert!(twice.contains("drives 1 and 2"), "{twice}");
        let gear = refused(&GOOD.replace("100.0", "0.0"), 1);
        assert!(gear.contains("gear must be"), "{gear}");
        let range = refused(&GOOD.replace("65536", "1e9"), 1);
        assert!(range.contains("beyond 32 bits"), "{range}");
        assert!(refused(&GOOD.replace("place = 0", "place = 16"), 1).contains("0 to 15"));
    }

    #[test]
    fn counts_and_angles_are_inverse() {
        for gear in ["100.0", "-87.3"] {
            let text = GOOD.replace("100.0", gear);
            let drive = read_drives(&text, &[[-3.0, 3.0]]).unwrap().remove(0);
            assert_eq!(drive.to_counts(0.0), 1000);
            for step in -300..=300 {
                let angle = f64::from(step) * 0.01;
                let back = drive.to_angle(drive.to_counts(angle));
                assert!((back - angle).abs() <= 0.5 / drive.scale().abs() + 1e-12);
            }
        }
    }
}
