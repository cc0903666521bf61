//! Executing a plan, one step at a time: pure, from a state and a world to the next state.

use std::collections::BTreeMap;

use super::batch::Errand;
use super::eval::Context;
use super::program::{Node, Program};
use super::robot::RobotOptions;
use super::state::{Act, Counters, Frame, Outcome, State, Step, done, nothing, quit};
use super::value::{PoseValue, Value};
use crate::PlanError;
use crate::kitting::ast::{Action, Expression, Span};
use crate::kitting::types::Type;
use crate::world::Model;

/// Chooses an order of the members of a list; the second value is the time gained (s).
pub(crate) trait Chooser {
    fn order(
        &mut self,
        program: &Program,
        state: &State,
        model: &Model,
        node: usize,
    ) -> (Vec<usize>, f64);
}

pub(super) type Result<T> = std::result::Result<T, PlanError>;

/// Executes steps of one program against one model.
pub(crate) struct Machine<'a> {
    pub(crate) program: &'a Program,
    pub(crate) model: &'a Model,
    pub(crate) options: &'a RobotOptions,
}

impl Machine<'_> {
    /// The state before the first step.
    pub(crate) fn start(&self, parameters: &BTreeMap<String, Value>) -> Result<State> {
        let mut state = State {
            stack: vec![Frame::new(self.program.root())],
            bindings: parameters.clone(),
            counters: Counters::default(),
            outcome: None,
        };
        for variable in &self.program.plan.variables {
            let value = match &variable.initial {
                None => Value::Null,
                Some(initial) => {
                    let value = self.context(&state).value(initial)?;
                    coerce(value, Type::from_name(&variable.class))
                }
            };
            state.bindings.insert(variable.name.clone(), value);
        }
        Ok(state)
    }

    pub(super) fn context<'s>(&'s self, state: &'s State) -> Context<'s> {
        let Self { program, model, .. } = self;
        let (plan, scope) = (&program.plan, &program.scope);
        Context {
            plan,
            scope,
            model,
            bindings: &state.bindings,
            subject: None,
        }
    }

    /// Interprets the next statement. The world is not changed; the step contains its changes.
    pub(crate) fn step(&self, state: &State, chooser: &mut dyn Chooser) -> Result<Step> {
        let mut next = state.clone();
        let Some(node) = self.next_leaf(&mut next, chooser)? else {
            next.outcome = Some(Outcome::Stopped);
            return Ok(Step {
                act: Act::Exhausted,
                ..nothing("Stop", Span::default(), next)
            });
        };
        let Node::Leaf(action, span) = &self.program.nodes[node] else {
            return Err(PlanError::Resume(format!("node {node} is not a statement")));
        };
        next.counters.statements += 1;
        let mut step = self
            .execute(action, *span, next)
            .map_err(|error| match error {
                error @ PlanError::Statement { .. } => error,
                error => PlanError::Statement {
                    statement: action.name().to_owned(),
                    why: error.to_string(),
                },
            })?;
        if let Act::Motion(batch) = &mut step.act {
            step.state.counters.commands += batch.commands.len();
        }
        Ok(step)
    }

    /// Goes through lists and tests to the next statement.
    fn next_leaf(&self, state: &mut State, chooser: &mut dyn Chooser) -> Result<Option<usize>> {
        loop {
            let Some(frame) = state.stack.last() else {
                return Ok(None);
            };
            let (index, position) = (
                frame.node,
                if frame.next == usize::MAX {
                    0
                } else {
                    frame.next
                },
            );
            let node = self
                .program
                .nodes
                .get(index)
                .ok_or_else(|| PlanError::Resume(format!("the plan has no node {index}")))?;
            match node {
                Node::Leaf(..) => {
                    state.stack.pop();
                    return Ok(Some(index));
                }
                Node::Sequence(list) => self.advance(state, list.get(position).copied(), position),
                Node::AnyOrder(list, _) | Node::One(list) => {
                    if frame.order.is_none() {
                        let (order, gain) = chooser.order(self.program, state, self.model, index);
                        state.counters.gained_s += gain;
                        if let Some(frame) = state.stack.last_mut() {
                            frame.order = Some(order);
                        }
                        continue;
                    }
                    let order = frame.order.as_deref().unwrap_or_default();
                    let member = order.get(position).and_then(|member| list.get(*member));
                    self.advance(state, member.copied(), position);
                }
                Node::Choice(choices) => {
                    let mut chosen = None;
                    for (test, member) in choices {
                        let test = test.as_ref().map(|test| self.context(state).truth(test));
                        if test.unwrap_or(Ok(true))? {
                            chosen = Some(*member);
                            break;
                        }
                    }
                    state.stack.pop();
                    state.stack.extend(chosen.map(Frame::new));
                }
                Node::Loop(test, body) => self.pass(state, test, *body)?,
            }
        }
    }

    fn advance(&self, state: &mut State, member: Option<usize>, position: usize) {
        match member {
            Some(member) => {
                if let Some(frame) = state.stack.last_mut() {
                    frame.next = position + 1;
                }
                state.stack.push(Frame::new(member));
            }
            None => {
                state.stack.pop();
            }
        }
    }

    fn pass(&self, state: &mut State, test: &Expression, body: usize) -> Result<()> {
        if !self.context(state).truth(test)? {
            state.stack.pop();
            return Ok(());
        }
        let statements = state.counters.statements;
        if let Some(frame) = state.stack.last_mut() {
            if frame.next == statements {
                let why = "a pass did nothing, so the loop would never end".into();
                return Err(PlanError::Statement {
                    statement: "LoopWhile".into(),
                    why,
                });
            }
            frame.next = statements;
        }
        state.stack.push(Frame::new(body));
        Ok(())
    }

    fn execute(&self, action: &Action, span: Span, mut state: State) -> Result<Step> {
        let name = action.name();
        match action {
            Action::Stop {} => {
                state.stack.clear();
                state.outcome = Some(Outcome::Stopped);
                Ok(done(name, span, state))
            }
            Action::Quit {} => Ok(quit(name, span, state, "the plan gave up (Quit)".into())),
            Action::Bind {
                variable, location, ..
            } => match self.find(variable, *location, &state) {
                Some(object) => {
                    self.assign(variable, Value::Object(object), &mut state)?;
                    Ok(nothing(name, span, state))
                }
                None => {
                    let reason = format!("nothing was found for {}", variable.text);
                    Ok(quit(name, span, state, reason))
                }
            },
            Action::Set { target, value } => self.set(target, value, span, state),
            Action::SetPose {
                variable,
                reference,
                pose,
            } => {
                let context = self.context(&state);
                let reference = context.object(reference)?;
                let place = context.in_workstation(&context.pose(pose)?)?;
                let pose = self.model.workstation_from(reference)?.inv_mul(&place);
                let value = Value::Pose(PoseValue {
                    reference,
                    pose,
                    known: true,
                });
                self.assign(variable, value, &mut state)?;
                Ok(nothing(name, span, state))
            }
            Action::CreateInstance {
                variable,
                object,
                property,
            } => self.create(variable, (object, property), span, state),
            Action::DestroyInstance { variable } => self.destroy(variable, span, state),
            Action::FactotumRefill { variable } => {
                self.errand(Errand::Refill, variable, span, state)
            }
            Action::FactotumRemove { variable } => {
                self.errand(Errand::Remove, variable, span, state)
            }
            Action::FactotumReplace { variable } => {
                self.errand(Errand::Replace, variable, span, state)
            }
            Action::RobotChangeEndEffector { .. }
            | Action::RobotMoveAbove { .. }
            | Action::RobotPickUp { .. }
            | Action::RobotPutDown { .. } => self.motion(action, span, state),
            _ => Ok(nothing(name, span, state)),
        }
    }
}

/// A number may be in quotes, by the type of its variable.
fn coerce(value: Value, kind: Option<Type>) -> Value {
    match (&value, kind) {
        (Value::Text(text), Some(Type::Number { .. })) => {
            text.parse().map_or(value.clone(), Value::Number)
        }
        _ => value,
    }
}
