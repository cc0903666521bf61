//! The factotum: an agent outside the workstation that brings and takes things.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::batch::{Errand, Request};
use super::eval::matches;
use crate::PlanError;
use crate::kitting::ast::{Keyword, Plan};
use crate::world::reader::{pose_from_text, pose_to_text};
use crate::world::{Change, Class, Location, Model, Object, ObjectId, Relation, Scalar};

/// What the factotum did to the world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delivery {
    /// Changes of the world.
    pub changes: Vec<Change>,
    /// The object it brought.
    pub object: Option<ObjectId>,
    /// How long it took (s).
    pub seconds: f64,
}

/// What the factotum says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FactotumStatus {
    /// Ready, after this many requests.
    Ready(usize),
    /// The last request failed.
    Failed(String),
}

/// The agent that replaces, removes and refills. The controller commits its changes.
pub trait Factotum {
    /// Executes a request.
    ///
    /// # Errors
    /// The reason why it failed; then nothing has changed.
    fn perform(
        &mut self,
        model: &Model,
        plan: &Plan,
        request: &Request,
    ) -> Result<Delivery, String>;

    /// The changes that a request would make, without making them.
    ///
    /// # Errors
    /// As [`Factotum::perform`].
    fn preview(&self, model: &Model, plan: &Plan, request: &Request) -> Result<Delivery, String>;

    /// Its status.
    fn status(&self) -> FactotumStatus;
}

/// Objects to bring, one supply per requirement, as they were before the plan started.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stock {
    supplies: BTreeMap<String, Vec<Item>>,
}

/// An object of a supply; the first of a list is the supply itself, with its location.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Item {
    stem: String,
    class: String,
    /// Position in the list of the object it is located relative to; none for the supply itself.
    parent: Option<usize>,
    /// Name of the reference object of the supply itself.
    reference: String,
    relation: String,
    pose: String,
    properties: BTreeMap<String, Scalar>,
}

impl Stock {
    /// One supply for each requirement of the plan: a copy of the first object that meets it.
    #[must_use]
    pub fn of(model: &Model, plan: &Plan) -> Self {
        let mut stock = Self::default();
        for requirement in &plan.requirements {
            let place = requirement.location.unwrap_or(Keyword::Workstation);
            let found = model
                .objects()
                .find(|o| matches(model, plan, requirement, o, place));
            if let Some(object) = found {
                stock
                    .supplies
                    .insert(requirement.name.clone(), copy(model, object.id));
            }
        }
        stock
    }

    /// Takes the contents out of a supply, so that the factotum brings it empty.
    pub fn empty(&mut self, requirement: &str) {
        if let Some(items) = self.supplies.get_mut(requirement) {
            let vessel = |item: &Item| item.parent.is_none() || item.class == "PartsTray";
            let keep: Vec<Item> = items.iter().filter(|item| vessel(item)).cloned().collect();
            *items = keep;
        }
    }

    fn find(&self, model: &Model, request: &Request) -> Option<&[Item]> {
        if let Some(name) = &request.requirement {
            return self.supplies.get(name).map(Vec::as_slice);
        }
        let object = model.object(request.object?).ok()?;
        let alike = |items: &&Vec<Item>| {
            items.first().is_some_and(|item| {
                let sku = object
                    .class
                    .sku_property()
                    .and_then(|p| item.properties.get(p));
                item.class == object.class.name() && sku.and_then(Scalar::text) == object.sku()
            })
        };
        self.supplies.values().find(alike).map(Vec::as_slice)
    }
}

fn copy(model: &Model, root: ObjectId) -> Vec<Item> {
    let members = model.subtree(root);
    let item = |id: &ObjectId| {
        let object = model.object(*id).ok()?;
        let reference = model.object(object.location.reference).ok()?;
        Some(Item {
            stem: object
                .name
                .trim_end_matches(|c: char| c == '_' || c.is_ascii_digit())
                .to_owned(),
            class: object.class.name().to_owned(),
            parent: members
                .iter()
                .position(|m| *m == reference.id)
                .filter(|_| *id != root),
            reference: reference.name.clone(),
            relation: object.location.relation.name().to_owned(),
            pose: pose_to_text(&object.location.pose),
            properties: object.properties.clone(),
        })
    };
    members.iter().filter_map(item).collect()
}

