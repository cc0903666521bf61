//! The examples in the documents for users are correct.

use std::fs;
use std::path::{Path, PathBuf};

use system_tests::repository::{files, root};

/// Code blocks of a document with this mark, without the fences.
fn blocks(text: &str, mark: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(found) = line.strip_prefix("```") else {
            continue;
        };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        if found == mark {
            blocks.push(block.join("\n"));
        }
    }
    blocks
}

#[test]
fn programs_in_the_language_reference_are_programs() {
    let text = std::fs::read_to_string(root().join("docs/language.md")).unwrap();
    let options = crcl::ReadOptions::default();
    let programs = blocks(&text, "");
    assert_eq!(programs.len(), 1);
    let reading = crcl::text::read(&programs[0], &options);
    assert!(reading.findings.is_empty(), "{:?}", reading.findings);
    assert_eq!(reading.program.commands.len(), 6);
    let json = blocks(&text, "json");
    assert_eq!(json.len(), 1);
    let reading = crcl::json::read(&json[0], &options);
    assert!(reading.findings.is_empty(), "{:?}", reading.findings);
}

#[test]
fn every_command_is_in_the_language_reference() {
    let text = std::fs::read_to_string(root().join("docs/language.md")).unwrap();
    for command in crcl::COMMANDS {
        let call = format!("`{}(", command.name);
        assert!(text.contains(&call), "{} is missing", command.name);
    }
}

#[test]
fn the_program_of_the_readme_is_a_program() {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let reading = crcl::text::read(&blocks(&text, "")[0], &crcl::ReadOptions::default());
    assert!(reading.findings.is_empty(), "{:?}", reading.findings);
}

/// Whether code of this text is `unsafe`.
fn is_unsafe(text: &str) -> bool {
    // Neither comments nor what stands in a text.
    let mut code = text
        .lines()
        .filter_map(|line| line.split("//").next()?.split('"').next());
    code.any(|line| {
        ["unsafe {", "unsafe fn", "unsafe impl", "unsafe extern"]
            .iter()
            .any(|word| line.contains(word))
    })
}

/// All Rust files of the repository, relative to its root.
fn sources() -> Vec<PathBuf> {
    let (mut folders, mut sources) = (vec![root()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                folders.push(path);
            } else if path.extension().is_some_and(|found| found == "rs") {
                sources.push(path.strip_prefix(root()).unwrap().to_path_buf());
            }
        }
    }
    sources
}

/// Each use of `unsafe` has a page that names its file.
#[test]
fn unsafe_code_has_its_decision() {
    let pages: String = files("docs/decisions", "md")
        .unwrap()
        .iter()
        .map(|page| fs::read_to_string(page).unwrap())
        .collect();
    let named = |path: &Path| pages.contains(&format!("`{}`", path.display()));
    let mut seen = 0;
    for path in sources() {
        if is_unsafe(&fs::read_to_string(root().join(&path)).unwrap()) {
            assert!(named(&path), "no page names {}", path.display());
            seen += 1;
        }
    }
    assert!(seen > 5, "{seen} files");
    assert!(is_unsafe("    let x = unsafe { f() };") && is_unsafe("unsafe impl Send for X {}"));
    assert!(!is_unsafe("// unsafe { f() }") && !is_unsafe("    \"unsafe {\","));
}
