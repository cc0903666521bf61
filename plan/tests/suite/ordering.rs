//! Lists that leave the order open.

use plan::run::{Counters, Event, RunOutcome, SimulatedMotion};
use plan::world::{Change, Location, Model};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, RngSeed, TestRng, TestRunner};

use crate::running::Trial;

fn config(cases: u32) -> Config {
    Config {
        cases,
        rng_seed: RngSeed::Fixed(20_261_121),
        failure_persistence: None,
        ..Config::default()
    }
}

/// The workstation with its three supplies in any order along the table, each pushed about a
/// little; the kit's box and the trays stay.
fn scattered(random: &mut impl FnMut() -> f64) -> Model {
    let mut world = Trial::own(1).world;
    let mut places = [-0.21, 0.0, 0.21];
    for last in (1..3).rev() {
        places.swap(last, (random() * (last + 1) as f64) as usize % (last + 1));
    }
    for (name, y) in ["SupplyA", "SupplyB", "SupplyC"].into_iter().zip(places) {
        let supply = world.named(name).unwrap();
        let mut pose = supply.location.pose;
        pose.translation.x += 0.06 * (random() - 0.5);
        pose.translation.y = y + 0.04 * (random() - 0.5);
        let location = Location {
            pose,
            ..supply.location
        };
        let object = supply.id;
        world.apply(&Change::Place { object, location }).unwrap();
    }
    world
}

/// One kit in a world, and the lines of the plan in the order in which they were executed.
fn run_in(world: &Model, choose: bool) -> (Counters, Vec<usize>) {
    let mut trial = Trial::own(1);
    trial.world = world.clone();
    trial.options.choose_order = choose;
    let result = trial.run();
    let report = result.report;
    assert_eq!(report.outcome, RunOutcome::Stopped, "{report:#?}");
    let line = |event: &Event| match event {
        Event::Statement { line, .. } => Some(*line),
        _ => None,
    };
    let order = result.events.iter().filter_map(line).collect();
    (report.counters, order)
}

/// On 100 random layouts the chosen order is never slower than the written one.
#[test]
fn chosen_orders_are_never_slower() {
    let mut rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut random = move || f64::from(rng.next_u32()) / f64::from(u32::MAX);
    let (mut written_s, mut chosen_s) = (0.0, 0.0);
    let (mut better, mut changed) = (0, 0);
    for layout in 0..100 {
        let world = scattered(&mut random);
        let run = |choose| run_in(&world, choose);
        let ((written, as_written), (chosen, as_chosen)) = (run(false), run(true));
        changed += usize::from(as_written != as_chosen);
        assert!(
            chosen.motion_s <= written.motion_s + 1e-9,
            "layout {layout}: {} > {}",
            chosen.motion_s,
            written.motion_s
        );
        assert!((written.motion_s - chosen.motion_s - chosen.gained_s).abs() < 1e-6);
        written_s += written.motion_s;
        chosen_s += chosen.motion_s;
        better += usize::from(chosen.gained_s > 1e-6);
    }
    println!(
        "100 layouts: {:.2} s a kit as written, {:.2} s as chosen ({:.2} % less), better in {better}",
        written_s / 100.0,
        chosen_s / 100.0,
        100.0 * (1.0 - chosen_s / written_s)
    );
    // An executor that never chooses anything is never slower either.
    assert!(changed >= 20, "only {changed} orders of 100 were changed");
    assert!(better >= 20, "only {better} orders of 100 became faster");
}

/// A plan of moves above random places, as entries with preconditions.
fn precondition_plan(poses: &[(f64, f64)], edges: &[(usize, usize)]) -> String {
    let mut text = String::from(
        "About PlanId = \"p\" PlanWorkstation = \"workstation1\" TargetSKU = \"kitABC\"\n\
         PlanParameters item name = \"NumberOfKitsToMake\" type = \"positiveInteger\" end\n\
         ToDo\nStart()\nDoInPreconditionOrder begin\n",
    );
    for (index, (x, y)) in poses.iter().enumerate() {
        let before: Vec<String> = edges
            .iter()
            .filter(|(_, to)| *to == index)
            .map(|(from, _)| from.to_string())
            .collect();
        text.push_str(&format!(
            "({index} ({}) RobotMoveAbove(Pose(Point({x:.1}, {y:.1}, 0), RollPitchYaw(0, 0, 0), ROBOT)))\n",
            before.join(" ")
        ));
    }
    text.push_str("end\nStop()\n");
    text
}

/// The lines of the executed moves, in the order of their execution.
fn executed(events: &[Event], first_line: usize) -> Vec<usize> {
    let line = |event: &Event| match event {
        Event::Statement { name, line, .. } if name == "RobotMoveAbove" => Some(*line - first_line),
        _ => None,
    };
    events.iter().filter_map(line).collect()
}

