use std::{fs, io::Cursor, path::Path};

use zip::{ZipWriter, write::SimpleFileOptions};

/// Length of the head before the archive, bytes.
const HEAD: usize = 16;

/// Adds an empty file to the archive of a `.tilt`.
pub fn add_to_sketch(tilt: &Path, name: &str) {
    let mut bytes = fs::read(tilt).expect("a sketch");
    let mut zip = ZipWriter::new_append(Cursor::new(bytes.split_off(HEAD))).expect("an archive");
    zip.start_file(name, SimpleFileOptions::default()).expect("a file");
    bytes.extend(zip.finish().expect("an archive").into_inner());
    fs::write(tilt, bytes).expect("written");
}
