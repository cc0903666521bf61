//! Actions as canonical commands, by a table.

use std::collections::BTreeMap;

use crcl::Command;
use nalgebra::Isometry3;
use serde::Deserialize;

use super::plan_file::PlanStep;
use crate::PlanError;
use crate::run::{Batch, Robot, RobotOptions};
use crate::world::{Change, Class, Location, Model, Object};

/// The table of actions that comes with the crate.
const OWN_TABLE: &str = include_str!("actions.toml");

/// The table of actions. The format is described at the top of the built-in table.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionTable {
    #[serde(default)]
    action: Vec<Entry>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    names: Vec<String>,
    arguments: Vec<String>,
    #[serde(rename = "do")]
    steps: Vec<Primitive>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Primitive {
    Message(String),
    Dwell(f64),
    OpenGripper {},
    CloseGripper {},
    MoveAbove(String),
    PickUp(String),
    PutDown {
        object: String,
        #[serde(default)]
        into: Option<String>,
        #[serde(default)]
        onto: Option<String>,
    },
    Attach(String),
    Detach {
        effector: String,
        #[serde(default)]
        holder: Option<String>,
    },
    CreateKit {
        kit: String,
        tray: String,
    },
}

impl ActionTable {
    /// The table that comes with the crate.
    ///
    /// # Errors
    /// [`PlanError::Table`]; a test makes sure that there is none.
    pub fn own() -> Result<Self, PlanError> {
        Self::default().with(OWN_TABLE)
    }

    /// This table with the entries of another (TOML), which are searched first.
    ///
    /// # Errors
    /// [`PlanError::Table`] for an invalid entry.
    pub fn with(&self, text: &str) -> Result<Self, PlanError> {
        let mut table: Self = toml::from_str(text).map_err(|e| PlanError::Table(e.to_string()))?;
        for entry in &table.action {
            entry.check()?;
        }
        table.action.extend(self.action.iter().cloned());
        Ok(table)
    }

    fn find(&self, step: &PlanStep) -> Result<&Entry, String> {
        let mut arities = Vec::new();
        for entry in self.action.iter().filter(|e| e.names.contains(&step.name)) {
            if entry.arguments.len() == step.objects.len() {
                return Ok(entry);
            }
            arities.push(entry.arguments.len().to_string());
        }
        Err(match arities.len() {
            0 => format!("no action is called {}", step.name),
            _ => {
                let known = arities.join(" or ");
                format!(
                    "{} takes {known} objects, not {}",
                    step.name,
                    step.objects.len()
                )
            }
        })
    }

    /// Whether the action is in the table with this number of objects.
    ///
    /// # Errors
    /// A text that says what is unknown.
    pub fn knows(&self, step: &PlanStep) -> Result<(), String> {
        self.find(step).map(|_| ())
    }

    /// Commands and effects of an action in this world.
    ///
    /// # Errors
    /// [`PlanError`] when an object is missing or a motion is not possible.
    pub fn interpret(
        &self,
        step: &PlanStep,
        model: &Model,
        options: &RobotOptions,
    ) -> Result<Batch, PlanError> {
        let entry = self.find(step).map_err(PlanError::Value)?;
        let objects = entry
            .arguments
            .iter()
            .map(String::as_str)
            .zip(step.objects.iter().map(String::as_str));
        let mut work = Work {
            objects: objects.collect(),
            model: model.clone(),
            options,
            batch: Batch::default(),
        };
        for primitive in &entry.steps {
            work.execute(primitive)?;
        }
        Ok(work.batch)
    }
}