/// Every executed order has each entry after all that come before it, and every entry once.
#[test]
fn orders_respect_preconditions() {
    let strategy = (2..6_usize).prop_flat_map(|count| {
        let poses = prop::collection::vec((250.0..600.0_f64, -400.0..400.0_f64), count);
        let edges = prop::collection::vec(any::<bool>(), count * (count - 1) / 2);
        let names = Just((0..count).collect::<Vec<_>>()).prop_shuffle();
        (poses, edges, names)
    });
    let mut runner = TestRunner::new(config(40));
    let test = |(poses, chosen, names): (Vec<(f64, f64)>, Vec<bool>, Vec<usize>)| {
        // Edges go along a random order of the entries, so there is no cycle.
        let pairs = (0..poses.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
        let edges: Vec<(usize, usize)> = pairs
            .zip(&chosen)
            .filter(|(_, chosen)| **chosen)
            .map(|((a, b), _)| (names[a], names[b]))
            .collect();
        let source = precondition_plan(&poses, &edges);
        let mut trial = Trial::new(&source, "examples/kitting/workstation.toml", 1);
        trial.motion = SimulatedMotion::default();
        let result = trial.run();
        prop_assert_eq!(result.report.outcome, RunOutcome::Stopped);
        let order = executed(&result.events, 6);
        prop_assert_eq!(order.len(), poses.len());
        for (before, after) in edges {
            let position = |wanted: usize| order.iter().position(|index| *index == wanted).unwrap();
            prop_assert!(
                position(before) < position(after),
                "{:?} {:?}",
                order,
                source
            );
        }
        Ok(())
    };
    runner.run(&strategy, test).unwrap();
}

/// Members of an any-order list that share a variable keep their written order.
#[test]
fn orders_respect_conflicts() {
    let strategy = prop::collection::vec(
        (
            (250.0..600.0_f64, -400.0..400.0_f64),
            0..3_usize,
            0..4_usize,
        ),
        2..5,
    );
    let mut runner = TestRunner::new(config(40));
    let test = |members: Vec<((f64, f64), usize, usize)>| {
        let mut source = String::from(
            "About PlanId = \"p\" PlanWorkstation = \"workstation1\" TargetSKU = \"kitABC\"\n\
             PlanParameters item name = \"NumberOfKitsToMake\" type = \"positiveInteger\" end\n\
             InternalVariables item name = \"v0\" type = \"integer\" initialValue = 0 end\n\
             item name = \"v1\" type = \"integer\" initialValue = 0 end\n\
             item name = \"v2\" type = \"integer\" initialValue = 0 end\n\
             ToDo Start() DoInAnyOrder begin\n",
        );
        // Each member reads one variable and writes another (3 stands for none).
        for ((x, y), writes, reads) in &members {
            let read = if *reads < 3 {
                format!("v{reads}")
            } else {
                "0".into()
            };
            source.push_str(&format!(
                "DoInGivenOrder begin Set(v{writes}, {read} + 1) RobotMoveAbove(Pose(Point({x:.1}, {y:.1}, 0), RollPitchYaw(0, 0, 0), ROBOT)) end\n"
            ));
        }
        source.push_str("end Stop()\n");
        let mut trial = Trial::new(&source, "examples/kitting/workstation.toml", 1);
        trial.motion = SimulatedMotion::default();
        let order = executed(&trial.run().events, 7);
        prop_assert_eq!(order.len(), members.len());
        for (second, (_, writes, reads)) in members.iter().enumerate() {
            for (first, (_, wrote, read)) in members.iter().enumerate().take(second) {
                if writes == read || wrote == reads {
                    let position = |wanted: usize| order.iter().position(|i| *i == wanted).unwrap();
                    prop_assert!(position(first) < position(second), "{:?} {}", order, source);
                }
            }
        }
        Ok(())
    };
    runner.run(&strategy, test).unwrap();
}

/// What one member sets in the world and another reads keeps their written order as well, though
/// the other order is shorter.
#[test]
fn orders_respect_properties() {
    let source = "About PlanId = \"p\" PlanWorkstation = \"workstation1\" TargetSKU = \"kitABC\"
         PlanRequirements item name = \"box\" type = \"LargeContainer\" location = WORKSTATION end
         PlanParameters item name = \"NumberOfKitsToMake\" type = \"positiveInteger\" end
         InternalVariables item name = \"Box\" type = \"LargeContainer\" requirement = \"box\" end
         item name = \"n\" type = \"integer\" initialValue = 0 end
         ToDo Start() Bind(Box, WORKSTATION, ANY, QUIT) DoInAnyOrder begin
         DoInGivenOrder begin Set(Box.hasLargeContainer_Capacity, 13) RobotMoveAbove(Pose(Point(600, 300, 0), RollPitchYaw(0, 0, 0), WORKSTATION)) end
         DoInGivenOrder begin Set(n, FIRST) RobotMoveAbove(Pose(Point(350, 0, 0), RollPitchYaw(0, 0, 0), WORKSTATION)) end
         end Stop()\n";
    let order = |first: &str| {
        let world = "examples/kitting/workstation.toml";
        let result = Trial::new(&source.replace("FIRST", first), world, 1).run();
        assert_eq!(
            result.report.outcome,
            RunOutcome::Stopped,
            "{:?}",
            result.report
        );
        executed(&result.events, 7)
    };
    assert_eq!(order("1"), [1, 0], "the near one first");
    assert_eq!(order("Box.hasLargeContainer_Capacity"), [0, 1]);
}
