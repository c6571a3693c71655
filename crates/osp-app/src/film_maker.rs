//! The maker of films, which the program gives to the window.

use std::path::Path;

/// Writes a film of the session in the first file to the second file, and returns a line for the user. Calls its last
/// argument with the number of finished pictures, and ends without a film once this call returns `false`.
pub type MakeFilm = fn(&Path, &Path, &dyn Fn(u64) -> bool) -> Result<String, String>;

/// The program's maker of films, which needs encoders that the window lacks.
#[derive(Clone, Copy, Debug)]
pub struct FilmMaker {
    /// Number of pictures of a film with this name.
    pub pictures: fn(&Path) -> u64,
    /// Makes a film.
    pub make: MakeFilm,
}
