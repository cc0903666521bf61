//! Plans executed with a simulated arm.

use std::collections::BTreeMap;
use std::path::Path;

use plan::finding::Severity;
use plan::run::{
    Cell, Controller, Event, PlanRunReport, Policy, RunOptions, SimulatedFactotum, SimulatedMotion,
    Stock, prepare,
};
use plan::world::{Class, Durability, Model, Reader, Scalar, Writer, check, import_toml};

use crate::fixtures::repository_text;

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
    pub(crate) report: PlanRunReport,
    pub(crate) world: Model,
    pub(crate) events: Vec<Event>,
}

impl Trial {
    pub(crate) fn new(source: &str, world: &str, kits: usize) -> Self {
        Self {
            source: source.to_owned(),
            world: import_toml(&repository_text(world)).unwrap(),
            kits,
            motion: SimulatedMotion {
                reach: Some(0.85),
                ..SimulatedMotion::default()
            },
            options: RunOptions::default(),
            adjust: |_| {},
        }
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
        let report = controller
            .run(&mut |event| events.push(event.clone()))
            .unwrap();
        drop(controller);
        let world = read_world(&path);
        Result {
            report,
            world,
            events,
        }
    }
}

pub(crate) fn read_world(path: &Path) -> Model {
    Reader::open(path).unwrap().model().unwrap()
}

/// No error in the world.
pub(crate) fn assert_consistent(world: &Model) {
    let errors: Vec<_> = check(world)
        .into_iter()
        .filter(|c| c.severity == Severity::Error)
        .collect();
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
        let mut parts: Vec<_> = world
            .children(kit.id)
            .filter(|c| c.class == Class::Part)
            .collect();
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
    names
        .iter()
        .map(|n| if n == "TrayGripper" { "tray" } else { "part" })
        .collect()
}

fn assert_three_kits(result: &Result) {
    let Result {
        report,
        world,
        events,
    } = result;
    assert_eq!((report.outcome, report.code), ("stopped", 0), "{report:#?}");
    let counters = &report.counters;
    assert_eq!(
        (
            counters.pick_ups,
            counters.put_downs,
            counters.moves_above,
            counters.kits
        ),
        (18, 18, 36, 3)
    );
    // The tray gripper that brought a kit to its box takes the next tray.
    assert_eq!(
        effectors(events),
        ["tray", "part", "tray", "part", "tray", "part", "tray"]
    );
    assert_kits(world, 3);
    assert_consistent(world);
    let full = world.named("BoxOfKits").unwrap().id;
    assert_eq!(world.count(full, "kitABC", 1), 3);
}

/// A plan makes three kits.
#[test]
fn our_plan_makes_three_kits() {
    let result = Trial::own(3).run();
    assert_three_kits(&result);
}

/// Twelve kits fill a box; supplies run empty meanwhile and are replaced in both ways.
#[test]
fn supplies_are_refilled_and_a_box_fills() {
    for trial in [Trial::own(12)] {
        let Result {
            report,
            world,
            events,
        } = trial.run();
        assert_eq!(report.outcome, "stopped", "{report:#?}");
        assert_eq!(report.counters.kits, 12);
        let count = |wanted: &str| {
            let is =
                |event: &&Event| matches!(event, Event::Statement { name, .. } if *name == wanted);
            events.iter().filter(is).count()
        };
        // 24 PartA out of trays of 8, 12 of each other out of trays of 6.
        assert_eq!(count("DestroyInstance"), 2);
        assert_eq!((count("FactotumRemove"), count("FactotumRefill")), (2, 2));
        assert_eq!(count("FactotumReplace"), 2);
        let full = world.named("BoxOfKits").unwrap().id;
        assert_eq!(world.count(full, "kitABC", 1), 12);
        assert_kits(&world, 12);
        assert_consistent(&world);
    }
}

/// The thirteenth kit needs another box for kits and another box of trays.
#[test]
fn full_and_empty_boxes_are_replaced() {
    for trial in [Trial::own(13)] {
        let Result { report, world, .. } = trial.run();
        assert_eq!(
            (report.outcome, report.counters.kits),
            ("stopped", 13),
            "{report:#?}"
        );
        assert_kits(&world, 1);
        assert_consistent(&world);
        let boxes = world
            .objects()
            .filter(|o| o.class == Class::LargeContainer)
            .count();
        assert_eq!(boxes, 2, "boxes are replaced, not added");
        let trays = world.objects().filter(|o| {
            o.class == Class::KitTray
                && world.object(o.location.reference).unwrap().class == Class::LargeContainer
        });
        assert_eq!(trays.count(), 11);
    }
}

