//! Statements that the robot or the factotum carries out.

use super::batch::{Batch, Errand, Request};
use super::machine::{Machine, Result};
use super::robot::Robot;
use super::state::{Act, State, Step, nothing};
use super::value::Value;
use crate::PlanError;
use crate::kitting::ast::{Action, Name, Span};

impl Machine<'_> {
    pub(super) fn errand(
        &self,
        errand: Errand,
        variable: &Name,
        span: Span,
        mut state: State,
    ) -> Result<Step> {
        let object = match errand {
            Errand::Refill => None,
            _ => Some(self.bound(variable, &state)?),
        };
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .unwrap_or_default()
            .to_owned();
        let own = self
            .program
            .plan
            .variables
            .iter()
            .find(|v| v.name == declared);
        let requirement = own.and_then(|v| v.requirement.clone());
        let name = match errand {
            Errand::Refill => "FactotumRefill",
            Errand::Remove => "FactotumRemove",
            Errand::Replace => "FactotumReplace",
        };
        state.counters.factotum_calls += 1;
        state.bindings.insert(declared.clone(), Value::Null);
        let request = Request {
            errand,
            object,
            requirement,
            variable: declared,
        };
        Ok(Step {
            act: Act::Errand(request),
            ..nothing(name, span, state)
        })
    }

    pub(super) fn motion(&self, action: &Action, span: Span, mut state: State) -> Result<Step> {
        let robot = Robot {
            model: self.model,
            options: self.options,
        };
        let mut warning = None;
        let context = self.context(&state);
        let batch = match action {
            Action::RobotMoveAbove { pose } => {
                let place = context.in_workstation(&context.pose(pose)?)?;
                state.counters.moves_above += 1;
                robot.move_above(&place)?
            }
            Action::RobotPickUp { object } => {
                let object = context.object(object)?;
                state.counters.pick_ups += 1;
                robot.pick_up(object)?
            }
            Action::RobotPutDown { object, pose } => {
                let (object, pose) = (context.object(object)?, context.pose(pose)?);
                let place = context.in_workstation(&pose)?;
                state.counters.put_downs += 1;
                let (batch, odd) = robot.put_down(object, &place)?;
                warning = odd;
                batch
            }
            Action::RobotChangeEndEffector { effector } => {
                let id = match context.value(effector)? {
                    Value::Text(id) => id,
                    Value::Object(id) => self.model.object(id)?.name.clone(),
                    other => {
                        let found = other.describe(self.model);
                        return Err(PlanError::Value(format!("{found} is not an end effector")));
                    }
                };
                let batch = robot.change_effector(&id)?;
                state.counters.end_effector_changes += usize::from(!batch.commands.is_empty());
                batch
            }
            _ => Batch::default(),
        };
        let act = if batch.commands.is_empty() {
            Act::Nothing
        } else {
            Act::Motion(batch)
        };
        Ok(Step {
            act,
            warning,
            ..nothing(action.name(), span, state)
        })
    }
}
