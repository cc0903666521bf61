//! Executing a plan, one step at a time: pure, from a state and a world to the next state.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::batch::{Batch, Errand, Request};
use super::eval::{Context, matches};
use super::program::{Node, Program};
use super::robot::{Robot, RobotOptions};
use super::value::{PoseValue, Value};
use crate::PlanError;
use crate::kitting::ast::{Action, Expression, Name, Span, Term};
use crate::kitting::types::Type;
use crate::world::class::{Kind, derived_property, stored_property};
use crate::world::{Change, Class, Location, Model, Object, ObjectId, Scalar};

/// How a plan ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// Stop was executed.
    Stopped,
    /// The plan gave up, or could not go on.
    Failed {
        /// Reason for EndCanon, positive: 1 Quit, 2 a statement, 3 the motion, 4 the factotum.
        code: i64,
        /// In words.
        reason: String,
    },
}

/// A list that is being executed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Frame {
    pub(crate) node: usize,
    /// Chosen order of the members, once it is chosen.
    pub(crate) order: Option<Vec<usize>>,
    /// Position of the next member; for a loop, statements done at the last test.
    pub(crate) next: usize,
}

impl Frame {
    pub(crate) fn new(node: usize) -> Self {
        Self {
            node,
            order: None,
            next: usize::MAX,
        }
    }
}

/// What has been done so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counters {
    /// Statements executed (lists and tests not counted).
    pub statements: usize,
    /// Canonical commands executed.
    pub commands: usize,
    /// Objects picked up.
    pub pick_ups: usize,
    /// Objects put down.
    pub put_downs: usize,
    /// Moves above a pose.
    pub moves_above: usize,
    /// Changes of the end effector.
    pub end_effector_changes: usize,
    /// Errands of the factotum.
    pub factotum_calls: usize,
    /// Kits finished.
    pub kits: usize,
    /// Time of motion (s).
    pub motion_s: f64,
    /// Time gained by orders that the executor chose, as predicted (s).
    pub gained_s: f64,
}

/// Where a plan is: program counter, variables, counters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) stack: Vec<Frame>,
    /// Values of parameters and variables.
    pub bindings: BTreeMap<String, Value>,
    /// What has been done.
    pub counters: Counters,
    /// How it ended, when it has.
    pub outcome: Option<Outcome>,
}

/// What a step asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// Nothing but its changes.
    Nothing,
    /// Motion; its changes come true with it.
    Motion(Batch),
    /// An errand of the factotum.
    Errand(Request),
    /// The plan is over, by a statement.
    End,
    /// There are no more statements.
    Exhausted,
}

/// One step of a plan: what to do, and the state when it is done.
#[derive(Clone, Debug)]
pub struct Step {
    /// Name of the statement.
    pub name: &'static str,
    /// Where it is written.
    pub span: Span,
    /// What to do.
    pub act: Act,
    /// Changes of the world that need no motion.
    pub changes: Vec<Change>,
    /// The state afterwards.
    pub state: State,
    /// Something odd that the user should know.
    pub warning: Option<String>,
}

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

