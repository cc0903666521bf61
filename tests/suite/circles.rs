//! Modules of one crate do not depend on each other in circles, so each can be read after those it
//! uses.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use system_tests::repository::root;

/// A module by its names from the crate's root.
type Name = Vec<String>;

/// Which modules of a crate a module names.
type Arrows = BTreeMap<Name, BTreeSet<Name>>;

/// Remaining circles, by crate and modules; decision 0006 explains each. None may be added; remove
/// an entry when its circle is resolved.
const KNOWN: [(&str, &str); 2] = [
    ("plan", "kitting, run"),
    ("plan", "world::object, world::place"),
];

/// The code of a crate's modules, without comments and tests.
fn modules(folder: &Path) -> BTreeMap<Name, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![(folder.to_owned(), Name::new())];
    while let Some((folder, name)) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let mut inner = name.clone();
            if path.is_dir() {
                inner.push(stem);
                folders.push((path, inner));
            } else if path.extension().is_some_and(|end| end == "rs") {
                if !["mod", "lib", "main"].contains(&stem.as_str()) {
                    inner.push(stem);
                }
                found.insert(inner, code(&fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found
}

/// A source without its comments and without its tests, which may name anything.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or(text);
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""));
    lines.collect::<Vec<_>>().join("\n")
}

/// All paths of a use tree, each with what stands before it.
fn tree(before: &[&str], text: &str, found: &mut Vec<Name>) {
    let mut depth = 0;
    let parts = text.split(|letter: char| {
        depth += i32::from(letter == '{') - i32::from(letter == '}');
        depth == 0 && letter == ','
    });
    for part in parts.map(str::trim).filter(|part| !part.is_empty()) {
        let (head, inner) = match part.split_once('{') {
            Some((head, rest)) => (head, rest.trim_end().strip_suffix('}')),
            None => (part.split(" as ").next().unwrap_or(part), None),
        };
        let steps = head.split("::").map(str::trim).filter(|s| !s.is_empty());
        let path: Vec<_> = before.iter().copied().chain(steps).collect();
        match inner {
            Some(inner) => tree(&path, inner, found),
            None => found.push(path.into_iter().map(str::to_owned).collect()),
        }
    }
}

/// The paths that code names, as they are written: `crate::..`, `super::..`, `self::..`.
fn paths(code: &str) -> Vec<Name> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = ["crate::", "super::", "self::"]
        .into_iter()
        .filter_map(|word| rest.find(word))
        .min()
    {
        let used = rest[..at].trim_end().ends_with("use");
        let end = |letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == ':');
        let length = match used {
            true => rest[at..].find(';'),
            false => rest[at..].find(end),
        };
        let (path, after) = rest[at..].split_at(length.unwrap_or(rest.len() - at));
        tree(&[], path, &mut found);
        rest = after;
    }
    found
}

/// The module that a path of `from` leads to, through what modules show of their children.
fn target(all: &BTreeMap<Name, String>, from: &Name, path: &Name) -> Name {
    let mut at = from.clone();
    let mut steps = path.iter().map(String::as_str).peekable();
    match steps.next() {
        Some("crate") => at.clear(),
        Some("super") => {
            at.pop();
        }
        _ => {}
    }
    for step in steps {
        if step == "super" {
            at.pop();
            continue;
        }
        let mut inner = at.clone();
        inner.push(step.to_owned());
        if all.contains_key(&inner) {
            at = inner;
        } else if let Some(shown) = shown(all, &at, step) {
            at = shown;
        } else {
            break;
        }
    }
    at
}

/// The child of a module whose item the module shows under its own name.
fn shown(all: &BTreeMap<Name, String>, module: &Name, item: &str) -> Option<Name> {
    let code = all.get(module)?;
    for (at, _) in code.match_indices("pub") {
        let Some((_, used)) = code[at..].split_once("use ") else {
            continue;
        };
        let head = &code[at..at + code[at..].len() - used.len()];
        if head.len() > "pub(crate) use ".len() {
            continue;
        }
        let mut found = Vec::new();
        tree(&[], used.split(';').next().unwrap_or(used), &mut found);
        for path in found {
            let steps = path.iter().skip(usize::from(path[0] == "self"));
            let steps: Vec<_> = steps.cloned().collect();
            if steps.len() == 2 && steps[1] == item {
                let child: Name = module.iter().cloned().chain([steps[0].clone()]).collect();
                if all.contains_key(&child) {
                    return Some(child);
                }
            }
        }
    }
    None
}

