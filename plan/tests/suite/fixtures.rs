//! Things that several tests need.

use std::path::{Path, PathBuf};

/// Folder of specifications and foreign data beside the repository; tests that need it are left
/// out where it does not exist.
pub(crate) fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    path.is_dir().then_some(path)
}

/// A file of the shared folder, or none without the folder.
pub(crate) fn shared_text(path: &str) -> Option<String> {
    Some(std::fs::read_to_string(shared()?.join(path)).unwrap())
}

/// A file of the repository.
pub(crate) fn repository_text(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// How many random cases a fuzz property runs: `CANTER_FUZZ_CASES`, or 256.
pub(crate) fn fuzz_cases() -> u32 {
    std::env::var("CANTER_FUZZ_CASES")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(256)
}