impl Entry {
    /// Checks that every argument that a step uses is one of the action's.
    fn check(&self) -> Result<(), PlanError> {
        for step in &self.steps {
            let used: Vec<&String> = match step {
                Primitive::MoveAbove(a) | Primitive::PickUp(a) | Primitive::Attach(a) => vec![a],
                Primitive::PutDown { object, into, onto } => {
                    if into.is_some() == onto.is_some() {
                        let names = self.names.join(", ");
                        let message = format!("{names}: put_down needs into or onto");
                        return Err(PlanError::Table(message));
                    }
                    [object].into_iter().chain(into).chain(onto).collect()
                }
                Primitive::Detach { effector, holder } => {
                    [effector].into_iter().chain(holder).collect()
                }
                Primitive::CreateKit { kit, tray } => vec![kit, tray],
                Primitive::Dwell(seconds) if !(seconds.is_finite() && *seconds >= 0.0) => {
                    return Err(PlanError::Table(format!("dwell of {seconds} s")));
                }
                _ => Vec::new(),
            };
            if let Some(unknown) = used.into_iter().find(|name| !self.arguments.contains(name)) {
                let names = self.names.join(", ");
                return Err(PlanError::Table(format!(
                    "{names}: no argument is called {unknown}"
                )));
            }
        }
        Ok(())
    }
}

/// The state of turning an action into commands; only a copy of the model is changed.
struct Work<'a> {
    objects: BTreeMap<&'a str, &'a str>,
    model: Model,
    options: &'a RobotOptions,
    batch: Batch,
}

