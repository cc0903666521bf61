//! The examples in the documents for users are correct.

use system_tests::repository::root;

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
