//! The state of the workstation in memory: what the database holds, and questions about it.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry3;

use super::{BoxVolume, Change, Class, Design, Location, Object, ObjectId, Sku, Units};
use crate::PlanError;

/// Longest location chain that is followed.
const LONGEST_CHAIN: usize = 64;

/// A snapshot of the world. Cloning is cheap: objects are shared until they change.
///
/// It has no connection to the database; changes of it stay in memory. Only
/// [`super::Writer::commit`] changes the database.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Units of files and of the literals of plans. The model itself is in metres and radians.
    pub units: Units,
    /// Where the end of the arm was after the last motion, in the frame of the workstation (m).
    pub arm: Option<Isometry3<f64>>,
    /// Number for the next new object.
    pub next: i64,
    /// Counts the commits of the database this was read from.
    pub revision: i64,
    pub(crate) objects: BTreeMap<ObjectId, Arc<Object>>,
    pub(crate) skus: Arc<BTreeMap<String, Sku>>,
    pub(crate) designs: Arc<BTreeMap<String, Design>>,
    pub(crate) volumes: Arc<Vec<BoxVolume>>,
}

impl Model {
    /// All objects in the order in which they came into the world.
    pub fn objects(&self) -> impl Iterator<Item = &Object> {
        self.objects.values().map(Arc::as_ref)
    }

    /// The object of this number.
    ///
    /// # Errors
    /// [`PlanError::NoObject`] when it is not (or no longer) there.
    pub fn object(&self, id: ObjectId) -> Result<&Object, PlanError> {
        self.objects
            .get(&id)
            .map(Arc::as_ref)
            .ok_or_else(|| PlanError::NoObject(format!("number {}", id.0)))
    }

