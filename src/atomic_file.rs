//! Files that appear under their name only once they are whole.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::Path,
};

/// Writes a file beside `path`, brings it to the disk and gives it its name: whoever opens `path` finds what was there
/// before or the whole new file.
///
/// # Errors
/// `write` fails, or the file cannot be made; what was at `path` is still there.
pub(crate) fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut name = OsString::from(format!(".unfinished-{}-", std::process::id()));
    name.push(path.file_name().ok_or(io::ErrorKind::InvalidInput)?);
    let beside = path.with_file_name(name);
    let written = File::create(&beside).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.into_inner()?.sync_all()?;
        fs::rename(&beside, path)
    });
    if written.is_err() {
        // The error that counts is the one at hand.
        let _ = fs::remove_file(&beside);
    }
    written
}
