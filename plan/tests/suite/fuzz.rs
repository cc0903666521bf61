//! No text makes a reader panic or hang. `CANTER_FUZZ_CASES` sets the number of cases.

use plan::kitting::{check, read, write};
use plan::pddl::{ActionTable, read_domain, read_plan, read_problem, simulate};
use plan::world::{
    Model, check as check_world, export_toml, import_json, import_nist, import_toml,
};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};

use crate::fixtures::{data, fuzz_cases, repository_text};

/// Pieces that are put into a good text.
const HOSTILE: &[&str] = &[
    "",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "\"\"",
    "begin",
    "end",
    "5.2.3 ",
    "=",
    "==",
    ".",
    ",",
    "-",
    "1e999",
    "99999999999999999999",
    "Null",
    "ROBOT",
    "é",
    "\u{0}",
    "\n",
    "If {",
    "Else ",
    "<!--",
    "]]>",
    "<X>",
    "nan",
    "-0",
    "!",
    "!!(-1 != -(-1))",
    "reference = \"KitTray_1\"",
    "[[object]]",
    ";",
];

/// Texts near a good one: pieces cut out, doubled, moved, or replaced by hostile ones.
fn near(good: String) -> impl Strategy<Value = String> {
    let hostile = prop::sample::select(HOSTILE);
    let edit = (
        any::<prop::sample::Index>(),
        0..80_usize,
        hostile,
        any::<prop::sample::Index>(),
    );
    prop::collection::vec((edit, 0..4_u8), 1..6).prop_map(move |edits| {
        let mut text: Vec<char> = good.chars().collect();
        for ((at, length, piece, to), kind) in edits {
            let start = at.index(text.len() + 1);
            let end = (start + length).min(text.len());
            match kind {
                0 => drop(text.drain(start..end)),
                1 => drop(text.splice(start..end, piece.chars())),
                2 => {
                    let copy: Vec<char> = text[start..end].to_vec();
                    let to = to.index(text.len() + 1);
                    text.splice(to..to, copy);
                }
                _ => drop(text.splice(start..start, piece.chars())),
            }
        }
        text.into_iter().collect()
    })
}

fn run(good: &[String], test: impl Fn(&str)) {
    let config = Config {
        cases: fuzz_cases(),
        rng_seed: RngSeed::Fixed(7),
        failure_persistence: None,
        ..Config::default()
    };
    for good in good {
        let mut runner = TestRunner::new(config.clone());
        let strategy = prop_oneof![4 => near(good.clone()), 1 => ".{0,200}"];
        runner
            .run(&strategy, |text| {
                test(&text);
                Ok(())
            })
            .unwrap();
    }
}

/// Plans: reading, checking and writing; what is read without error is written and read as the same.
#[test]
fn plan_readers_survive() {
    let world = import_toml(&repository_text("examples/kitting/workstation.toml")).unwrap();
    let own = repository_text("examples/kitting/kit-abc.plan");
    let json = serde_json::to_string(&read(&own).plan).unwrap();
    let good = [own, json, data("odd.plan")];
    run(&good, |text| {
        let reading = read(text);
        let findings = check(&reading.plan, Some(&world));
        for finding in reading.findings.iter().chain(&findings) {
            let _ = finding.to_json("plan", text);
        }
        let written = write(&reading.plan);
        if reading.findings.is_empty() && !text.trim_start().starts_with('{') {
            assert_eq!(read(&written).plan, reading.plan, "{written}");
        }
        for finding in reading.findings.iter().take(3) {
            let _ = format!("{:?}", finding.report("plan", text));
        }
    });
}

fn try_world(model: Model) {
    let _ = check_world(&model);
    let _ = model.highest();
    let text = export_toml(&model).unwrap();
    crate::world::assert_same(&model, &import_toml(&text).unwrap());
}

/// Workstations in TOML and JSON.
#[test]
fn world_importers_survive() {
    let toml = repository_text("examples/kitting/workstation-pddl.toml");
    let json = plan::world::export_json(&import_toml(&toml).unwrap()).unwrap();
    run(&[toml], |text| drop(import_toml(text).map(try_world)));
    run(&[json], |text| drop(import_json(text).map(try_world)));
}

/// Workstations in NIST's XML.
#[test]
fn nist_importer_survives() {
    let xml = data("cell.xml");
    import_nist(&xml).unwrap();
    run(&[xml], |text| drop(import_nist(text).map(try_world)));
}

/// PDDL plans, domains, problems, and tables of actions.
#[test]
fn pddl_readers_survive() {
    let plan = repository_text("examples/kitting/one-kit.pddl");
    run(&[plan], |text| drop(read_plan(text)));
    let table = ActionTable::own().unwrap();
    let entry = "[[action]]\nnames = [\"a\"]\narguments = [\"b\"]\ndo = [{ pick_up = \"b\" }]\n";
    run(&[entry.to_owned()], |text| drop(table.with(text)));
    let file = |name: &str| repository_text(&format!("examples/kitting/{name}"));
    let domain = file("one-kit-domain.pddl");
    let problem = file("one-kit-problem.pddl");
    let steps = read_plan(&file("one-kit.pddl")).unwrap();
    let good = (
        read_domain(&domain).unwrap(),
        read_problem(&problem).unwrap(),
    );
    run(&[domain], |text| {
        drop(read_domain(text).map(|domain| simulate(&domain, &good.1, &steps)));
    });
    run(&[problem], |text| {
        drop(read_problem(text).map(|problem| simulate(&good.0, &problem, &steps)));
    });
}

/// Deep nesting is refused, not followed until the stack ends.
#[test]
fn deep_nesting_is_refused() {
    let deep = "(".repeat(100_000);
    assert!(
        !read(&format!(
            "About PlanId = \"p\" ToDo Start() Set(x, {deep}1)) Stop()"
        ))
        .findings
        .is_empty()
    );
    let minus = "-".repeat(100_000);
    assert!(
        !read(&format!("About PlanId = \"p\" ToDo Set(x, {minus}1)"))
            .findings
            .is_empty()
    );
    let ifs = "If {true} ".repeat(100_000);
    assert!(
        !read(&format!("About PlanId = \"p\" ToDo {ifs} Quit()"))
            .findings
            .is_empty()
    );
    let lists = "DoOne begin ".repeat(100_000);
    assert!(
        !read(&format!("About PlanId = \"p\" ToDo {lists}"))
            .findings
            .is_empty()
    );
    assert!(
        !read(&format!("{{\"about\": {}", "[".repeat(100_000)))
            .findings
            .is_empty()
    );
    read_domain(&deep).unwrap_err();
    let dots = ".x".repeat(100_000);
    assert!(
        !read(&format!("About PlanId = \"p\" ToDo Set(x{dots}, 1)"))
            .findings
            .is_empty()
    );
    let sums = "+1".repeat(100_000);
    let _ = check(
        &read(&format!(
            "About PlanId = \"p\" ToDo Start() Set(x, 1{sums}) Stop()"
        ))
        .plan,
        None,
    );
}
