//! Damaged recordings are refused by the rule that the damage breaks; good recordings are accepted.
//!
//! There are three sorts of damage: columns that contradict others, changed times and commands, and
//! valid recordings of another motion than the one that was asked for.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

mod columns;
mod damage;
mod runs;
mod scene;
mod times;
mod ways;

use std::thread;

use damage::{Damaged, Kind, Make};
use planner::recorded::{RecordedSample, Rule};
use scene::{Scene, verdict};

/// Time between samples of the damaged recordings, s.
pub(crate) const PERIOD: f64 = 0.002;

const ROBOTS: [&str; 8] = [
    "ur5e",
    "panda",
    "iiwa7",
    "irb120",
    "lrmate200id",
    "tx2_60",
    "xarm6",
    "gantry",
];

fn kinds() -> Vec<&'static Kind> {
    let kinds = columns::KINDS.iter().chain(&times::KINDS);
    kinds.chain(&ways::KINDS).chain(&runs::KINDS).collect()
}

/// Does the damage; none when the robot cannot do the other program.
fn damaged(scene: &Scene, kind: &Kind, good: &[RecordedSample]) -> Option<Damaged> {
    match kind.make {
        Make::Rows(change) => {
            let mut rows = good.to_vec();
            change(&mut rows);
            let commands = scene.program();
            Some(Damaged { commands, rows })
        }
        Make::Run(change) => {
            let mut rows = runs::as_run(good);
            change(&mut rows);
            let commands = scene.program();
            Some(Damaged { commands, rows })
        }
        Make::Program(make) => {
            let [doing, commands] = make(scene);
            let rows = scene.recorded(&doing, PERIOD)?;
            Some(Damaged { commands, rows })
        }
    }
}

/// What became of the kinds on one robot.
#[derive(Default)]
struct Outcome {
    done: Vec<&'static str>,
    caught: Vec<&'static str>,
    missed: Vec<String>,
}

fn outcome(robot: &str) -> Outcome {
    let scene = Scene::new(robot);
    let good = scene
        .recorded(&scene.program(), PERIOD)
        .unwrap_or_else(|| panic!("{robot} cannot do the program"));
    for rows in [&good, &runs::as_run(&good)] {
        let holds = verdict(&scene.robot, &scene.program(), rows);
        let broken: Vec<_> = holds.all_broken().map(ToString::to_string).collect();
        assert!(holds.holds, "{robot}: {broken:#?}");
    }
    let mut outcome = Outcome::default();
    for kind in kinds() {
        let Some(damaged) = damaged(&scene, kind, &good) else {
            continue;
        };
        outcome.done.push(kind.name);
        let verdict = verdict(&scene.robot, &damaged.commands, &damaged.rows);
        let rules: Vec<Rule> = verdict.all_broken().map(|found| found.rule).collect();
        if kind.rules.iter().any(|rule| rules.contains(rule)) {
            outcome.caught.push(kind.name);
        } else {
            let (name, rule) = (kind.name, kind.rules);
            outcome
                .missed
                .push(format!("{robot}: {name}: {rules:?} without {rule:?}"));
        }
    }
    outcome
}

#[test]
fn every_damage_is_caught_by_the_rule_that_it_breaks() {
    assert!(kinds().len() >= 60, "{} kinds", kinds().len());
    let outcomes: Vec<Outcome> = thread::scope(|scope| {
        let threads = ROBOTS.map(|robot| scope.spawn(move || outcome(robot)));
        threads.map(|thread| thread.join().unwrap()).into()
    });
    for kind in kinds() {
        let count = |of: fn(&Outcome) -> &Vec<&'static str>| {
            let all = outcomes.iter().flat_map(of);
            all.filter(|name| **name == kind.name).count()
        };
        let (done, caught) = (
            count(|outcome| &outcome.done),
            count(|outcome| &outcome.caught),
        );
        let rules: Vec<_> = kind.rules.iter().map(|rule| rule.name()).collect();
        let rules = rules.join(" or ");
        println!("{:55} {rules:44} caught {caught} of {done}", kind.name);
        assert!(done >= 6, "{}: done on {done} robots only", kind.name);
    }
    let missed: Vec<_> = outcomes
        .iter()
        .flat_map(|outcome| &outcome.missed)
        .collect();
    assert!(missed.is_empty(), "missed: {missed:#?}");
}

#[test]
fn every_rule_has_a_name_of_its_own_and_a_statement() {
    let mut names: Vec<_> = Rule::ALL.iter().map(|rule| rule.name()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), Rule::ALL.len());
    assert!(Rule::ALL.iter().all(|rule| rule.statement().len() > 20));
}

/// The page on the checker states every rule as the checker does.
#[test]
fn the_page_lists_every_rule() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/verify.md");
    let page = std::fs::read_to_string(page).unwrap();
    for rule in Rule::ALL {
        let row = format!("| `{}` | {} |", rule.name(), rule.statement());
        assert!(page.contains(&row), "docs/verify.md lacks {row}");
    }
}

/// At every period, also at periods that meet no start of a command.
#[test]
fn no_good_recording_is_refused() {
    for robot in planner::robot::list() {
        let scene = Scene::new(robot);
        for period in [0.0005, 0.001, 0.0037, 0.01, 0.05, 0.3] {
            let rows = scene.recorded(&scene.program(), period).unwrap();
            let verdict = verdict(&scene.robot, &scene.program(), &rows);
            let broken: Vec<_> = verdict.all_broken().map(ToString::to_string).collect();
            assert!(broken.is_empty(), "{robot} at {period} s: {broken:#?}");
        }
    }
}