type Result<T> = std::result::Result<T, PlanError>;

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

    fn context<'s>(&'s self, state: &'s State) -> Context<'s> {
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

    /// Interprets the next statement. The world is not changed; the step says how it will be.
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
            return Err(PlanError::Resume(format!("node {node} is no statement")));
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
                let why = "a pass did nothing, so it would go on for ever".into();
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

    fn assign(&self, variable: &Name, value: Value, state: &mut State) -> Result<()> {
        let missing = || PlanError::Value(format!("nothing is called {}", variable.text));
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .ok_or_else(missing)?
            .to_owned();
        self.accepts(&declared, &value)?;
        state.bindings.insert(declared, value);
        Ok(())
    }

    /// The value has the type of the variable and, for objects, its stock keeping unit.
    fn accepts(&self, declared: &str, value: &Value) -> Result<()> {
        let kind = self
            .program
            .scope
            .lookup(declared)
            .map_or(Type::Unknown, |(_, kind)| kind);
        let object = if let Value::Object(id) = value {
            Some(self.model.object(*id)?)
        } else {
            None
        };
        let fits = match (kind, value) {
            (Type::Object(class), Value::Object(_)) => object.is_some_and(|o| o.class.is_a(class)),
            (Type::Number { whole, least }, Value::Number(number)) => {
                (!whole || number.fract() == 0.0)
                    && least.is_none_or(|least| *number >= least as f64)
            }
            (
                Type::Object(_) | Type::Pose | Type::Data | Type::Text | Type::Unknown,
                Value::Null,
            )
            | (Type::Pose, Value::Pose(_))
            | (Type::Text, Value::Text(_))
            | (Type::Truth, Value::Truth(_))
            | (Type::Data | Type::Unknown, _) => true,
            _ => false,
        };
        let description = || value.describe(self.model);
        if !fits {
            let message = format!("{declared} is {}, not {}", kind.describe(), description());
            return Err(PlanError::Value(message));
        }
        let variable = self
            .program
            .plan
            .variables
            .iter()
            .find(|v| v.name == declared);
        if let (Some(sku), Some(object)) = (variable.and_then(|v| v.sku.as_deref()), object)
            && object.sku().is_some_and(|own| own != sku)
        {
            let message = format!("{declared} holds only {sku}, {} is not one", description());
            return Err(PlanError::Value(message));
        }
        Ok(())
    }

    /// The first object that meets the variable's requirement and is bound to no other variable
    /// with a requirement.
    fn find(
        &self,
        variable: &Name,
        location: crate::kitting::ast::Keyword,
        state: &State,
    ) -> Option<ObjectId> {
        let plan = &self.program.plan;
        let declared = self.program.scope.declared(&variable.text)?;
        let own = plan.variables.iter().find(|v| v.name == declared)?;
        let requirement = plan
            .requirements
            .iter()
            .find(|r| Some(&r.name) == own.requirement.as_ref())?;
        let taken = |id: ObjectId| {
            plan.variables.iter().any(|other| {
                other.requirement.is_some()
                    && other.name != declared
                    && state.bindings.get(&other.name) == Some(&Value::Object(id))
            })
        };
        let fits = |object: &&Object| {
            !taken(object.id) && matches(self.model, plan, requirement, object, location)
        };
        self.model.objects().find(fits).map(|object| object.id)
    }

    fn set(
        &self,
        target: &Expression,
        value: &Expression,
        span: Span,
        mut state: State,
    ) -> Result<Step> {
        let value = self.context(&state).value(value)?;
        let (object, property) = match &target.term {
            Term::Property(object, property) => (object, property),
            Term::Name(text) => {
                let name = Name {
                    text: text.clone(),
                    span: target.span,
                };
                self.assign(&name, value, &mut state)?;
                return Ok(nothing("Set", span, state));
            }
            _ => {
                return Err(PlanError::Value(
                    "only variables and properties can be set".into(),
                ));
            }
        };
        let object = self.model.object(self.context(&state).object(object)?)?;
        let missing =
            || PlanError::Value(format!("{} has no property {property} to set", object.name));
        let kind = stored_property(object.class, property).ok_or_else(missing)?;
        let metres = self.model.units.metres().unwrap_or(1.0);
        let value = match (kind, value) {
            (Kind::Truth, Value::Truth(truth)) => Scalar::Truth(truth),
            (Kind::Text, Value::Text(text) | Value::Sku(text)) => Scalar::Text(text),
            (Kind::Length, Value::Number(number)) => Scalar::Number(number * metres),
            (Kind::Number | Kind::Weight, Value::Number(number)) => Scalar::Number(number),
            (_, other) => {
                let found = other.describe(self.model);
                return Err(PlanError::Value(format!("{property} cannot be {found}")));
            }
        };
        if property == "isKitInstance_Finished" && value == Scalar::Truth(true) {
            state.counters.kits += 1;
        }
        let change = Change::Set {
            object: object.id,
            property: property.clone(),
            value,
        };
        Ok(Step {
            changes: vec![change],
            ..nothing("Set", span, state)
        })
    }

    /// The new object takes the place of its first component, which becomes relative to it.
    fn create(
        &self,
        variable: &Name,
        (part, property): (&Expression, &str),
        span: Span,
        mut state: State,
    ) -> Result<Step> {
        let part = self.model.object(self.context(&state).object(part)?)?;
        let declared = self.program.scope.lookup(&variable.text);
        let Some((_, Type::Object(class))) = declared else {
            return Err(PlanError::Value(format!("{} is no object", variable.text)));
        };
        let component = derived_property(class, property).map(|(component, _)| component);
        if !component.is_some_and(|component| part.class.is_a(component)) {
            let message = format!("{} cannot be the {property} of a {class}", part.name);
            return Err(PlanError::Value(message));
        }
        if class.is_composite() && self.model.composite_of(part.id).is_some() {
            return Err(PlanError::Value(format!(
                "{} is already part of another",
                part.name
            )));
        }
        let mut fresh = self.model.clone();
        let name = fresh.free_name(class.name());
        let id = fresh.fresh();
        let mut object = Object::new(id, name, class, part.location);
        if class == Class::KitInstance {
            let design = self.program.plan.about("TargetSKU").to_owned();
            let tray = self
                .model
                .design(&design)
                .map(|design| design.tray_sku.as_str());
            if tray != part.sku() {
                let message = format!("{} is not the tray of the design {design}", part.name);
                return Err(PlanError::Value(message));
            }
            object
                .properties
                .insert("hasKitInstance_DesignRef".into(), Scalar::Text(design));
            object
                .properties
                .insert("isKitInstance_Finished".into(), Scalar::Truth(false));
        }
        let location = Location::pose(id, Isometry3::identity());
        let changes = vec![
            Change::Create(object),
            Change::Place {
                object: part.id,
                location,
            },
        ];
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .unwrap_or_default()
            .to_owned();
        state.bindings.insert(declared, Value::Object(id));
        Ok(Step {
            changes,
            ..nothing("CreateInstance", span, state)
        })
    }

    /// The one component takes the place of the object.
    fn destroy(&self, variable: &Name, span: Span, mut state: State) -> Result<Step> {
        let object = self.model.object(self.bound(variable, &state)?)?;
        let components: Vec<&Object> = self.model.children(object.id).collect();
        let [component] = components[..] else {
            let message = format!(
                "{} has {} components, not one",
                object.name,
                components.len()
            );
            return Err(PlanError::Value(message));
        };
        let pose = object.location.pose * component.location.pose;
        let changes = vec![
            Change::Place {
                object: component.id,
                location: Location {
                    pose,
                    ..object.location
                },
            },
            Change::Delete(object.id),
        ];
        self.assign(variable, Value::Null, &mut state)?;
        Ok(Step {
            changes,
            ..nothing("DestroyInstance", span, state)
        })
    }

    fn bound(&self, variable: &Name, state: &State) -> Result<ObjectId> {
        let declared = self
            .program
            .scope
            .declared(&variable.text)
            .unwrap_or_default();
        match state.bindings.get(declared) {
            Some(Value::Object(id)) => Ok(*id),
            other => {
                let found = other.map_or("nothing".into(), |value| value.describe(self.model));
                Err(PlanError::Value(format!(
                    "{} is {found}, not an object",
                    variable.text
                )))
            }
        }
    }

    fn errand(
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

    fn motion(&self, action: &Action, span: Span, mut state: State) -> Result<Step> {
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
                        return Err(PlanError::Value(format!("{found} is no end effector")));
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

fn nothing(name: &'static str, span: Span, state: State) -> Step {
    Step {
        name,
        span,
        act: Act::Nothing,
        changes: Vec::new(),
        state,
        warning: None,
    }
}

fn done(name: &'static str, span: Span, state: State) -> Step {
    Step {
        act: Act::End,
        ..nothing(name, span, state)
    }
}

fn quit(name: &'static str, span: Span, mut state: State, reason: String) -> Step {
    state.stack.clear();
    state.outcome = Some(Outcome::Failed { code: 1, reason });
    done(name, span, state)
}

/// A number may be in quotes, by the type of its variable.
pub(crate) fn coerce(value: Value, kind: Option<Type>) -> Value {
    match (&value, kind) {
        (Value::Text(text), Some(Type::Number { .. })) => {
            text.parse().map_or(value.clone(), Value::Number)
        }
        _ => value,
    }
}
