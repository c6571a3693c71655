//! Reads small files that a user names and that are not sessions. Only regular files up to a given size are read. A
//! pipe, a device or a file of gigabytes gives a clear error.

use std::{
    io::{self, Read},
    path::Path,
};

use crate::platform::fs::{self, File};

/// Opens a regular file. Pipes and devices are refused: reading a pipe would wait for a writer, and a device may never
/// end.
pub fn open_regular(path: &Path) -> io::Result<File> {
    check_regular(path)?;
    File::open(path)
}

/// Checks that a path names a regular file, for callers that pass the path to another reader.
pub fn check_regular(path: &Path) -> io::Result<()> {
    let data = fs::metadata(path)?;
    if data.is_file() {
        return Ok(());
    }
    let found = if data.is_dir() { "a folder" } else { "a pipe or a device" };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("expected a regular file; found {found}")))
}

/// Reads a regular file of UTF-8 text of at most `most_bytes` bytes.
pub fn read_text(path: &Path, most_bytes: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(most_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes {
        let message = format!("expected at most {most_bytes} bytes; found more");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    String::from_utf8(bytes).map_err(|error| {
        let message = format!("byte {}: expected text in UTF-8", error.utf8_error().valid_up_to());
        io::Error::new(io::ErrorKind::InvalidData, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_up_to_the_limit_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        fs::write(&path, "12345").expect("written");
        assert_eq!(read_text(&path, 5).expect("short enough"), "12345");
        let long = read_text(&path, 4).expect_err("too long");
        assert_eq!(long.to_string(), "expected at most 4 bytes; found more");
        let refused = |path: &Path| read_text(path, 5).expect_err("refused").to_string();
        assert!(refused(folder.path()).ends_with("found a folder"));
        #[cfg(unix)]
        assert!(refused(Path::new("/dev/zero")).ends_with("found a pipe or a device"));
    }
}
