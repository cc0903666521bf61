//! A wall that the tool can press against, and what sensors measure of it.

use std::fmt;
use std::sync::Arc;

use driver_kit::DriverError;

/// Where the tool centre point and the end of the arm are (m), for positions of the joints.
type Forward = dyn Fn(&[f64]) -> [[f64; 3]; 2] + Send + Sync;

/// Tells where the tool centre point and the end of the arm are.
///
/// ```
/// let slide = driver_sim::Places::new(|joints| [[0.0, 0.0, joints[0]]; 2]);
/// assert_eq!(slide.of(&[0.3]), [[0.0, 0.0, 0.3]; 2]);
/// ```
#[derive(Clone)]
pub struct Places(Arc<Forward>);

impl Places {
    /// From a function of the positions of the joints (rad, m); its points are in one frame (m).
    pub fn new(forward: impl Fn(&[f64]) -> [[f64; 3]; 2] + Send + Sync + 'static) -> Self {
        Self(Arc::new(forward))
    }

    /// The tool centre point and the end of the arm (m).
    #[must_use]
    pub fn of(&self, joints: &[f64]) -> [[f64; 3]; 2] {
        (self.0)(joints)
    }
}

impl fmt::Debug for Places {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Places")
    }
}

/// A plane that pushes the tool centre point back like a spring, without friction. The arm itself
/// is not bent: its servos are stiffer.
#[derive(Clone, Debug)]
pub struct Wall {
    /// A point of the plane (m).
    pub point: [f64; 3],
    /// Its normal, towards the free side; any length above 0.
    pub normal: [f64; 3],
    /// Force for each metre that the tool is in it (N/m).
    pub stiffness: f64,
    /// Where the tool is.
    pub places: Places,
}

impl PartialEq for Wall {
    fn eq(&self, other: &Self) -> bool {
        let numbers = |wall: &Self| (wall.point, wall.normal, wall.stiffness);
        numbers(self) == numbers(other) && Arc::ptr_eq(&self.places.0, &other.places.0)
    }
}

/// What the wall does to the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Touch {
    /// From the plane to the tool centre point (m); negative inside.
    pub(crate) distance: f64,
    /// Force on the tool (N).
    pub(crate) force: [f64; 3],
    /// Its torque about the end of the arm (N m).
    pub(crate) torque: [f64; 3],
}

impl Touch {
    /// How far the tool is in the wall (m).
    pub(crate) fn depth(&self) -> f64 {
        -self.distance
    }

    /// The size of the force (N).
    pub(crate) fn size(&self) -> f64 {
        dot(self.force, self.force).sqrt()
    }
}

impl Wall {
    /// Whether its numbers make a plane.
    ///
    /// # Errors
    /// [`DriverError::Value`] with the number's name.
    pub(crate) fn check(&self) -> Result<(), DriverError> {
        for value in self.point {
            DriverError::check_value("point of the wall", value, false)?;
        }
        for value in self.normal {
            DriverError::check_value("normal of the wall", value, false)?;
        }
        DriverError::check_value("normal of the wall", self.length(), true)?;
        DriverError::check_value("stiffness of the wall", self.stiffness, true)
    }

    fn length(&self) -> f64 {
        dot(self.normal, self.normal).sqrt()
    }

    /// What it does to the tool of an arm with these joints (rad, m).
    pub(crate) fn touch(&self, joints: &[f64]) -> Touch {
        let [tool, end] = self.places.of(joints);
        let normal = self.normal.map(|value| value / self.length());
        let distance = dot(minus(tool, self.point), normal);
        let push = self.stiffness * (-distance).max(0.0);
        let force = normal.map(|value| value * push);
        Touch {
            distance,
            force,
            torque: cross(minus(tool, end), force),
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
    [ax - bx, ay - by, az - bz]
}

fn cross([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(normal: [f64; 3]) -> Wall {
        Wall {
            point: [9.0, 9.0, 0.1],
            normal,
            stiffness: 1e4,
            places: Places::new(|joints| [[0.2, 0.0, joints[0]], [0.0, 0.0, joints[0]]]),
        }
    }

    #[test]
    fn a_wall_pushes_back_where_the_tool_is_in_it() {
        let wall = table([0.0, 0.0, 5.0]);
        let free = wall.touch(&[0.3]);
        assert!((free.distance - 0.2).abs() < 1e-15 && free.size() == 0.0);
        let pressed = wall.touch(&[0.099]);
        assert!((pressed.force[2] - 10.0).abs() < 1e-9, "{pressed:?}");
        assert!((pressed.torque[1] + 2.0).abs() < 1e-9, "{pressed:?}");
        assert!(wall.check().is_ok() && table([0.0; 3]).check().is_err());
    }
}
