//! Plans executed with a simulated arm.

use std::collections::BTreeMap;
use std::path::Path;

use plan::finding::Severity;
use plan::run::{
    Cell, Controller, Event, Policy, Report, RunOptions, SimulatedFactotum, SimulatedMotion, Stock,
    prepare,
};
use plan::world::{Class, Durability, Model, Reader, Scalar, Writer, check, import_toml};

use crate::fixtures::repository_text;
use crate::reading::document_plan;

/// A run of a plan in a fresh copy of a world.
pub(crate) struct Trial {
    pub(crate) source: String,
    pub(crate) world: Model,
    pub(crate) kits: usize,
    pub(crate) motion: SimulatedMotion,
    pub(crate) options: RunOptions,
    pub(crate) adjust: fn(&mut SimulatedFactotum),
}

/// What came of it.
pub(crate) struct Result {
    pub(crate) report: Report,
    pub(crate) world: Model,
    pub(crate) events: Vec<Event>,
}

impl Trial {
    pub(crate) fn new(source: &str, world: &str, kits: usize) -> Self {
        Self {
            source: source.to_owned(),
            world: import_toml(&repository_text(world)).unwrap(),
            kits,
            motion: SimulatedMotion { reach: Some(0.85), ..SimulatedMotion::default() },
            options: RunOptions::default(),
            adjust: |_| {},
        }
    }

    /// The plan of the original document in its workstation.
    pub(crate) fn document(kits: usize) -> Option<Self> {
        let world = "examples/kitting/workstation-kitABCPlan.toml";
        Some(Self::new(&document_plan()?, world, kits))
    }

    /// The repository's own plan in its workstation.
    pub(crate) fn own(kits: usize) -> Self {
        let source = repository_text("examples/kitting/kit-abc.plan");
        Self::new(&source, "examples/kitting/workstation.toml", kits)
    }

    pub(crate) fn run(mut self) -> Result {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world.db");
        let mut writer = Writer::open(&path, Durability::Process).unwrap();
        writer.replace(&self.world).unwrap();
        let (program, _) = prepare(&self.source, &self.world).unwrap();
        let stock = Stock::of(&self.world, &program.plan);
        let mut factotum = SimulatedFactotum::new(stock.clone());
        (self.adjust)(&mut factotum);
        let cell = Cell {
            writer,
            reader: Reader::open(&path).unwrap(),
            motion: &mut self.motion,
            factotum: &mut factotum,
        };
        let given = BTreeMap::from([("NumberOfKitsToMake".to_owned(), self.kits.to_string())]);
        let mut controller =
            Controller::start(cell, &self.source, &given, &stock, self.options).unwrap();
        let mut events = Vec::new();
        let report = controller.run(&mut |event| events.push(event.clone())).unwrap();
        drop(controller);
        let world = read_world(&path);
        Result { report, world, events }
    }
}

pub(crate) fn read_world(path: &Path) -> Model {
    Reader::open(path).unwrap().model().unwrap()
}

/// No error in the world.
pub(crate) fn assert_consistent(world: &Model) {
    let errors: Vec<_> =
        check(world).into_iter().filter(|c| c.severity == Severity::Error).collect();
    assert!(errors.is_empty(), "{errors:#?}");
}

/// Every finished kit is in the box and has each part at its place in the design.
pub(crate) fn assert_kits(world: &Model, kits: usize) {
    let design = world.design("kitABC").unwrap();
    let finished = |o: &&plan::world::Object| {
        o.properties.get("isKitInstance_Finished") == Some(&Scalar::Truth(true))
    };
    let found: Vec<_> = world.objects().filter(finished).collect();
    assert_eq!(found.len(), kits);
    for kit in found {
        let holder = world.object(kit.location.reference).unwrap();
        assert_eq!(holder.class, Class::LargeContainer);
        let mut parts: Vec<_> = world.children(kit.id).filter(|c| c.class == Class::Part).collect();
        assert_eq!(parts.len(), design.parts.len());
        for wanted in &design.parts {
            let near = parts.iter().position(|part| {
                let difference = part.location.pose.inv_mul(&wanted.pose);
                part.sku() == Some(&wanted.sku)
                    && difference.translation.vector.norm() < 1e-6
                    && difference.rotation.angle() < 1e-6
            });
            parts.remove(near.expect("a part at its place"));
        }
    }
}

fn effectors(events: &[Event]) -> Vec<&str> {
    let name = |event: &'_ Event| match event {
        Event::EndEffector(name) => Some(name.clone()),
        _ => None,
    };
    let names: Vec<String> = events.iter().filter_map(name).collect();
    names.iter().map(|n| if n == "TrayGripper" { "tray" } else { "part" }).collect()
}

fn assert_three_kits(result: &Result) {
    let Result { report, world, events } = result;
    assert_eq!((report.outcome, report.code), ("stopped", 0), "{report:#?}");
    let counters = &report.counters;
    assert_eq!(
        (counters.pick_ups, counters.put_downs, counters.moves_above, counters.kits),
        (18, 18, 36, 3)
    );
    // The tray gripper that brought a kit to its box takes the next tray.
    assert_eq!(effectors(events), ["tray", "part", "tray", "part", "tray", "part", "tray"]);
    assert_kits(world, 3);
    assert_consistent(world);
    let full = world.named("BoxOfKits").unwrap().id;
    assert_eq!(world.count(full, "kitABC", 1), 3);
}

/// The document's plan as it stands makes three kits.
#[test]
fn the_document_makes_three_kits() {
    let Some(trial) = Trial::document(3) else { return };
    let result = trial.run();
    assert_three_kits(&result);
    assert!(result.report.warnings.iter().any(|warning| warning.contains("on top of what is in")));
}

/// Our own plan does the same in our own workstation.
#[test]
fn our_plan_makes_three_kits() {
    let result = Trial::own(3).run();
    assert_three_kits(&result);
}
