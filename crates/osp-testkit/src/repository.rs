//! The repository with the packages of `crates`.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folder of the repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Returns the path of a file or folder of the repository.
pub fn at(path: impl AsRef<Path>) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// Returns the folders of all packages of the program, beginning with the root package.
pub fn packages() -> Vec<PathBuf> {
    let crates = fs::read_dir(at("crates")).expect("packages");
    let crates = crates.map(|package| package.expect("an entry").path());
    [PathBuf::from(ROOT)].into_iter().chain(crates).collect()
}
