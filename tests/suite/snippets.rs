//! Every snippet of the pages for Python, ROS 2, fleets and installation is run by a test, or says on
//! its page why not. A script that runs it where root or an hour of compiling is at hand is named there.

use std::fs;

use system_tests::repository::root;

/// What stands before a snippet that no test runs by itself.
const MARK: &str = "<!-- not run by itself: ";

/// Page, language of the snippets, the file that runs them, and the test that starts this file.
const RUNNERS: [(&str, &str, &str, &str); 5] = [
    (
        "docs/python.md",
        "python",
        "python/tests/documents.py",
        "tests/python/main.rs",
    ),
    (
        "docs/ros2.md",
        "sh",
        "ros2/tests/page.py",
        "tests/ros2/main.rs",
    ),
    (
        "docs/ros2.md",
        "json",
        "tests/suite/follow.rs",
        "tests/suite/main.rs",
    ),
    (
        "docs/fleet.md",
        "sh",
        "fleet/tests/page.py",
        "tests/fleet/main.rs",
    ),
    (
        "docs/fleet.md",
        "python",
        "fleet/tests/page.py",
        "tests/fleet/main.rs",
    ),
];

/// The pages whose snippets are run.
const PAGES: [&str; 4] = [
    "docs/python.md",
    "docs/ros2.md",
    "docs/fleet.md",
    "docs/install.md",
];

/// A snippet of a page.
#[derive(Debug)]
struct Snippet {
    line: usize,
    language: String,
    /// Why no test runs it.
    reason: Option<String>,
}

/// All snippets of a page.
fn snippets(text: &str) -> Vec<Snippet> {
    let mut found = Vec::new();
    let (mut inside, mut before) = (false, "");
    for (index, line) in text.lines().enumerate() {
        match (line.strip_prefix("```"), inside) {
            (Some(language), false) => {
                let reason = before.strip_prefix(MARK);
                let reason = reason.and_then(|rest| rest.strip_suffix(" -->"));
                found.push(Snippet {
                    line: index + 1,
                    language: language.to_owned(),
                    reason: reason.map(str::to_owned),
                });
                inside = true;
            }
            (Some(_), true) => inside = false,
            (None, _) => {}
        }
        before = line;
    }
    assert!(!inside, "a snippet without an end");
    found
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|cause| panic!("{path}: {cause}"))
}

/// The file that runs the snippets of a language on a page, if a test starts it.
fn runner(page: &str, language: &str) -> Option<&'static str> {
    let mut all = RUNNERS.iter();
    let (_, _, runner, test) = all.find(|(own, kind, _, _)| (*own, *kind) == (page, language))?;
    assert!(read(runner).contains(page), "{runner} does not read {page}");
    let (_, name) = runner.rsplit_once('/').unwrap_or_default();
    let stem = name.split('.').next().unwrap_or_default();
    assert!(read(test).contains(stem), "{test} does not start {runner}");
    Some(runner)
}

/// A script that a reason names in its last brackets is there and reads the page.
fn check_script(page: &str, reason: &str) {
    let Some((_, script)) = reason.rsplit_once(" (") else {
        return;
    };
    let script = script.trim_end_matches(')');
    assert!(read(script).contains(page), "{script} does not read {page}");
}

#[test]
fn every_snippet_is_run_or_says_why_not() {
    for page in PAGES {
        let all = snippets(&read(page));
        assert!(!all.is_empty(), "{page} has no snippet");
        for Snippet {
            line,
            language,
            reason,
        } in all
        {
            match (reason, runner(page, &language)) {
                (Some(reason), _) => {
                    assert!(reason.len() > 10, "{page}:{line}: why?");
                    check_script(page, &reason);
                    println!("{page}:{line}: {language}, not run by itself: {reason}");
                }
                (None, Some(runner)) => println!("{page}:{line}: {language}, run by {runner}"),
                (None, None) => panic!("{page}:{line}: no test runs this {language:?}"),
            }
        }
    }
}

#[test]
fn snippets_are_found_with_their_reasons() {
    let text = "a\n```sh\nls\n```\n<!-- not run by itself: needs a ship -->\n```python\nx\n```\n";
    let [first, second] = &snippets(text)[..] else {
        panic!("two snippets");
    };
    assert_eq!((first.line, first.language.as_str()), (2, "sh"));
    assert!(first.reason.is_none());
    assert_eq!(second.language, "python");
    assert_eq!(second.reason.as_deref(), Some("needs a ship"));
    assert!(runner("docs/fleet.md", "toml").is_none());
}