/// The arrows between the modules of one folder: what a module names, itself or in its children.
fn arrows(all: &BTreeMap<Name, String>) -> Arrows {
    let mut arrows = Arrows::new();
    for (from, code) in all {
        for path in paths(code) {
            let to = target(all, from, &path);
            let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            if common < from.len() && common < to.len() {
                let (from, to) = (from[..=common].to_vec(), to[..=common].to_vec());
                arrows.entry(from).or_default().insert(to);
            }
        }
    }
    arrows
}

/// Groups of modules that each lead to all others of the group.
fn circles(arrows: &Arrows) -> BTreeSet<Vec<Name>> {
    let reach = |from: &Name| {
        let mut seen = BTreeSet::new();
        let mut next = vec![from];
        while let Some(at) = next.pop() {
            for to in arrows.get(at).into_iter().flatten() {
                if seen.insert(to.clone()) {
                    next.push(to);
                }
            }
        }
        seen
    };
    let reached: BTreeMap<_, _> = arrows.keys().map(|from| (from, reach(from))).collect();
    let mut found = BTreeSet::new();
    for (from, to) in &reached {
        let group = to
            .iter()
            .filter(|to| reached.get(to).is_some_and(|back| back.contains(*from)));
        let group: Vec<_> = group.cloned().collect();
        if group.len() > 1 {
            found.insert(group);
        }
    }
    found
}

#[test]
fn modules_stand_in_no_new_circle() {
    let manifest: toml::Table = fs::read_to_string(root().join("Cargo.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    let mut found = Vec::new();
    for member in members.iter().map(|member| member.as_str().unwrap()) {
        let source = root().join(member).join("src");
        let all = modules(&source);
        assert!(!all.is_empty(), "{}", source.display());
        for circle in circles(&arrows(&all)) {
            let names: Vec<_> = circle.iter().map(|name| name.join("::")).collect();
            found.push((member.to_owned(), names.join(", ")));
        }
    }
    let known: Vec<_> = KNOWN
        .iter()
        .map(|(member, names)| ((*member).to_owned(), (*names).to_owned()))
        .collect();
    let new: Vec<_> = found.iter().filter(|one| !known.contains(one)).collect();
    assert!(new.is_empty(), "new circles: {new:#?}");
    let gone: Vec<_> = known.iter().filter(|one| !found.contains(one)).collect();
    assert!(
        gone.is_empty(),
        "broken, take them out of the list: {gone:#?}"
    );
}

#[test]
fn a_circle_is_seen() {
    let name = |path: &str| path.split("::").map(str::to_owned).collect::<Name>();
    let source = |parts: &[(&str, &str)]| -> BTreeMap<Name, String> {
        let mut all: BTreeMap<_, _> = parts
            .iter()
            .map(|(path, text)| (name(path), code(text)))
            .collect();
        all.insert(Name::new(), String::new());
        all
    };
    let all = source(&[
        ("a", "mod x;\npub use x::Thing;"),
        ("a::x", "use crate::b::Other;"),
        ("b", "use crate::{c::{self, D}, a::Thing};"),
        ("c", "// use crate::a::Thing;"),
    ]);
    assert_eq!(
        target(&all, &name("b"), &name("crate::a::Thing")),
        name("a::x")
    );
    let found = circles(&arrows(&all));
    assert_eq!(
        found.into_iter().collect::<Vec<_>>(),
        [[name("a"), name("b")]]
    );
    let all = source(&[
        ("a", "fn f() { super::b::g() }"),
        (
            "b",
            "#[cfg(test)]\nmod tests {\n    use super::super::a;\n}",
        ),
    ]);
    assert!(circles(&arrows(&all)).is_empty());
}