    /// The object of this name, or of this robot or end effector id.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Object> {
        self.objects()
            .find(|object| object.name == name)
            .or_else(|| self.objects().find(|object| object.is_called(name)))
    }

    /// Stock keeping units by id.
    pub fn skus(&self) -> impl Iterator<Item = &Sku> {
        self.skus.values()
    }

    /// The stock keeping unit of this id.
    #[must_use]
    pub fn sku(&self, id: &str) -> Option<&Sku> {
        self.skus.get(id)
    }

    /// Kit designs by id.
    pub fn designs(&self) -> impl Iterator<Item = &Design> {
        self.designs.values()
    }

    /// The kit design of this id.
    #[must_use]
    pub fn design(&self, id: &str) -> Option<&Design> {
        self.designs.get(id)
    }

    /// Work volumes of the robots.
    #[must_use]
    pub fn volumes(&self) -> &[BoxVolume] {
        &self.volumes
    }

    /// The first object of this class (or below it).
    #[must_use]
    pub fn first_of(&self, class: Class) -> Option<&Object> {
        self.objects().find(|object| object.class.is_a(class))
    }

    /// The workstation, where every location chain ends.
    ///
    /// # Errors
    /// [`PlanError::Missing`] when the model has none.
    pub fn workstation(&self) -> Result<&Object, PlanError> {
        self.first_of(Class::KittingWorkstation)
            .ok_or_else(|| PlanError::Missing("workstation".into()))
    }

    /// The robot.
    ///
    /// # Errors
    /// [`PlanError::Missing`] when the model has none.
    pub fn robot(&self) -> Result<&Object, PlanError> {
        self.first_of(Class::Robot)
            .ok_or_else(|| PlanError::Missing("robot".into()))
    }

    /// Objects located directly relative to `id`, in stored order.
    pub fn children(&self, id: ObjectId) -> impl Iterator<Item = &Object> {
        self.objects()
            .filter(move |object| object.location.reference == id && object.id != id)
    }

    /// `id` and all objects whose location chain leads to it, parents before children.
    #[must_use]
    pub fn subtree(&self, id: ObjectId) -> Vec<ObjectId> {
        let mut found = vec![id];
        let mut next = 0;
        while let Some(&current) = found.get(next) {
            for child in self.children(current) {
                if !found.contains(&child.id) {
                    found.push(child.id);
                }
            }
            next += 1;
        }
        found
    }

    /// Whether the location chain of `id` leads to `ancestor` (an object is not in itself).
    #[must_use]
    pub fn is_within(&self, id: ObjectId, ancestor: ObjectId) -> bool {
        let mut current = id;
        for _ in 0..LONGEST_CHAIN {
            let Some(object) = self.objects.get(&current) else {
                return false;
            };
            let reference = object.location.reference;
            if reference == current {
                return false;
            }
            if reference == ancestor {
                return true;
            }
            current = reference;
        }
        false
    }

    /// `workstation_from_object` (m), composed along the location chain.
    ///
    /// # Errors
    /// [`PlanError::Chain`] for a broken chain, a cycle, or a link without pose.
    pub fn workstation_from(&self, id: ObjectId) -> Result<Isometry3<f64>, PlanError> {
        let mut pose = Isometry3::identity();
        let mut current = id;
        let fail = |why: String| PlanError::Chain {
            object: self
                .objects
                .get(&id)
                .map_or_else(|| id.0.to_string(), |o| o.name.clone()),
            why,
        };
        for _ in 0..LONGEST_CHAIN {
            let Some(object) = self.objects.get(&current) else {
                return Err(fail(format!(
                    "it refers to number {}, which is not there",
                    current.0
                )));
            };
            let location = &object.location;
            if location.reference == current {
                return Ok(pose);
            }
            if !location.relation.has_pose() {
                let relation = location.relation.name();
                return Err(fail(format!(
                    "{} is only known to be {relation} something",
                    object.name
                )));
            }
            pose = location.pose * pose;
            current = location.reference;
        }
        Err(fail(format!(
            "more than {LONGEST_CHAIN} links, so it is a cycle"
        )))
    }

    /// Pose of `id` in the frame of `reference` (m).
    ///
    /// # Errors
    /// As [`Model::workstation_from`].
    pub fn relative(&self, reference: ObjectId, id: ObjectId) -> Result<Isometry3<f64>, PlanError> {
        Ok(self
            .workstation_from(reference)?
            .inv_mul(&self.workstation_from(id)?))
    }

    /// The end effector on the robot's arm.
    #[must_use]
    pub fn effector(&self) -> Option<&Object> {
        let robot = self.robot().ok()?.id;
        self.children(robot)
            .find(|object| object.class.is_a(Class::EndEffector))
    }

    /// What the end effector on the arm holds.
    #[must_use]
    pub fn held(&self) -> Option<&Object> {
        self.effector()
            .and_then(|effector| self.children(effector.id).next())
    }

    /// Number of objects of stock keeping unit (or kit design) `sku` in `container`, through
    /// `levels` levels of containment. The tray or box that a composite is made of is no level.
    #[must_use]
    pub fn count(&self, container: ObjectId, sku: &str, levels: u32) -> usize {
        if levels == 0 {
            return 0;
        }
        let composite = self
            .object(container)
            .is_ok_and(|object| object.class.is_composite());
        self.children(container)
            .map(|child| {
                let itself = usize::from(child.sku() == Some(sku));
                let is_vessel = matches!(
                    child.class,
                    Class::KitTray | Class::PartsTray | Class::LargeContainer
                );
                let below = if composite && is_vessel {
                    levels
                } else {
                    levels - 1
                };
                itself + self.count(child.id, sku, below)
            })
            .sum()
    }

    /// A name that no object has, made from `stem` and the number of the next object.
    #[must_use]
    pub fn free_name(&self, stem: &str) -> String {
        (self.next..)
            .map(|number| format!("{stem}_{number}"))
            .find(|name| self.objects().all(|object| object.name != *name))
            .unwrap_or_else(|| stem.to_owned())
    }

    /// A fresh object number; the next call gives another.
    pub fn fresh(&mut self) -> ObjectId {
        let id = ObjectId(self.next);
        self.next += 1;
        id
    }

    /// The changes that record that the end of the arm rests at `pose` (m, frame of the
    /// workstation): the arm itself and the end effector that it carries.
    ///
    /// # Errors
    /// [`PlanError::Missing`] without a robot, [`PlanError::Chain`] when its place is unknown.
    pub fn arm_changes(&self, pose: &Isometry3<f64>) -> Result<Vec<Change>, PlanError> {
        let mut changes = vec![Change::Arm(*pose)];
        if let Some(effector) = self.effector() {
            let robot = self.robot()?.id;
            let pose = self.workstation_from(robot)?.inv_mul(pose);
            let location = Location::pose(robot, pose);
            changes.push(Change::Place {
                object: effector.id,
                location,
            });
        }
        Ok(changes)
    }

    /// Applies one change in memory.
    ///
    /// # Errors
    /// [`PlanError`] when the change does not fit: unknown object, name or number taken, objects
    /// left behind. The model is then unchanged.
    pub fn apply(&mut self, change: &Change) -> Result<(), PlanError> {
        match change {
            Change::Create(object) => self.create(object),
            Change::Delete(id) => {
                let name = self.object(*id)?.name.clone();
                if let Some(child) = self.children(*id).next() {
                    let why = format!("{} is still located relative to it", child.name);
                    return Err(PlanError::Chain { object: name, why });
                }
                self.objects.remove(id);
                Ok(())
            }
            Change::Place { object, location } => {
                self.object(location.reference)?;
                if location.reference == *object || self.is_within(location.reference, *object) {
                    let name = self.object(*object)?.name.clone();
                    let why = "it would be located relative to itself".into();
                    return Err(PlanError::Chain { object: name, why });
                }
                self.change(*object, |object| object.location = *location)
            }
            Change::Set {
                object,
                property,
                value,
            } => self.change(*object, |object| {
                object.properties.insert(property.clone(), value.clone());
            }),
            Change::Arm(pose) => {
                self.arm = Some(*pose);
                Ok(())
            }
        }
    }

    fn create(&mut self, object: &Object) -> Result<(), PlanError> {
        if self.objects.contains_key(&object.id)
            || self.objects().any(|other| other.name == object.name)
        {
            return Err(PlanError::DuplicateName(object.name.clone()));
        }
        if object.location.reference != object.id {
            self.object(object.location.reference)?;
        }
        self.next = self.next.max(object.id.0 + 1);
        self.objects.insert(object.id, Arc::new(object.clone()));
        Ok(())
    }

    fn change(&mut self, id: ObjectId, edit: impl FnOnce(&mut Object)) -> Result<(), PlanError> {
        let shared = self
            .objects
            .get_mut(&id)
            .ok_or_else(|| PlanError::NoObject(format!("number {}", id.0)))?;
        edit(Arc::make_mut(shared));
        Ok(())
    }

    /// Applies a list of changes; all of them or none.
    ///
    /// # Errors
    /// As [`Model::apply`].
    pub fn apply_all(&mut self, changes: &[Change]) -> Result<(), PlanError> {
        let mut next = self.clone();
        for change in changes {
            next.apply(change)?;
        }
        *self = next;
        Ok(())
    }
}
