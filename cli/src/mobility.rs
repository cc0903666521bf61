use std::io::{self, Write};

use kinematics::measure::{self, Dexterity};
use kinematics::reach::{self, ReachMap};
use nalgebra::{Isometry3, SVector};
use planner::robot::Robot;
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::failure::Failure;

/// Number of joint positions from which the reach is sampled.
const REACH_SAMPLES: u32 = 20_000;

/// The controlled point at home, how well it can move there, and its reach.
pub(crate) struct Mobility {
    /// Pose of the controlled point in the workstation at home.
    pub(crate) home: Isometry3<f64>,
    /// How well the arm moves at home.
    dexterity: Dexterity,
    /// Reach of the controlled point about the base, in the workstation.
    reach: ReachMap,
}

/// Computes the mobility of a robot of `N` joints with its mounted end effector.
///
/// # Errors
/// The robot's description is at fault.
pub(crate) fn mobility<const N: usize>(robot: &Robot) -> Result<Mobility, Failure> {
    let chain = robot
        .chain_with::<N>(robot.mounted)
        .map_err(|error| Failure::new(Exit::Unreadable, error))?;
    let home =
        SVector::<f64, N>::from_fn(|joint, _| robot.home.get(joint).copied().unwrap_or_default());
    let base = robot.workstation_from_base.translation.vector.into();
    Ok(Mobility {
        home: chain.forward(&home),
        dexterity: measure::dexterity(&chain, &home),
        reach: reach::map(&chain, &base, REACH_SAMPLES),
    })
}

impl Mobility {
    /// As JSON, m.
    pub(crate) fn json(&self) -> Value {
        let (dexterity, reach) = (&self.dexterity, &self.reach);
        json!({
            "manipulability": dexterity.manipulability,
            "smallest_singular_value": dexterity.smallest,
            // Nothing where the arm is singular: JSON has no infinity.
            "condition": dexterity.condition.is_finite().then_some(dexterity.condition),
            "reach": {
                "samples": REACH_SAMPLES,
                "nearest_m": reach.nearest,
                "farthest_m": reach.farthest,
                "low_m": reach.low.coords.as_slice(),
                "high_m": reach.high.coords.as_slice(),
                "share_of_each_tenth": reach.shells,
                "typical_smallest_singular_value": reach.typical_smallest,
            },
        })
    }

    /// What people read, in a few lines.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn lines(&self, out: &mut impl Write) -> io::Result<()> {
        let (dexterity, reach) = (&self.dexterity, &self.reach);
        writeln!(
            out,
            "at home: manipulability {:.3}, condition number {:.1}, smallest singular value {:.3} \
             (lengths in units of 0.3 m; {:.3} is usual for this arm)",
            dexterity.manipulability,
            dexterity.condition,
            dexterity.smallest,
            reach.typical_smallest
        )?;
        let [low, high] = [reach.low, reach.high].map(|corner| (corner * 1e3).map(f64::round));
        writeln!(
            out,
            "reach from the base: {:.0} to {:.0} mm, in x {} to {}, y {} to {}, z {} to {} mm \
             ({REACH_SAMPLES} joint positions)",
            reach.nearest * 1e3,
            reach.farthest * 1e3,
            low.x,
            high.x,
            low.y,
            high.y,
            low.z,
            high.z
        )?;
        let shares = reach.shells.map(|share| format!("{:.0}", share * 100.0));
        writeln!(
            out,
            "share of the joint positions in each tenth of the reach: {} %",
            shares.join(" ")
        )
    }
}
