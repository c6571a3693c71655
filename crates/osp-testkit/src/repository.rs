//! The repository that a package of `crates` lies in.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folder of the repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A file or folder of the repository.
pub fn at(path: impl AsRef<Path>) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// The folders of all packages of the program; the root package comes first.
pub fn packages() -> Vec<PathBuf> {
    let crates = fs::read_dir(at("crates")).expect("packages");
    let crates = crates.map(|package| package.expect("an entry").path());
    [PathBuf::from(ROOT)].into_iter().chain(crates).collect()
}
