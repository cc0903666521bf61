//! MoveScrew: to a pose, straight on, then a turn and an advance in step.

use nalgebra::SVector;
use trajectory::{Helix, Trajectory};

use super::{Fault, MotionError, PlannedMove, Planner, STRAIGHT};
use crate::task::{Move, ScrewMove, Shape};

/// At how many places a piece of the motion is compared with the helix.
const PLACES: usize = 4;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_screw(
        &self,
        screw: &ScrewMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut parts = Vec::new();
        let mut at = *start;
        let mut go = |shape, pose, at: &mut SVector<f64, N>| -> Result<(), MotionError> {
            let motion = Move {
                shape,
                poses: vec![pose],
                tolerance: 0.0,
                limits: screw.limits,
            };
            let planned = self.plan_move(&motion, at)?;
            *at = planned.end;
            parts.push(planned);
            Ok(())
        };
        let from = self.chain().forward(start);
        if let Some(pose) = screw.start {
            go(Shape::Joint, pose, &mut at)?;
        }
        let begin = screw.before_turn(&from);
        if screw.free != 0.0 {
            go(Shape::Straight, begin, &mut at)?;
        }
        if screw.advance != 0.0 || screw.turn != 0.0 {
            parts.push(self.turn(screw, &screw.helix(&begin), &at)?);
        }
        match PlannedMove::joined(parts) {
            Some(planned) => Ok(planned),
            // Nothing is asked for: the arm is there.
            None => self.plan_move(&screw.of_point(&from), start),
        }
    }

    /// The turn with its advance, along the helix.
    fn turn(
        &self,
        screw: &ScrewMove,
        helix: &Helix,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        use trajectory::ToolCurve;
        let motion = Move {
            shape: Shape::Joint,
            poses: vec![helix.at(1.0).pose],
            tolerance: 0.0,
            limits: screw.limits,
        };
        let draft = self.along(helix, &motion, start)?;
        let planned = self.certify(&motion, start, draft)?;
        self.check_helix(helix, &planned.trajectory)?;
        Ok(planned)
    }

    /// Whether the controlled point stays on the helix.
    fn check_helix(&self, helix: &Helix, trajectory: &Trajectory<N>) -> Result<(), Fault> {
        let (mut u, mut worst) = (0.0, 0.0_f64);
        for piece in trajectory.pieces() {
            for place in 0..=PLACES {
                let time = piece.duration * place as f64 / PLACES as f64;
                let joints = piece.sample(time).position;
                let point = self.chain().forward(&joints).translation.vector;
                let off;
                (u, off) = helix.nearest(&point, u);
                worst = worst.max(off);
            }
        }
        if worst.is_nan() || worst > STRAIGHT {
            return Err(Fault::Helix {
                off_m: worst,
                allowed_m: STRAIGHT,
            });
        }
        Ok(())
    }
}