/// A simulated factotum: it executes requests at once, from an unlimited stock unless limits are
/// set.
#[derive(Clone, Debug)]
pub struct SimulatedFactotum {
    /// What it brings.
    pub stock: Stock,
    /// How long a request takes (s).
    pub seconds: f64,
    /// How often it still brings the supply of a requirement; without an entry, always.
    pub limits: BTreeMap<String, usize>,
    errands: usize,
    failure: Option<String>,
}

impl SimulatedFactotum {
    /// A factotum with this stock, 5 s per request.
    #[must_use]
    pub fn new(stock: Stock) -> Self {
        Self {
            stock,
            seconds: 5.0,
            limits: BTreeMap::new(),
            errands: 0,
            failure: None,
        }
    }

    fn deliver(&self, model: &Model, request: &Request) -> Result<Delivery, String> {
        let text = |error: PlanError| error.to_string();
        let mut changes = Vec::new();
        let mut model = model.clone();
        let mut place = None;
        if request.errand != Errand::Refill {
            let id = request.object.ok_or("there is nothing to take away")?;
            place = Some(model.object(id).map_err(text)?.location);
            for member in model.subtree(id).into_iter().rev() {
                changes.push(Change::Delete(member));
            }
            model.apply_all(&changes).map_err(text)?;
        }
        if request.errand == Errand::Remove {
            return Ok(Delivery {
                changes,
                object: None,
                seconds: self.seconds,
            });
        }
        let name = request.requirement.clone().unwrap_or_default();
        if self.limits.get(&name) == Some(&0) {
            return Err(format!("there are no more supplies for {name}"));
        }
        let items = self
            .stock
            .find(&model, request)
            .ok_or_else(|| format!("nothing in store for {}", request.variable))?;
        let created = create(&mut model, items, place).map_err(text)?;
        let object = created.first().map(|object| object.id);
        changes.extend(created.into_iter().map(Change::Create));
        Ok(Delivery {
            changes,
            object,
            seconds: self.seconds,
        })
    }
}

/// New objects like the items, the first at `place` or where it stood.
fn create(
    model: &mut Model,
    items: &[Item],
    place: Option<Location>,
) -> Result<Vec<Object>, PlanError> {
    let mut created: Vec<Object> = Vec::new();
    for item in items {
        let class: Class = item.class.parse().map_err(PlanError::Value)?;
        let relation = Relation::from_name(&item.relation).unwrap_or(Relation::Pose);
        let pose: Isometry3<f64> = pose_from_text(&item.pose, &item.stem)?;
        let parent = item
            .parent
            .and_then(|parent| created.get(parent))
            .map(|parent| parent.id);
        let location = match (parent, place) {
            (Some(reference), _) => Location {
                reference,
                relation,
                pose,
            },
            (None, Some(place)) => place,
            (None, None) => {
                let reference = model.named(&item.reference);
                let missing = || PlanError::NoObject(item.reference.clone());
                Location {
                    reference: reference.ok_or_else(missing)?.id,
                    relation,
                    pose,
                }
            }
        };
        let name = model.free_name(&item.stem);
        let mut object = Object::new(model.fresh(), name, class, location);
        object.properties.clone_from(&item.properties);
        model.apply(&Change::Create(object.clone()))?;
        created.push(object);
    }
    Ok(created)
}

impl Factotum for SimulatedFactotum {
    fn perform(&mut self, model: &Model, _: &Plan, request: &Request) -> Result<Delivery, String> {
        let result = self.deliver(model, request);
        self.failure = result.as_ref().err().cloned();
        if result.is_ok() {
            self.errands += 1;
            let limit = request
                .requirement
                .as_ref()
                .and_then(|name| self.limits.get_mut(name));
            if let Some(limit) = limit
                && request.errand != Errand::Remove
            {
                *limit = limit.saturating_sub(1);
            }
        }
        result
    }

    fn preview(&self, model: &Model, _: &Plan, request: &Request) -> Result<Delivery, String> {
        self.deliver(model, request)
    }

    fn status(&self) -> FactotumStatus {
        match &self.failure {
            Some(reason) => FactotumStatus::Failed(reason.clone()),
            None => FactotumStatus::Ready(self.errands),
        }
    }
}
