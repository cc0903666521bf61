//! Damaged recordings are refused by the rule that the damage breaks, and good ones are not.
//!
//! The damages are of three sorts: columns changed so that they are at odds with others, times and
//! commands changed, and sound recordings of another motion than the one that was asked for.

mod columns;
mod damage;
mod runs;
mod scene;
mod times;
mod ways;

use std::collections::BTreeMap;

use damage::{Damaged, Kind, Make};
use engine::recorded::{Row, Rule};
use scene::{Scene, recorded, verdict};

/// Time between samples of the damaged recordings, s.
pub const PERIOD: f64 = 0.002;

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
fn damaged(scene: &Scene, kind: &Kind, good: &[Row]) -> Option<Damaged> {
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
            let rows = recorded(&scene.robot, &doing, PERIOD)?;
            Some(Damaged { commands, rows })
        }
    }
}

#[test]
fn every_damage_is_caught_by_the_rule_that_it_breaks() {
    assert!(kinds().len() >= 60, "{} kinds", kinds().len());
    let mut caught: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut missed, mut done) = (Vec::new(), BTreeMap::new());
    for robot in ROBOTS {
        let scene = Scene::new(robot);
        let good = recorded(&scene.robot, &scene.program(), PERIOD)
            .unwrap_or_else(|| panic!("{robot} cannot do the program"));
        let holds = verdict(&scene.robot, &scene.program(), &good);
        assert!(
            holds.holds,
            "{robot}: {:#?}",
            holds.all_broken().collect::<Vec<_>>()
        );
        let run = verdict(&scene.robot, &scene.program(), &runs::as_run(&good));
        assert!(
            run.holds,
            "{robot}: {:#?}",
            run.all_broken().collect::<Vec<_>>()
        );
        for kind in kinds() {
            let Some(damaged) = damaged(&scene, kind, &good) else {
                continue;
            };
            *done.entry(kind.name).or_insert(0_usize) += 1;
            let verdict = verdict(&scene.robot, &damaged.commands, &damaged.rows);
            let rules: Vec<Rule> = verdict.all_broken().map(|found| found.rule).collect();
            if rules.contains(&kind.rule) {
                *caught.entry(kind.name).or_default() += 1;
            } else {
                missed.push(format!(
                    "{robot}: {}: {rules:?} without {}",
                    kind.name, kind.rule
                ));
            }
        }
    }
    for kind in kinds() {
        let of = |counts: &BTreeMap<&str, usize>| counts.get(kind.name).copied().unwrap_or(0);
        println!(
            "{:55} {:22} {} of {}",
            kind.name,
            kind.rule.name(),
            of(&caught),
            of(&done)
        );
        assert!(of(&done) >= 6, "{}: done on too few robots", kind.name);
    }
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
    for robot in engine::robot::list() {
        let scene = Scene::new(robot);
        for period in [0.0005, 0.001, 0.0037, 0.01, 0.05, 0.3] {
            let rows = recorded(&scene.robot, &scene.program(), period).unwrap();
            let verdict = verdict(&scene.robot, &scene.program(), &rows);
            let broken: Vec<_> = verdict.all_broken().map(ToString::to_string).collect();
            assert!(broken.is_empty(), "{robot} at {period} s: {broken:#?}");
        }
    }
}
