//! Every row of `docs/faults.md` names a test that exists.

use system_tests::repository::root;

/// Rows of the tables of a document: the cells, without header and rule.
fn rows(text: &str) -> Vec<Vec<&str>> {
    text.lines()
        .filter_map(|line| line.strip_prefix('|')?.strip_suffix('|'))
        .map(|line| line.split('|').map(str::trim).collect::<Vec<_>>())
        .filter(|cells| !cells.iter().all(|cell| cell.chars().all(|c| c == '-')))
        .filter(|cells| cells.last() != Some(&"test"))
        .collect()
}

/// Why a row of the table is wrong; `None` if it is right.
fn fault(cells: &[&str]) -> Option<String> {
    let [.., named] = cells else {
        return Some("an empty row".into());
    };
    if cells.len() != 6 || cells.iter().any(|cell| cell.is_empty()) {
        return Some(format!("expected six cells with words, found {cells:?}"));
    }
    let tests: Vec<&str> = named.split('`').skip(1).step_by(2).collect();
    if tests.is_empty() {
        return Some(format!("no test is named: {named}"));
    }
    tests.into_iter().find_map(missing)
}

/// Why there is no such test, given as `path/of/file.rs::name`.
fn missing(test: &str) -> Option<String> {
    let Some((file, name)) = test.split_once("::") else {
        return Some(format!("{test}: expected file.rs::name"));
    };
    let Ok(text) = std::fs::read_to_string(root().join(file)) else {
        return Some(format!("{test}: there is no such file"));
    };
    if is_trial(file, name) {
        return None;
    }
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let head = format!("fn {name}(");
    let Some(at) = lines.iter().position(|line| line.starts_with(&head)) else {
        return Some(format!("{test}: there is no such test"));
    };
    // Attributes and comments stand between `#[test]` and the name.
    let above = lines.iter().take(at).rev();
    let mut above = above.take_while(|line| line.starts_with("#[") || line.starts_with("//"));
    let is_test = above.any(|line| *line == "#[test]");
    (!is_test).then(|| format!("{test}: it is no test"))
}

/// Whether the main file of a target with a harness of its own runs the function as a test.
fn is_trial(file: &str, name: &str) -> bool {
    let path = std::path::Path::new(file);
    let (Some(folder), Some(stem)) = (path.parent(), path.file_stem()) else {
        return false;
    };
    // A test of the main file has no module in its name.
    let stem = stem.to_string_lossy();
    let full = format!("{stem}::{name}");
    let trial = if stem == "main" { name } else { &full };
    let is_listed = |line: &str| line.trim().trim_matches(['"', ',']) == trial;
    std::fs::read_to_string(root().join(folder).join("main.rs")).is_ok_and(|text| {
        text.contains("libtest_mimic")
            && (text.lines().any(is_listed) || text.contains(&format!("\"{trial}\",")))
    })
}

#[test]
fn every_row_is_a_test() {
    let text = std::fs::read_to_string(root().join("docs/faults.md")).unwrap();
    let rows = rows(&text);
    assert!(rows.len() >= 30, "{} rows", rows.len());
    let faults: Vec<String> = rows.iter().filter_map(|cells| fault(cells)).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

/// The check fires.
#[test]
fn a_row_without_its_test_is_seen() {
    let row = |test: &str| {
        let text = format!(
            "| what | arm | within | message | go on | test |\n|---|---|---|---|---|---|\n| a | b | c | d | e | {test} |"
        );
        let cells: Vec<String> = rows(&text)
            .concat()
            .iter()
            .map(|c| (*c).to_owned())
            .collect();
        let cells: Vec<&str> = cells.iter().map(String::as_str).collect();
        fault(&cells)
    };
    assert_eq!(row("`tests/suite/faults.rs::every_row_is_a_test`"), None);
    for (test, why) in [
        ("later", "no test is named"),
        ("", "six cells"),
        ("`tests/suite/faults.rs`", "expected file.rs::name"),
        ("`tests/suite/nowhere.rs::a`", "no such file"),
        ("`tests/suite/faults.rs::nothing`", "no such test"),
        ("`tests/suite/faults.rs::missing`", "it is no test"),
    ] {
        let said = row(test).unwrap();
        assert!(said.contains(why), "{test}: {said}");
    }
}