/// A factotum that brings an empty tray makes the plan give up; one that brings nothing ends it.
#[test]
fn failed_refills_end_the_plan_with_a_positive_reason() {
    let names = ["partASupplyRequirement", "supply of A"];
    for mut trial in [Trial::own(6)] {
        trial.adjust = |factotum| {
            for name in ["partASupplyRequirement", "supply of A"] {
                factotum.stock.empty(name);
            }
        };
        let Result { report, world, .. } = trial.run();
        assert_eq!((report.outcome, report.code), ("failed", 1), "{report:#?}");
        assert!(report.reason.unwrap().contains("Quit"));
        assert_eq!(report.counters.kits, 4);
        assert_consistent(&world);
    }
    for mut trial in [Trial::own(6)] {
        trial.adjust = |factotum| {
            factotum.limits = ["partASupplyRequirement", "supply of A"]
                .map(|n| (n.to_owned(), 0))
                .into();
        };
        let Result { report, world, .. } = trial.run();
        assert_eq!((report.outcome, report.code), ("failed", 4), "{report:#?}");
        let reason = report.reason.unwrap();
        assert!(names.iter().any(|name| reason.contains(name)), "{reason}");
        assert_consistent(&world);
    }
}

/// A motion that fails changes nothing in the world: every command of the first kit, one by one.
#[test]
fn no_change_without_its_motion() {
    let whole = Trial::own(1).run().report.counters.commands;
    for at in 4..whole {
        let mut trial = Trial::own(1);
        trial.motion.failures = vec![at];
        let Result {
            report,
            world,
            events,
        } = trial.run();
        assert_eq!(
            (report.outcome, report.code),
            ("failed", 3),
            "command {at}: {report:#?}"
        );
        assert_consistent(&world);
        let put_downs = events
            .iter()
            .filter(|e| {
                matches!(
                    e,
                    Event::Statement {
                        name: "RobotPutDown",
                        ..
                    }
                )
            })
            .count();
        let in_kit = world
            .objects()
            .filter(|o| {
                o.class == Class::Part
                    && world.object(o.location.reference).unwrap().class == Class::KitInstance
            })
            .count();
        assert_eq!(in_kit, put_downs.saturating_sub(1).min(4), "command {at}");
    }
}

/// A run in which the arm failed is resumed where it was, with the same result; one that ended is
/// not.
#[test]
fn a_failed_run_is_resumed() {
    let good = Trial::own(1).run();
    for at in [10, 25, 40, 60] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world.db");
        let trial = Trial::own(1);
        let mut writer = Writer::open(&path, Durability::Process).unwrap();
        writer.replace(&trial.world).unwrap();
        let stock = Stock::of(
            &trial.world,
            &prepare(&trial.source, &trial.world).unwrap().0.plan,
        );
        let mut motion = trial.motion;
        motion.failures = vec![at];
        let mut factotum = SimulatedFactotum::new(stock.clone());
        let cell = Cell {
            writer,
            reader: Reader::open(&path).unwrap(),
            motion: &mut motion,
            factotum: &mut factotum,
        };
        let given = BTreeMap::from([("NumberOfKitsToMake".to_owned(), "1".to_owned())]);
        let options = RunOptions::default();
        let start = Controller::start(cell, &trial.source, &given, &stock, options.clone());
        let failed = start.unwrap().run(&mut |_| {}).unwrap();
        assert_eq!((failed.outcome, failed.code), ("failed", 3), "{failed:#?}");
        let mut resume = || {
            let cell = Cell {
                writer: Writer::open(&path, Durability::Process).unwrap(),
                reader: Reader::open(&path).unwrap(),
                motion: &mut motion,
                factotum: &mut factotum,
            };
            Controller::resume(cell, options.clone()).map(|mut run| run.run(&mut |_| {}).unwrap())
        };
        let report = resume().unwrap();
        assert_eq!(
            (report.outcome, report.counters.pick_ups),
            ("stopped", 6),
            "{report:#?}"
        );
        crate::world::assert_same(&good.world, &read_world(&path));
        let again = resume().unwrap_err().to_string();
        assert!(again.contains("came to its end"), "{again}");
    }
}

/// With repair, the same failures cost time and nothing else.
#[test]
fn failures_are_repaired() {
    let good = Trial::own(1).run();
    for at in [10, 25, 40, 60] {
        let mut trial = Trial::own(1);
        trial.motion.failures = vec![at];
        trial.options.policy = Policy::Repair { attempts: 1 };
        let Result {
            report,
            world,
            events,
        } = trial.run();
        assert_eq!(
            (report.outcome, report.counters.kits),
            ("stopped", 1),
            "{report:#?}"
        );
        assert_eq!(
            events
                .iter()
                .filter(|e| matches!(e, Event::Retry(_)))
                .count(),
            1
        );
        crate::world::assert_same(&good.world, &world);
    }
}