impl Work<'_> {
    fn name<'n>(&'n self, argument: &'n str) -> &'n str {
        self.objects.get(argument).copied().unwrap_or(argument)
    }

    /// The object, whose name may differ in capitals from the plan's.
    fn object(&self, argument: &str) -> Result<&Object, PlanError> {
        let name = self.name(argument);
        let folded = |object: &&Object| object.name.eq_ignore_ascii_case(name);
        let found = self
            .model
            .named(name)
            .or_else(|| self.model.objects().find(folded));
        found.ok_or_else(|| PlanError::NoObject(name.to_owned()))
    }

    fn robot(&self) -> Robot<'_> {
        Robot {
            model: &self.model,
            options: self.options,
        }
    }

    /// Adds commands and takes their effects for done.
    fn add(&mut self, part: Batch) -> Result<(), PlanError> {
        self.model.apply_all(&part.changes)?;
        let offset = self.batch.commands.len();
        self.batch
            .tools
            .extend(part.tools.into_iter().map(|(at, tool)| (at + offset, tool)));
        self.batch.commands.extend(part.commands);
        self.batch.changes.extend(part.changes);
        Ok(())
    }

    fn command(&mut self, command: Command) {
        self.batch.push(command);
    }

    fn execute(&mut self, primitive: &Primitive) -> Result<(), PlanError> {
        match primitive {
            Primitive::Message(text) => {
                let mut text = text.clone();
                for (argument, object) in &self.objects {
                    text = text.replace(&format!("{{{argument}}}"), object);
                }
                self.command(Command::Message { text });
                Ok(())
            }
            Primitive::Dwell(seconds) => {
                self.command(Command::Dwell { seconds: *seconds });
                Ok(())
            }
            Primitive::OpenGripper {} => {
                self.command(Command::OpenGripper);
                Ok(())
            }
            Primitive::CloseGripper {} => {
                self.command(Command::CloseGripper);
                Ok(())
            }
            Primitive::MoveAbove(object) => {
                let pose = self.model.workstation_from(self.object(object)?.id)?;
                let part = self.robot().move_above(&pose)?;
                self.add(part)
            }
            Primitive::PickUp(object) => {
                let part = self.robot().pick_up(self.object(object)?.id)?;
                self.add(part)
            }
            Primitive::PutDown { object, into, onto } => {
                let place = into.as_ref().or(onto.as_ref()).map_or("", String::as_str);
                self.put_down(object, place)
            }
            Primitive::Attach(effector) => {
                let effector = self.object(effector)?;
                let mut part = Batch::default();
                if let Some(present) = self.model.effector() {
                    let why = format!("the arm already has {}", present.name);
                    return Err(PlanError::Statement {
                        statement: "attach".into(),
                        why,
                    });
                }
                part.push(Command::OpenToolChanger);
                self.robot().attach(&mut part, effector)?;
                self.add(part)
            }
            Primitive::Detach { effector, holder } => self.detach(effector, holder.as_deref()),
            Primitive::CreateKit { kit, tray } => self.create_kit(kit, tray),
        }
    }

    fn detach(&mut self, effector: &str, holder: Option<&str>) -> Result<(), PlanError> {
        let effector = self.object(effector)?;
        let fail = |why: String| PlanError::Statement {
            statement: "detach".into(),
            why,
        };
        if self.model.effector().map(|present| present.id) != Some(effector.id) {
            return Err(fail(format!("{} is not on the arm", effector.name)));
        }
        if let Some(held) = self.model.held() {
            return Err(fail(format!("the gripper still holds {}", held.name)));
        }
        let mut part = Batch::default();
        match holder.map(|holder| self.object(holder)).transpose()? {
            None => self.robot().detach(&mut part, effector)?,
            Some(holder) => {
                if let Some(other) = self.model.children(holder.id).next() {
                    return Err(fail(format!(
                        "{} already holds {}",
                        holder.name, other.name
                    )));
                }
                self.robot().detach_into(&mut part, effector, holder)?;
            }
        }
        self.add(part)
    }

    /// Into a free slot of the kit's design, on top of what is in a box, or onto a table's middle.
    fn put_down(&mut self, object: &str, place: &str) -> Result<(), PlanError> {
        let (object, place) = (self.object(object)?, self.object(place)?);
        let at = self.model.workstation_from(place.id)?;
        let pose = match place.class {
            Class::KitInstance => at * self.free_slot(place, object)?,
            Class::WorkTable => {
                let height = self.model.shape(place).map_or(0.0, |shape| shape.height);
                at * Isometry3::translation(0.0, 0.0, height)
            }
            _ => {
                let mut free = at;
                free.translation.z = self.model.free_height(place.id, &at, object.id)?;
                free
            }
        };
        let (id, above) = (object.id, self.robot().move_above(&pose)?);
        self.add(above)?;
        let (part, _) = self.robot().put_down(id, &pose)?;
        self.add(part)
    }

    fn free_slot(&self, kit: &Object, part: &Object) -> Result<Isometry3<f64>, PlanError> {
        let design = kit.sku().and_then(|id| self.model.design(id));
        let design = design.ok_or_else(|| PlanError::Missing(format!("design of {}", kit.name)))?;
        let taken = |slot: &Isometry3<f64>| {
            self.model.children(kit.id).any(|child| {
                let away = child.location.pose.translation.vector - slot.translation.vector;
                child.class == Class::Part && away.norm() < 1e-3
            })
        };
        let fits = |slot: &&crate::world::DesignPart| {
            Some(slot.sku.as_str()) == part.sku() && !taken(&slot.pose)
        };
        let slot = design.parts.iter().find(fits).map(|slot| slot.pose);
        slot.ok_or_else(|| PlanError::Statement {
            statement: "put_down".into(),
            why: format!("{} has no free place for {}", kit.name, part.name),
        })
    }

    fn create_kit(&mut self, kit: &str, tray: &str) -> Result<(), PlanError> {
        let (name, tray) = (self.name(kit).to_owned(), self.object(tray)?);
        let design = self
            .model
            .designs()
            .find(|d| Some(d.tray_sku.as_str()) == tray.sku());
        let design = design.ok_or_else(|| {
            PlanError::Missing(format!("kit design for a tray like {}", tray.name))
        })?;
        let (design, tray, location) = (design.id.clone(), tray.id, tray.location);
        let id = self.model.fresh();
        let object = Object::kit(id, name, location, design);
        let location = Location::pose(id, Isometry3::identity());
        let changes = vec![
            Change::Create(object),
            Change::Place {
                object: tray,
                location,
            },
        ];
        self.add(Batch {
            changes,
            ..Batch::default()
        })
    }
}
