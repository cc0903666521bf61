//! Fixtures for several tests.

use std::path::Path;

/// A file of the repository.
pub(crate) fn repository_text(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A file of `tests/data`.
pub(crate) fn data(name: &str) -> String {
    repository_text(&format!("plan/tests/data/{name}"))
}

/// How many random cases a fuzz property runs: `CANTER_FUZZ_CASES`, or 256.
pub(crate) fn fuzz_cases() -> u32 {
    std::env::var("CANTER_FUZZ_CASES")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(256)
}
