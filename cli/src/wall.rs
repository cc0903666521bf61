use clap::Args;
use driver_sim::{Places, Wall};
use nalgebra::SVector;
use planner::robot::Robot;
use planner::with_dof;

use crate::exit::Exit;
use crate::failure::Failure;

/// A wall in the simulation.
#[derive(Args, Debug)]
pub(crate) struct WallOption {
    /// Put a wall into the simulation: a point of it (m, workstation), its normal towards the free
    /// side, its stiffness (N/m), as seven numbers. The simulated driver then has sensors: wrench.Fx
    /// to wrench.Tz, force, distance, digital_input_0
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ,N/M", allow_hyphen_values = true, value_parser = numbers)]
    wall: Option<Numbers>,
}

/// The numbers of a wall, as they were written.
#[derive(Clone, Debug)]
struct Numbers {
    text: String,
    values: [f64; 7],
}

/// Reads seven numbers.
fn numbers(text: &str) -> Result<Numbers, String> {
    let read: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let values = read.map_err(|error| format!("{error}"))?;
    let values = values.try_into().map_err(|values: Vec<f64>| {
        format!(
            "expected 7 numbers with commas between them, got {}",
            values.len()
        )
    })?;
    Ok(Numbers {
        text: text.to_owned(),
        values,
    })
}

impl WallOption {
    /// The option as it was written, for the process that simulates.
    pub(crate) fn text(&self) -> Option<&str> {
        self.wall.as_ref().map(|wall| wall.text.as_str())
    }

    /// The wall, for an arm with the tool that is mounted at the start.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] when the robot's description is wrong.
    pub(crate) fn wall(&self, robot: &Robot) -> Result<Option<Wall>, Failure> {
        let Some(wall) = &self.wall else {
            return Ok(None);
        };
        let [x, y, z, nx, ny, nz, stiffness] = wall.values;
        Ok(Some(Wall {
            point: [x, y, z],
            normal: [nx, ny, nz],
            stiffness,
            places: with_dof!(robot.dof(), N => places::<N>(robot))?,
        }))
    }
}

/// Where the controlled point and the flange are in the workstation.
fn places<const N: usize>(robot: &Robot) -> Result<Places, Failure> {
    let chain = robot.chain::<N>();
    let chain = chain.map_err(|cause| Failure::new(Exit::Unreadable, cause))?;
    let flange_from_tool = robot.tooling().flange_from_tool();
    Ok(Places::new(move |joints| {
        let flange = chain.forward(&SVector::from_column_slice(joints));
        let tool = flange * flange_from_tool;
        [tool, flange].map(|pose| pose.translation.vector.into())
    }))
}
